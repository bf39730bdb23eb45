// What the rod makes of a contact, and what it keeps of it.
#pragma once

#include <calot/math.hpp>

#include <cstdint>
#include <vector>

namespace calot::rod_cosserat {

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
    double inverse_mass = 0, inverse_mass_n = 0,
           inverse_mass_2 = 0; ///< 1/kg, of the nodes; along the normal; along e2, spin included
    int response = -1;         ///< of the whole shaft to a force along the normal; -1: the nodes' own
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

/// How the shaft moves under a unit force at one contact, lengths kept.
struct Response {
    std::vector<double> x, y, z;              ///< 1/kg, of each node
    double base_tension = 0, tip_tension = 0; ///< of the first and the last segment
};

struct ContactMemory {
    std::uint64_t id = 0;
    Vec3 stick;
};

} // namespace calot::rod_cosserat
