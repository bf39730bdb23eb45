// What is known of an endoscope: assets/endoscopes/*.toml. Figures only; `Endoscope` makes it move.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace calot::simulation {

/// A figure along a segment: at its end towards the handle and at its end towards the tip, linear between.
struct Gradient {
    double from = 0, to = 0;
    double at(double share) const { return from + share * (to - from); }
};

/// s: bending_damping of a datasheet at most. A sheath of loss factor 0.5 swinging at 1 Hz loses as much as
/// 0.5 / (2 pi) s does.
inline constexpr double most_bending_damping = 0.1;

/// A stretch of the shaft. SI units, at room temperature.
struct ShaftSegment {
    std::string name;
    bool bends = false;          // part of the bending section
    double length = 0;           // m
    double outer_radius = 0;     // m
    double mass_per_length = 0;  // kg/m
    Gradient flexural_rigidity;  // EI, N m2
    Gradient torsional_rigidity; // GJ, N m2
    double bending_damping = 0;  // s: viscous moment per curvature rate, over EI
    double torsion_damping = 0;  // s: likewise for twist, over GJ
    double drag = 0;             // N s/m2
    double friction_factor = 1;  // on the organ's Coulomb coefficient
};

/// The wheels, and the wires by which they pull at the bending section. Moments are those that the wires
/// exert on the section: pull times their distance from its axis.
struct Angulation {
    double up = 0, down = 0, left = 0, right = 0; // rad at the wheels' stops, if the wires gave nothing away
    double wheel_ratio = 1;                       // rad of angulation for each rad of wheel, likewise
    double wire_stiffness = 0;                    // N m/rad: moment for each rad that the section lags
    double pull_limit = 0;                        // N m: the wheels give no more
    double friction = 0;                          // N m: lost between wheel and section, either way
    double slack = 0;                             // rad between pulling one way and the other
    double max_speed = 0;                         // rad/s of angulation
};

/// What becomes of the shaft in the patient.
struct Warmth {
    double bending_factor = 1, torsion_factor = 1; // on EI and GJ at body temperature
    double warm_up = 60;                           // s: time constant
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

/// Angulation that somebody measured: what `calot bench endoscope` compares with. Nothing is simulated by it.
struct MeasuredAngulation {
    std::string instrument;                      // in the first channel that it fits; empty: none
    std::optional<double> up, down, left, right; // rad
    double tolerance = 0;                        // rad
};

struct EndoscopeDatasheet {
    std::string id, title, file;
    double working_length = 0;          // m
    std::vector<ShaftSegment> segments; // from handle to tip; those of the bending section are the last
    Angulation angulation;
    double torque_asymmetry = 0; // share by which GJ is lower when the tip lags behind a right-handed turn
    Warmth warmth;
    CameraOptics camera;
    std::vector<WorkingChannel> channels;
    std::vector<MeasuredAngulation> measured;

    double bending_length() const; // m
    double outer_radius() const;   // m, the largest
};

/// Throws host::UserError, one line: "FILE: FIELD: what; remedy". Unknown keys, values that are not finite
/// or out of their bounds, and figures without a source are errors.
EndoscopeDatasheet read_endoscope(const std::filesystem::path& file);
EndoscopeDatasheet parse_endoscope(std::string_view toml, const std::string& file);

/// What lies in a working channel, as far as the shaft feels it: assets/instruments/*.toml.
struct InstrumentDatasheet {
    std::string id, title, file;
    double diameter = 0;          // m, the largest that passes the channel
    double flexural_rigidity = 0; // EI, N m2
    double mass_per_length = 0;   // kg/m
};

/// As for endoscopes.
InstrumentDatasheet read_instrument(const std::filesystem::path& file);
InstrumentDatasheet parse_instrument(std::string_view toml, const std::string& file);

/// The file that a user's word means: a path, or the name of a datasheet in `folder`. Throws host::UserError
/// with the names that there are; `option` is what the word was given for.
std::filesystem::path find_datasheet(const std::filesystem::path& folder, const std::string& word,
                                     const std::string& option);

} // namespace calot::simulation
