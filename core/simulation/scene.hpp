// What a procedure asks for: the scene file (docs/scenes.md).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace calot::simulation {

/// Where the shaft is when the case begins.
struct StartPose {
    std::string name;
    std::string path;     // a landmark with points: the shaft lies along it, from the guide's exit on
    double insertion = 0; // m beyond the guide's exit
    double rotation = 0;  // rad
    std::array<double, 2> wheels{};
    // The seed draws each from its value +- its spread, evenly.
    double insertion_spread = 0, rotation_spread = 0;
    std::array<double, 2> wheels_spread{};
};

/// A marker whose place the anatomy knows. The procedure shows it with MARKER_SET and this id; what its
/// marker leaves at zero (position, normal, radius, polyline, colour) comes from here.
struct SceneMarker {
    std::string id;
    std::uint32_t kind = 0; // CALOT_MARKER_...
    std::string landmark;
    std::array<double, 4> colour{};
    bool is_shown = false; // from the start
};

struct SceneDescription {
    std::string file; // for messages
    std::string text; // as given
    std::string anatomy = "reference";
    std::string endoscope = "gif-2t160";
    std::array<double, 3> gravity{0, 9.81, 0}; // m/s2
    std::vector<std::string> organs;           // ids; empty: all that the anatomy has
    std::string guide = "guide";               // landmark: where the shaft enters, +z inwards
    std::vector<StartPose> starts; // at least one; the first is "default" unless one has that name
    std::vector<SceneMarker> markers;

    const StartPose* start(std::string_view name) const;
};

/// Throws host::UserError, one line: "FILE: FIELD: what; remedy".
SceneDescription parse_scene(std::string_view toml, const std::string& file);

} // namespace calot::simulation
