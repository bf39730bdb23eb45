// Contacts of the shaft with organs and with itself, found beside the next step on a thread of their own, or
// in turn on the caller's: the same data either way.
#pragma once

#include "geometry/chain_contacts.hpp"
#include "geometry/triangle_scene.hpp"

#include <calot/abi/contact.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace calot::simulation {

/// Whose surface a contact is on.
struct ContactOwner {
    /// Stands for an organ: the other side is the shaft itself.
    static constexpr std::uint32_t shaft = 0xffffffffu;
    std::uint32_t organ, region;
};

/// What a query found, as the rod takes it: contacts with organs from base to tip, then those with itself.
struct ContactList {
    std::vector<calot_contact> contact; // capacity; `count` are valid
    std::vector<ContactOwner> owner;
    std::size_t count = 0;
    std::size_t left_out = 0; // of those found that did not fit; the deepest of both kinds were kept
    double deepest = 0;       // m, of penetration into organs
    double deepest_self = 0;  // m, into itself
    double seconds = 0;       // that the query took
    double self_seconds = 0;  // of that, for contacts with itself
    std::span<const calot_contact> all() const { return {contact.data(), count}; }
};

class Collision {
  public:
    /// Coulomb coefficient of a sheath on a sheath, before a segment's factor. E: none is published for wet
    /// polyurethane on itself; above the wet walls of the upper tract (0.03-0.15, 10.1007/s11249-018-1123-x).
    static constexpr double self_friction = 0.15;

    /// `radius` N-1, m. With `on_thread` queries run on a worker.
    Collision(const geometry::TriangleScene& scene, std::span<const double> radius, std::size_t most_contacts,
              bool on_thread);
    ~Collision();

    /// Asks for real-time scheduling of the worker, if there is one.
    void schedule_first();

    /// Begins the query of these nodes (3N interleaved, m; copied) for contacts up to `reach` (m) ahead.
    /// `first_segment`: those before it lie in the guide. After the result of the one before was fetched with
    /// finish().
    void begin(std::span<const double> position, double reach, std::size_t first_segment);
    /// Waits for it, if there is one; otherwise the result of the last. Valid until the begin() after the
    /// next.
    const ContactList& finish();
    /// m that the node that went farthest is away from where it was when the last query began.
    double farthest_since(std::span<const double> position) const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace calot::simulation
