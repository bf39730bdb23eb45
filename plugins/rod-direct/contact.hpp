// What the rod is told about a contact, and what it keeps of it.
#pragma once

#include "frame_math.hpp"
#include "lanes.hpp"

#include <array>
#include <cstdint>

namespace calot::rod_direct {

/// One point where the rod's surface touches, or nearly touches, something. Geometry is of the query's pose.
struct Contact {
    std::int32_t segment = 0; ///< of the rod
    double along = 0.0;       ///< 0 at the segment's base-side node, 1 at the other
    Vec3 normal;              ///< unit, from the other side to the rod
    double gap = 0.0;         ///< m, between the surfaces; negative when they overlap
    Vec3 centre;              ///< m, the rod's centreline point at the query
    double friction = 0.0;    ///< Coulomb coefficient of the other side
    Vec3 motion;              ///< m, displacement of the other side's surface, were there no contact,
                              ///< from the query to the tick's end
    std::array<double, 9> compliance{}; ///< m/N, row by row: displacement of the other side at the tick's end
                                        ///< for a force held over the tick; zero if rigid
    std::uint64_t id = 0; ///< the same as long as the contact lasts; carries stick from tick to tick
    std::int32_t other_segment = -1; ///< of the rod itself, in self-contact
    double other_along = 0.0;
};

enum class Touch : std::uint8_t { open, stick, slip };

/// Prepared for one tick.
struct ContactRow {
    int index = 0;   ///< in the list given
    int segment = 0; ///< its nodes are segment and segment + 1
    int node = 0;    ///< the one of them whose displacement, with the segment's turn, gives the contact's
    double along = 0;
    Vec3 normal, lever;                      ///< lever: m, from the centreline to the surface
    Vec3 arm;                                ///< m, from the node to the surface point
    double gap = 0, bound = 0, friction = 0; ///< bound: m; the least gap that the tick shall end with
    Vec3 centre, motion, start;              ///< start: m, the centreline point at the tick's start
    Sym<double> compliance{};                ///< m/N; the other side's
    Vec3 anchor;                             ///< m; slip since the surfaces last stuck, at the tick's start
    int other = -1;                          ///< segment, in self-contact
    double other_along = 0;
    Vec3 other_lever, other_start;

    Touch touch = Touch::open;
    double f_n = 0;  ///< N; the normal force that the friction's bound is taken from
    Vec3 heading;    ///< unit; of the friction while it slips
    double slid = 0; ///< m; how far it slips in this tick
    // f = force - stiffness (displacement since the present iterate).
    Sym<double> stiffness{};
    Vec3 force;
    Vec3 f;           ///< N, on the rod, of the last solve
    Vec3 reaction;    ///< N, that the other segment was given in the last solve
    Vec3 other_moved; ///< m, by the other segment's point in the last solve
};

struct ContactMemory {
    std::uint64_t id = 0;
    Vec3 anchor, f;
    bool slips = false;
};

} // namespace calot::rod_direct
