#include "simulation/scene.hpp"

#include "simulation/toml_reader.hpp"

#include <calot/abi/device.h>

#include <algorithm>
#include <numbers>

namespace calot::simulation {

namespace {

constexpr std::size_t most_starts = 32, most_markers = 32, most_organs = 64;

StartPose read_start(const std::string& file, const std::string& name, const toml::table& table) {
    TomlReader reader(file, "start." + name + ".", table);
    StartPose start;
    start.name = name;
    start.path = reader.word("path");
    start.insertion = reader.number("insertion", 0.02, 3);
    start.rotation = reader.number("rotation", -10, 10, 0);
    start.insertion_spread = reader.number("insertion_spread", 0, 0.5, 0);
    start.rotation_spread = reader.number("rotation_spread", 0, std::numbers::pi, 0);
    if (reader.has("wheels")) {
        const auto wheels = reader.numbers("wheels", 2, -10, 10);
        start.wheels = {wheels[0], wheels[1]};
    }
    if (reader.has("wheels_spread")) {
        const auto spread = reader.numbers("wheels_spread", 2, 0, 1);
        start.wheels_spread = {spread[0], spread[1]};
    }
    if (start.insertion - start.insertion_spread < 0.01)
        reader.refuse("insertion_spread", "would start the shaft outside the guide's exit; lower it");
    reader.finish();
    return start;
}

SceneMarker read_marker(const std::string& file, const std::string& id, const toml::table& table) {
    TomlReader reader(file, "marker." + id + ".", table);
    SceneMarker marker;
    marker.id = id;
    const std::string kind = reader.word("kind");
    marker.kind = kind == "path"    ? CALOT_MARKER_PATH
                  : kind == "ring"  ? CALOT_MARKER_RING
                  : kind == "point" ? CALOT_MARKER_POINT
                  : kind == "line"  ? CALOT_MARKER_LINE
                                    : 0;
    if (marker.kind == 0) reader.refuse("kind", "is \"" + kind + "\"; use path, ring, point or line");
    marker.landmark = reader.word("landmark");
    const auto colour = reader.numbers("colour", 4, 0, 1);
    std::copy(colour.begin(), colour.end(), marker.colour.begin());
    marker.is_shown = reader.truth("shown", false);
    reader.finish();
    return marker;
}

} // namespace

const StartPose* SceneDescription::start(std::string_view name) const {
    for (const StartPose& s : starts)
        if (s.name == name) return &s;
    return name == "default" && !starts.empty() ? &starts.front() : nullptr;
}

SceneDescription parse_scene(std::string_view text, const std::string& file) {
    const toml::table root = parse_toml(text, file);
    TomlReader reader(file, "", root);
    reader.whole("format", 1, 1);
    SceneDescription scene;
    scene.file = file;
    scene.text = text;
    scene.anatomy = reader.word("anatomy", "reference");
    scene.endoscope = reader.word("endoscope", "gif-2t160");
    if (reader.has("gravity")) {
        const auto gravity = reader.numbers("gravity", 3, -30, 30);
        std::copy(gravity.begin(), gravity.end(), scene.gravity.begin());
    }
    scene.organs = reader.words("organs", most_organs);
    for (std::size_t i = 0; i < scene.organs.size(); ++i)
        if (std::count(scene.organs.begin(), scene.organs.end(), scene.organs[i]) > 1)
            reader.refuse("organs", "names \"" + scene.organs[i] + "\" twice; remove one");
    scene.guide = reader.word("guide", "guide");
    const toml::table& starts = reader.table("start");
    if (starts.empty() || starts.size() > most_starts)
        reader.refuse("start", "must hold 1 to " + std::to_string(most_starts) + " start poses");
    for (auto&& [key, value] : starts) {
        if (!value.is_table()) reader.refuse("start." + std::string(key.str()), "must be a table");
        scene.starts.push_back(read_start(file, std::string(key.str()), *value.as_table()));
    }
    if (const toml::table* markers = reader.find_table("marker")) {
        if (markers->size() > most_markers)
            reader.refuse("marker", "must hold at most " + std::to_string(most_markers) + " markers");
        for (auto&& [key, value] : *markers) {
            if (!value.is_table()) reader.refuse("marker." + std::string(key.str()), "must be a table");
            if (key.str().size() > 60)
                reader.refuse("marker", "has a name of more than 60 bytes; shorten it");
            scene.markers.push_back(read_marker(file, std::string(key.str()), *value.as_table()));
        }
    }
    reader.finish();
    return scene;
}

} // namespace calot::simulation
