// Rods as strings of beads in a vessel, seen from the side.
#pragma once

#include <calot/math.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace calot::plot {

struct Bead {
    Vec3 centre;              // m
    bool is_touching = false; // green; otherwise red
};

/// One rod in the vessel.
struct BeadString {
    std::string title{};
    double radius = 0; // m, of each bead
    std::vector<Bead> beads{};
};

/// A tube round a curve.
struct Vessel {
    std::vector<Vec3> axis{}; // close together
    double radius = 0;        // m
};

/// Draws the strings below each other, all in the same vessel and seen across the plane in which it bends
/// most, with a scale bar; writes `file`, a .png or .svg, whole or not at all. Throws host::UserError.
/// [main thread]
void draw(const Vessel& vessel, const std::vector<BeadString>& strings, const std::filesystem::path& file);

} // namespace calot::plot
