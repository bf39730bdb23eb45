#include "simulation/endoscope_datasheet.hpp"

#include "simulation/toml_reader.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

namespace calot::simulation {

namespace {

constexpr double degrees = std::numbers::pi / 180;
constexpr std::size_t most_segments = 40;

// A source stands for the figure of its name in the table beside it, and every figure has one. A single text
// stands for all of them.
void check_source(const TomlReader& reader, const toml::table& table) {
    const toml::node* source = table.get("source");
    if (source != nullptr && source->is_string()) return;
    const toml::table* sources = source != nullptr ? source->as_table() : nullptr;
    if (source != nullptr && sources == nullptr)
        reader.refuse("source", "must be a text or a table with a text for each figure");
    if (sources != nullptr)
        for (auto&& [key, value] : *sources) {
            const std::string name(key.str());
            if (!table.contains(name))
                reader.refuse("source." + name, "names no figure of this table; remove it");
            if (!value.is_string()) reader.refuse("source." + name, "must be a text in quotes");
        }
    for (auto&& [key, value] : table) {
        const std::string name(key.str());
        const bool is_figure = value.is_number() || value.is_array();
        if (is_figure && name != "format" && (sources == nullptr || !sources->contains(name)))
            reader.refuse("source." + name, "is missing; say where the figure is from, or why it is a guess");
    }
}

// One number, or one for either end.
Gradient gradient(TomlReader& reader, std::string_view key, double least, double most) {
    const toml::node* node = reader.find(key);
    if (node != nullptr && node->is_array()) {
        const auto ends = reader.numbers(key, 2, least, most);
        return {ends[0], ends[1]};
    }
    const double both = reader.number(key, least, most);
    return {both, both};
}

ShaftSegment read_segment(const std::string& file, std::size_t index, const toml::table& table) {
    TomlReader reader(file, "segment[" + std::to_string(index) + "].", table);
    ShaftSegment s;
    s.name = reader.word("name");
    s.bends = reader.truth("bends", false);
    s.length = reader.number("length", 0.005, 5);
    s.outer_radius = reader.number("outer_radius", 5e-4, 0.02);
    s.mass_per_length = reader.number("mass_per_length", 1e-3, 5);
    s.flexural_rigidity = gradient(reader, "flexural_rigidity", 1e-5, 1);
    s.torsional_rigidity = gradient(reader, "torsional_rigidity", 1e-5, 10);
    s.bending_damping = reader.number("bending_damping", 0, most_bending_damping);
    s.torsion_damping = reader.number("torsion_damping", 0, 10);
    s.drag = reader.number("drag", 0, 1000);
    s.friction_factor = reader.number("friction_factor", 0, 10);
    reader.finish();
    check_source(reader, table);
    return s;
}

std::vector<ShaftSegment> read_segments(const std::string& file, TomlReader& root, double working_length) {
    std::vector<ShaftSegment> segments;
    double sum = 0;
    for (const toml::table* table : root.tables("segment", most_segments)) {
        segments.push_back(read_segment(file, segments.size(), *table));
        sum += segments.back().length;
    }
    if (segments.size() < 2)
        root.refuse("segment", "is missing; give the shaft and the bending section as [[segment]] each, from "
                               "the handle to the tip");
    for (std::size_t i = 0; i < segments.size(); ++i) {
        const std::string name = "segment[" + std::to_string(i) + "].bends";
        if (i == 0 && segments[i].bends) root.refuse(name, "is true; begin with the shaft at the handle");
        if (i > 0 && segments[i - 1].bends && !segments[i].bends)
            root.refuse(name, "is false after a segment that bends; the bending section comes last");
    }
    if (!segments.back().bends)
        root.refuse("segment[" + std::to_string(segments.size() - 1) + "].bends",
                    "is false; the last segments are the bending section: set bends = true");
    if (std::abs(sum - working_length) > 5e-4) {
        std::ostringstream message;
        message << "is " << working_length << ", but the segments' lengths add up to " << sum
                << "; correct one of them";
        root.refuse("working_length", message.str());
    }
    return segments;
}

Angulation read_angulation(const std::string& file, const toml::table& table) {
    TomlReader reader(file, "angulation.", table);
    Angulation a;
    a.up = degrees * reader.number("up_degrees", 0, 270);
    a.down = degrees * reader.number("down_degrees", 0, 270);
    a.left = degrees * reader.number("left_degrees", 0, 270);
    a.right = degrees * reader.number("right_degrees", 0, 270);
    a.wheel_ratio = reader.number("wheel_ratio", 0.05, 20);
    a.wire_stiffness = reader.number("wire_stiffness", 1e-3, 100);
    a.pull_limit = reader.number("pull_limit", 1e-4, 10);
    a.friction = reader.number("friction", 0, 0.5 * a.pull_limit);
    a.slack = degrees * reader.number("slack_degrees", 0, 60);
    a.max_speed = degrees * reader.number("max_speed_degrees", 1, 2000);
    reader.finish();
    check_source(reader, table);
    return a;
}

Warmth read_warmth(const std::string& file, const toml::table& table) {
    TomlReader reader(file, "temperature.", table);
    Warmth w;
    w.bending_factor = reader.number("bending_factor", 0.1, 2);
    w.torsion_factor = reader.number("torsion_factor", 0.1, 2);
    w.warm_up = reader.number("warm_up_seconds", 1, 3600);
    reader.finish();
    check_source(reader, table);
    return w;
}

double read_asymmetry(const std::string& file, const toml::table& table) {
    TomlReader reader(file, "torque.", table);
    const double asymmetry = reader.number("asymmetry", 0, 0.5);
    reader.finish();
    check_source(reader, table);
    return asymmetry;
}

CameraOptics read_camera(const std::string& file, const toml::table& table) {
    TomlReader reader(file, "camera.", table);
    CameraOptics c;
    c.field_of_view = degrees * reader.number("field_of_view_degrees", 20, 179);
    c.near_limit = reader.number("near_limit", 1e-4, 0.1);
    c.far_limit = reader.number("far_limit", c.near_limit, 10);
    c.projection = reader.text("projection");
    if (c.projection != "equidistant") reader.refuse("projection", "is not known; use \"equidistant\"");
    c.light_exponent = reader.number("light_exponent", 0, 10);
    reader.finish();
    check_source(reader, table);
    return c;
}

WorkingChannel read_channel(const std::string& file, std::size_t index, const toml::table& table) {
    TomlReader reader(file, "channel[" + std::to_string(index) + "].", table);
    WorkingChannel c;
    c.diameter = reader.number("diameter", 5e-4, 0.02);
    const auto position = reader.numbers("position", 2, -0.02, 0.02);
    c.position = {position[0], position[1]};
    reader.finish();
    check_source(reader, table);
    return c;
}

MeasuredAngulation read_measured(const std::string& file, std::size_t index, const toml::table& table) {
    TomlReader reader(file, "measured[" + std::to_string(index) + "].", table);
    MeasuredAngulation m;
    m.instrument = reader.word("instrument", "");
    const auto angle = [&](std::string_view key) -> std::optional<double> {
        if (!reader.has(key)) return {};
        return degrees * reader.number(key, 0, 270);
    };
    m.up = angle("up_degrees"), m.down = angle("down_degrees");
    m.left = angle("left_degrees"), m.right = angle("right_degrees");
    m.tolerance = degrees * reader.number("tolerance_degrees", 0.1, 90);
    reader.finish();
    check_source(reader, table);
    return m;
}

} // namespace

double EndoscopeDatasheet::bending_length() const {
    double sum = 0;
    for (const ShaftSegment& s : segments)
        if (s.bends) sum += s.length;
    return sum;
}

double EndoscopeDatasheet::outer_radius() const {
    double most = 0;
    for (const ShaftSegment& s : segments)
        most = std::max(most, s.outer_radius);
    return most;
}

EndoscopeDatasheet parse_endoscope(std::string_view text, const std::string& file) {
    const toml::table root = parse_toml(text, file);
    TomlReader reader(file, "", root);
    reader.whole("format", 2, 2);
    EndoscopeDatasheet sheet;
    sheet.file = file;
    sheet.id = reader.word("id");
    sheet.title = reader.text("title");
    sheet.working_length = reader.number("working_length", 0.1, 5);
    sheet.segments = read_segments(file, reader, sheet.working_length);
    if (sheet.bending_length() > 0.5 * sheet.working_length)
        reader.refuse("segment", "bend over more than half of working_length; shorten the bending section");
    sheet.angulation = read_angulation(file, reader.table("angulation"));
    sheet.torque_asymmetry = read_asymmetry(file, reader.table("torque"));
    sheet.warmth = read_warmth(file, reader.table("temperature"));
    sheet.camera = read_camera(file, reader.table("camera"));
    for (const toml::table* table : reader.tables("channel", 4))
        sheet.channels.push_back(read_channel(file, sheet.channels.size(), *table));
    for (const toml::table* table : reader.tables("measured", 20))
        sheet.measured.push_back(read_measured(file, sheet.measured.size(), *table));
    reader.finish();
    check_source(reader, root);
    return sheet;
}

EndoscopeDatasheet read_endoscope(const std::filesystem::path& file) {
    return parse_endoscope(read_text(file), file.string());
}

InstrumentDatasheet parse_instrument(std::string_view text, const std::string& file) {
    const toml::table root = parse_toml(text, file);
    TomlReader reader(file, "", root);
    reader.whole("format", 1, 1);
    InstrumentDatasheet sheet;
    sheet.file = file;
    sheet.id = reader.word("id");
    sheet.title = reader.text("title");
    sheet.diameter = reader.number("diameter", 1e-4, 0.02);
    sheet.flexural_rigidity = reader.number("flexural_rigidity", 0, 0.1);
    sheet.mass_per_length = reader.number("mass_per_length", 0, 1);
    reader.finish();
    check_source(reader, root);
    return sheet;
}

InstrumentDatasheet read_instrument(const std::filesystem::path& file) {
    return parse_instrument(read_text(file), file.string());
}

std::filesystem::path find_datasheet(const std::filesystem::path& folder, const std::string& word,
                                     const std::string& option) {
    std::error_code problem;
    if (word.find('/') != std::string::npos || word.ends_with(".toml")) return word;
    std::filesystem::path named = folder / (word + ".toml");
    if (std::filesystem::is_regular_file(named, problem)) return named;
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder, problem))
        if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
    std::sort(names.begin(), names.end());
    std::string known;
    for (const std::string& name : names)
        known += (known.empty() ? "" : ", ") + name;
    throw host::UserError(option, word, "is neither a file nor one of " + known);
}

} // namespace calot::simulation
