// Contacts of a chain of capsules (an endoscope's shaft, an instrument) with a scene of organs.
//
// What counts as a contact. The distance between the chain and a surface has isolated local minima: over a
// node, where its foot on the surface is nearest among the neighbouring surface points; and over the inside
// of a segment, where it passes a convex edge or a corner at right angles. Each such minimum within `margin`
// is a contact. A shaft in a tube, across folds or through a hole is so held from every side that it can
// touch, each with the true normal; sliding from face to face over a convex edge turns the normal without a
// jump; a shaft on a flat wall gets one contact at each node and none twice at the ends that segments share.
// Minima are then thinned: of several that push a node in nearly one direction the deepest stays, and the
// inside of a segment keeps what the contacts at both of its ends do not already imply.
//
// Sides. The centreline lies outside the solids, so features seen from their back are ignored: the outer face
// of the wall whose inner face is touched, for one. Should the centreline sink into a solid all the same, the
// contact of the tick before tells on which side it came in: normal kept, gap = -distance - radius.
//
// Speed. A chain that stays within a margin m of radius r is seen from the right side as long as no node
// moves more than m + r in a tick: with m = 2 mm and r = 6.3 mm that is 8.3 m/s, 27 times the fastest
// insertion of 0.3 m/s; and a contact first shows up m before it touches, 6 ticks ahead at 0.3 m/s, so that
// one tick of latency (0.3 mm) never lets a wall of 4 mm be passed. No sweep is needed.
#pragma once

#include "geometry/triangle_scene.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace calot::geometry {

// A chain in the caller's memory. Segment i joins nodes i and i + 1.
struct Chain {
    std::span<const double> x, y, z; // N each: nodes, m, world LPS
    std::span<const double> radius;  // N - 1: of each segment, m, > 0
    std::size_t first_segment = 0;   // segments before it are not tested (not yet inserted)

    // From one block of 3 N doubles, all x, then all y, then all z.
    static Chain of_block(std::span<const double> block, std::span<const double> radius,
                          std::size_t first_segment = 0) {
        const std::size_t n = block.size() / 3;
        return {block.first(n), block.subspan(n, n), block.subspan(2 * n, n), radius, first_segment};
    }
    std::size_t node_count() const { return x.size(); }
    Vec3 node(std::size_t i) const { return {x[i], y[i], z[i]}; }
    // The thicker of the tested segments that meet at a node.
    double node_radius(std::size_t i) const {
        const double before = i > first_segment ? radius[i - 1] : 0.0;
        return i < radius.size() && radius[i] > before ? radius[i] : before;
    }
    // Two to most_nodes nodes, spans that fit, positive radii, tested nodes finite.
    bool acceptable(std::size_t most_nodes) const;
};

struct Contact {
    std::uint64_t id;       // the same from tick to tick while the contact slides; never 0, never given twice
    std::uint32_t organ;    // index in the scene
    std::uint32_t region;   // of the triangle
    std::uint32_t triangle; // index in the organ, as given
    std::uint32_t segment;
    double t;        // place on the segment, [0, 1]; contacts at nodes have exactly 0 (1 at the last node)
    Vec3 point;      // on the surface, m
    Vec3 normal;     // unit, from the surface towards the centreline
    double gap;      // distance - radius, m; negative: penetration
    double friction; // Coulomb coefficient of the region
};

class ChainContacts {
  public:
    static constexpr std::size_t most_per_node = 6, most_per_segment = 6;

    // Holds scratch and the contacts remembered from the tick before, for chains of up to `most_nodes` nodes.
    explicit ChainContacts(std::size_t most_nodes);
    ~ChainContacts();
    ChainContacts(ChainContacts&&) noexcept;
    ChainContacts& operator=(ChainContacts&&) noexcept;

    // Contacts of the chain with gap <= margin, from base to tip. Valid until the next call. Depends on the
    // scene, the chain and the contacts found by the call before (identities and sides), nothing else.
    // No allocation. One thread at a time for each object; any number of objects may share a scene.
    // A chain of fewer than two nodes, more than most_nodes, spans of different sizes, radii that are not
    // positive or a node that is not finite yields no contacts, and valid() is false; what is remembered
    // stays.
    std::span<const Contact> find(const TriangleScene& scene, const Chain& chain, double margin);

    bool valid() const;

    // Forgets the contacts of the tick before; the next identities start anew.
    void reset();

    // What the next find() remembers, as bytes: size, and copies out and in. `load` refuses a span that
    // save() of an object for the same most_nodes could not have written, and changes nothing then.
    std::size_t state_size() const;
    void save(std::span<std::byte> state) const;
    bool load(std::span<const std::byte> state);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace calot::geometry
