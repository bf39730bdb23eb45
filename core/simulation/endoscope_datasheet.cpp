#include "simulation/endoscope_datasheet.hpp"

#include "simulation/toml_reader.hpp"

#include <numbers>

namespace calot::simulation {

namespace {

constexpr double degrees = std::numbers::pi / 180;

// In one figure's source, or in a table of them, every text stands for a figure of the table beside it.
void check_source(TomlReader& reader, const toml::table& table) {
    const toml::table* sources = table.get("source") ? table.get("source")->as_table() : nullptr;
    if (sources == nullptr) return;
    for (auto&& [key, value] : *sources) {
        const std::string name(key.str());
        if (!table.contains(name))
            reader.refuse("source." + name, "names no figure of this table; remove it");
        if (!value.is_string()) reader.refuse("source." + name, "must be a text in quotes");
    }
}

ShaftSection read_section(const std::string& file, const std::string& name, const toml::table& table,
                          double working_length) {
    TomlReader reader(file, name + ".", table);
    ShaftSection s;
    s.name = name;
    s.length = name == "bending_section" ? reader.number("length", 0.01, 0.5 * working_length) : 0;
    s.outer_radius = reader.number("outer_radius", 5e-4, 0.02);
    s.mass_per_length = reader.number("mass_per_length", 1e-3, 5);
    s.flexural_rigidity = reader.number("flexural_rigidity", 1e-5, 1);
    s.torsional_rigidity = reader.number("torsional_rigidity", 1e-5, 10);
    s.bending_damping = reader.number("bending_damping", 0, 1e-3);
    s.torsion_damping = reader.number("torsion_damping", 0, 10);
    s.drag = reader.number("drag", 0, 1000);
    s.friction_factor = reader.number("friction_factor", 0, 10);
    check_source(reader, table);
    reader.finish();
    return s;
}

Angulation read_angulation(const std::string& file, const toml::table& table) {
    TomlReader reader(file, "angulation.", table);
    Angulation a;
    a.up = degrees * reader.number("up_degrees", 0, 270);
    a.down = degrees * reader.number("down_degrees", 0, 270);
    a.left = degrees * reader.number("left_degrees", 0, 270);
    a.right = degrees * reader.number("right_degrees", 0, 270);
    a.wheel_ratio = reader.number("wheel_ratio", 0.05, 20);
    a.backlash = degrees * reader.number("backlash_degrees", 0, 60);
    a.max_speed = degrees * reader.number("max_speed_degrees", 1, 2000);
    check_source(reader, table);
    reader.finish();
    return a;
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
    check_source(reader, table);
    reader.finish();
    return c;
}

} // namespace

EndoscopeDatasheet parse_endoscope(std::string_view text, const std::string& file) {
    const toml::table root = parse_toml(text, file);
    TomlReader reader(file, "", root);
    reader.whole("format", 1, 1);
    EndoscopeDatasheet sheet;
    sheet.file = file;
    sheet.id = reader.word("id");
    sheet.title = reader.text("title");
    sheet.working_length = reader.number("working_length", 0.1, 5);
    sheet.insertion_tube =
        read_section(file, "insertion_tube", reader.table("insertion_tube"), sheet.working_length);
    sheet.bending_section =
        read_section(file, "bending_section", reader.table("bending_section"), sheet.working_length);
    sheet.insertion_tube.length = sheet.working_length - sheet.bending_section.length;
    sheet.angulation = read_angulation(file, reader.table("angulation"));
    sheet.camera = read_camera(file, reader.table("camera"));
    int index = 0;
    for (const toml::table* table : reader.tables("channel", 4)) {
        TomlReader channel(file, "channel[" + std::to_string(index++) + "].", *table);
        WorkingChannel c;
        c.diameter = channel.number("diameter", 5e-4, 0.02);
        const auto position = channel.numbers("position", 2, -0.02, 0.02);
        c.position = {position[0], position[1]};
        check_source(channel, *table);
        channel.finish();
        sheet.channels.push_back(c);
    }
    reader.finish();
    return sheet;
}

EndoscopeDatasheet read_endoscope(const std::filesystem::path& file) {
    return parse_endoscope(read_text(file), file.string());
}

} // namespace calot::simulation
