// What the rod makes of a contact, and what it keeps of it.
#pragma once

#include "frame_math.hpp"
#include "lanes.hpp"

#include <cstdint>

namespace calot::rod_direct {

/// Prepared for one tick.
struct ContactRow {
    int index = 0;   ///< in the list given
    int segment = 0; ///< its nodes are segment and segment + 1
    int node = 0;    ///< the one of them whose displacement, with the segment's turn, gives the contact's
    double along = 0;
    Vec3 normal;
    Vec3 across; ///< unit; across the rod, in the contact's plane
    Vec3 lever;  ///< m, along the axis: the surface moves by lever . turn across, beside its centreline
    double gap = 0, bound = 0;        ///< m; bound: the least gap that the tick shall end with
    double friction = 0;              ///< coefficient
    double most_friction = 0;         ///< N; besides friction times the normal force
    double give = 0, give_across = 0; ///< m/N; of the other side, along the normal and across
    Vec3 centre, motion, start;       ///< start: m, the centreline point at the tick's start
    Vec3 anchor;                      ///< m; slip that friction has sprung back by, at the tick's start
    int other = -1;                   ///< segment, in self-contact
    double other_along = 0;
    Vec3 other_lever, other_start;
    double was_normal = 0; ///< N, in the last tick

    // Of one linearisation.
    Vec3 arm;            ///< m, from the node to the centreline point
    double gap_0 = 0;    ///< m; above the bound
    Vec3 slip_0;         ///< m
    double across_0 = 0; ///< m; of the centreline's motion against the other side in this tick, across

    // Of one pass. Force on the rod = force - stiffness moved.
    Vec3 moved; ///< m, of the surface point from the linearisation's iterate
    Sym<double> stiffness{};
    Vec3 force;
    double film = 0; ///< N/m; the film's force on the centreline is -film (across_0 + across . its way)
    Vec3 f;          ///< N, on the rod, of the last solve
    Vec3 next;       ///< m; where the last solve moves it to
    Vec3 given;      ///< N, what the other segment was given the negative of
    Vec3 other_moved;
};

struct ContactMemory {
    std::uint64_t id = 0;
    Vec3 anchor, f;
    double most_normal = 0; ///< N; falls by a fifth in a tick while the normal force is less
};

} // namespace calot::rod_direct
