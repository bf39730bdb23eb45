// Contacts of a chain of capsules with itself: loops, knots, turns lying side by side.
//
// As with surfaces, what counts are local minima of the distance: between the insides of two segments that
// cross, and between a node and the part of the chain beside it, unless the chain comes nearer further along.
#pragma once

#include "geometry/chain_contacts.hpp"

#include <cstdint>
#include <memory>
#include <span>

namespace calot::geometry {

struct SelfContact {
    std::uint64_t id;      // as Contact::id, with the highest bit set
    std::uint32_t segment; // the side that the normal pushes
    double t;              // place on it, [0, 1]
    std::uint32_t
        other_segment; // the other side: always the part nearer to the base, or equal for crossing insides
    double other_t;
    Vec3 point;  // on the other side's surface, m
    Vec3 normal; // unit, from the other side's axis to this one's
    double gap;  // between the surfaces, m; negative: penetration
};

class SelfContacts {
  public:
    static constexpr std::size_t most_per_slot = 4;
    // Parts of the chain nearer than this many radii along it are neighbours, whose contact says nothing: the
    // closest turn that can touch itself is half a circle of one radius, 3.2 radii of arc.
    static constexpr double neighbour_radii = 6.0;

    explicit SelfContacts(std::size_t most_nodes);
    ~SelfContacts();
    SelfContacts(SelfContacts&&) noexcept;
    SelfContacts& operator=(SelfContacts&&) noexcept;

    // Each pair of touching parts once, with gap <= margin, ordered from base to tip. Valid until the next
    // call. Conditions on the chain, memory and threads as for ChainContacts::find. No allocation.
    std::span<const SelfContact> find(const Chain& chain, double margin);

    bool valid() const;
    void reset();
    std::size_t state_size() const;
    void save(std::span<std::byte> state) const;
    bool load(std::span<const std::byte> state);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace calot::geometry
