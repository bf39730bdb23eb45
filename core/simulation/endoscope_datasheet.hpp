// What is known of an endoscope: assets/endoscopes/*.toml. Figures only; `Endoscope` makes it move.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace calot::simulation {

/// A stretch of the shaft with the same properties. SI units.
struct ShaftSection {
    std::string name;
    double length = 0;             // m
    double outer_radius = 0;       // m
    double mass_per_length = 0;    // kg/m
    double flexural_rigidity = 0;  // EI, N m2
    double torsional_rigidity = 0; // GJ, N m2
    double bending_damping = 0;    // s: viscous moment per curvature rate, over EI
    double torsion_damping = 0;    // s: likewise for twist, over GJ
    double drag = 0;               // N s/m2
    double friction_factor = 1;    // on the organ's Coulomb coefficient
};

struct Angulation {
    double up = 0, down = 0, left = 0, right = 0; // rad, the most
    double wheel_ratio = 1;                       // rad of angulation for each rad of wheel
    double backlash = 0;                          // rad of angulation lost at each change of direction
    double max_speed = 0;                         // rad/s of angulation
};

struct CameraOptics {
    double field_of_view = 0;               // rad, full angle, on the diagonal
    double near_limit = 0;                  // m, depth of field
    double far_limit = 0;                   // m
    std::string projection = "equidistant"; // r = f theta
    double light_exponent = 1;              // I0 cos^n(theta) / d2
};

struct WorkingChannel {
    double diameter = 0;              // m
    std::array<double, 2> position{}; // m on the tip's face: left, up from its centre
};

struct EndoscopeDatasheet {
    std::string id, title, file;
    double working_length = 0;                    // m
    ShaftSection insertion_tube, bending_section; // base to tip; the sum of lengths is working_length
    Angulation angulation;
    CameraOptics camera;
    std::vector<WorkingChannel> channels;
};

/// Throws host::UserError, one line: "FILE: FIELD: what; remedy". Unknown keys, values that are not finite
/// or out of their bounds are errors.
EndoscopeDatasheet read_endoscope(const std::filesystem::path& file);
EndoscopeDatasheet parse_endoscope(std::string_view toml, const std::string& file);

} // namespace calot::simulation
