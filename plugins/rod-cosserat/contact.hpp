// What the rod is told about a contact, and what it keeps of it.
#pragma once

#include "frame_math.hpp"

#include <array>
#include <cstdint>

namespace calot::rod_cosserat {

/// One point where the rod's surface touches, or nearly touches, something. Geometry is of the query's pose.
struct Contact {
    std::int32_t segment = 0; ///< of the rod
    double along = 0.0;       ///< 0 at the segment's base-side node, 1 at the other
    Vec3 normal;              ///< unit, from the other side to the rod
    double gap = 0.0;         ///< m, between the surfaces; negative when they overlap
    Vec3 centre;           ///< m, the rod's centreline point at the query; in self-contact from the other's
    double friction = 0.0; ///< Coulomb coefficient of the other side
    Vec3 motion;           ///< m, displacement of the other side's surface, were there no contact,
                           ///< from the query to the tick's end
    std::array<double, 9> compliance{}; ///< m/N, row by row: displacement of the other side at the tick's end
                                        ///< for a force held over the tick; zero if rigid
    std::uint64_t id = 0; ///< the same as long as the contact lasts; carries stick from tick to tick
    std::int32_t other_segment = -1; ///< of the rod itself, in self-contact
    double other_along = 0.0;
};

/// Prepared for the substeps of one tick.
struct ContactRow {
    int index = 0;                                ///< in the list given
    int a = 0, b = 0, other_a = -1, other_b = -1; ///< nodes
    double wa = 0, wb = 0, other_wa = 0, other_wb = 0;
    Vec3 normal, e1, e2; ///< e1 along the rod, e2 about it
    Vec3 centre;
    double gap = 0, friction = 0, lever = 0; ///< lever: m, arm of e2 about the rod's axis
    double other_lever = 0;
    Vec3 motion;
    double inverse_mass = 0, inverse_mass_2 = 0; ///< 1/kg along normal and e1; along e2, spin included
    double c_n = 0, c_1 = 0, c_2 = 0, c_n1 = 0, c_n2 = 0, c_12 = 0; ///< m/N
    double given =
        0; ///< m; what the impulses so far in this tick will have moved the other side, along the normal
    double bound = 0; ///< m; the gap asked for in this substep
    Vec3 start;       ///< m, of the centreline point, at the substep's start
    bool slips = false;
    double stick_1 = 0, stick_2 = 0;              ///< m; from the point where the surfaces stick
    double f_n = 0, f_1 = 0, f_2 = 0, f_film = 0; ///< N, in this substep
    Vec3 impulse;                                 ///< N s, so far in this tick
};

struct ContactMemory {
    std::uint64_t id = 0;
    Vec3 stick;
};

} // namespace calot::rod_cosserat
