#include "host/error.hpp"
#include "simulation/endoscope_datasheet.hpp"
#include "simulation/scene.hpp"
#include "simulation/toml_reader.hpp"
#include "simulation/world.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <unistd.h>

namespace calot::simulation {

namespace {

const std::filesystem::path assets = std::filesystem::path(CALOT_SOURCE_DIR) / "assets";

std::string shipped() {
    return read_text(assets / "endoscopes" / "gif-2t160.toml");
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << "the datasheet no longer holds \"" << from << "\"";
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string message_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const host::UserError& error) {
        return error.what();
    }
    return "nothing was refused";
}

std::string datasheet_error(const std::string& text) {
    return message_of([&] { parse_endoscope(text, "scope.toml"); });
}

class Folder {
  public:
    Folder() : path_(std::filesystem::temp_directory_path() / ("calot-world-" + std::to_string(::getpid()))) {
        std::filesystem::create_directories(path_);
    }
    ~Folder() { std::filesystem::remove_all(path_); }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

constexpr const char* scene_text = "format = 1\n[start.default]\npath = \"path\"\ninsertion = 0.14\n";

} // namespace

TEST(Datasheet, the_shipped_endoscope_has_the_figures_of_its_sources) {
    const EndoscopeDatasheet sheet = parse_endoscope(shipped(), "scope.toml");
    EXPECT_EQ(sheet.id, "gif-2t160");
    EXPECT_DOUBLE_EQ(sheet.working_length, 1.03);
    ASSERT_EQ(sheet.segments.size(), 2u);
    EXPECT_DOUBLE_EQ(sheet.segments[0].length + sheet.bending_length(), 1.03);
    EXPECT_DOUBLE_EQ(sheet.outer_radius(), 0.0063);
    EXPECT_NEAR(sheet.angulation.up, 210 * std::numbers::pi / 180, 1e-12);
    EXPECT_NEAR(sheet.camera.field_of_view, 140 * std::numbers::pi / 180, 1e-12);
    ASSERT_EQ(sheet.channels.size(), 2u);
    EXPECT_DOUBLE_EQ(sheet.channels[1].diameter, 0.0037);
}

TEST(Datasheet, a_negative_stiffness_is_refused_with_file_field_and_bounds) {
    const std::string line =
        datasheet_error(replaced(shipped(), "flexural_rigidity = 0.033", "flexural_rigidity = -0.033"));
    EXPECT_EQ(line, "scope.toml: segment[0].flexural_rigidity: is -0.033; it must lie between 1e-05 and 1");
}

TEST(Datasheet, an_unknown_key_is_refused_by_name) {
    EXPECT_EQ(
        datasheet_error(replaced(shipped(), "wheel_ratio = 1.0", "wheel_ratio = 1.0\nwheel_radius = 2")),
        "scope.toml: angulation.wheel_radius: is unknown; remove it or correct its name");
    EXPECT_EQ(datasheet_error("colour = 1\n" + shipped()),
              "scope.toml: colour: is unknown; remove it or correct its name");
}

TEST(Datasheet, what_is_missing_not_finite_of_wrong_type_or_no_toml_is_refused) {
    EXPECT_NE(datasheet_error(replaced(shipped(), "drag = ", "#drag = ")).find("segment[0].drag: is missing"),
              std::string::npos);
    EXPECT_NE(datasheet_error(replaced(shipped(), "up_degrees = 210", "up_degrees = nan"))
                  .find("angulation.up_degrees"),
              std::string::npos);
    EXPECT_NE(
        datasheet_error(replaced(shipped(), "format = 2", "format = \"2\"")).find("must be a whole number"),
        std::string::npos);
    EXPECT_NE(datasheet_error("= 3").find("scope.toml: line 1: "), std::string::npos);
    EXPECT_NE(datasheet_error("").find("format: is missing"), std::string::npos);
}

TEST(Datasheet, no_cut_or_flipped_byte_does_anything_but_parse_or_refuse) {
    const std::string text = shipped();
    int refused = 0;
    for (std::size_t at = 0; at < text.size(); at += 3) {
        refused += datasheet_error(text.substr(0, at)) != "nothing was refused";
        std::string flipped = text;
        flipped[at] = static_cast<char>(flipped[at] ^ (1 << (at % 7)));
        refused += datasheet_error(flipped) != "nothing was refused";
    }
    EXPECT_GT(refused, 500);
}

TEST(Scene, defaults_and_errors_are_those_of_the_documentation) {
    const SceneDescription scene = parse_scene(scene_text, "scene.toml");
    EXPECT_EQ(scene.anatomy, "reference");
    EXPECT_EQ(scene.guide, "guide");
    EXPECT_DOUBLE_EQ(scene.gravity[1], 9.81);
    ASSERT_NE(scene.start("default"), nullptr);
    EXPECT_EQ(scene.start("elsewhere"), nullptr);
    const auto error = [](const std::string& more) {
        return message_of([&] { parse_scene(scene_text + more, "scene.toml"); });
    };
    EXPECT_EQ(error("depth = 1\n"),
              "scene.toml: start.default.depth: is unknown; remove it or correct its name");
    EXPECT_EQ(error("insertion_spread = 0.2\n"),
              "scene.toml: start.default.insertion_spread: would start the "
              "shaft outside the guide's exit; lower it");
    EXPECT_EQ(error("[marker.a]\nkind = \"blob\"\n"),
              "scene.toml: marker.a.kind: is \"blob\"; use path, ring, point or line");
}

TEST(World, a_truncated_mesh_gives_one_line_with_its_file) {
    const Folder folder;
    const auto anatomy = folder.path() / "anatomy" / "reference";
    std::filesystem::create_directories(anatomy);
    std::filesystem::create_directories(folder.path() / "endoscopes");
    std::filesystem::copy(assets / "endoscopes" / "gif-2t160.toml",
                          folder.path() / "endoscopes" / "gif-2t160.toml");
    for (const auto& entry : std::filesystem::directory_iterator(assets / "anatomy" / "reference"))
        std::filesystem::copy(entry.path(), anatomy / entry.path().filename());
    std::filesystem::resize_file(anatomy / "upper-gi.glb", 100'000);
    SceneDescription scene = parse_scene(scene_text, "scene.toml");
    scene.organs = {"upper-gi"};
    const std::string line = message_of([&] { load_world(scene, {.assets = folder.path()}); });
    EXPECT_TRUE(line.starts_with((anatomy / "upper-gi.glb").string() + ": ")) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    scene.organs = {"spare-part"};
    EXPECT_NE(message_of([&] { load_world(scene, {.assets = folder.path()}); }).find("\"spare-part\""),
              std::string::npos);
    scene.organs = {"upper-gi"};
    scene.guide = "nowhere";
    EXPECT_NE(
        message_of([&] { load_world(scene, {.assets = assets}); }).find("scene.toml: guide: \"nowhere\""),
        std::string::npos);
}

TEST(World, friction_is_that_of_the_region_or_else_of_the_organ) {
    const auto world = load_world(parse_scene(scene_text, "scene.toml"), {.assets = assets});
    const Organ& organ = world->anatomy.organs.front();
    ASSERT_EQ(organ.id, "upper-gi");
    const std::vector<double> friction = friction_by_region(organ);
    ASSERT_EQ(friction.size(), organ.mesh.region_names.size());
    int others = 0;
    for (std::size_t r = 0; r < friction.size(); ++r) {
        const auto own = organ.region_friction.find(organ.mesh.region_names[r]);
        EXPECT_EQ(friction[r], own == organ.region_friction.end() ? organ.friction : own->second)
            << organ.mesh.region_names[r];
        others += friction[r] != organ.friction ? 1 : 0;
    }
    EXPECT_GT(others, 0) << "the stomach is smoother than the oesophagus";
    // What contacts are found with.
    bool is_seen[2] = {};
    for (const auto& triangle : world->surfaces.triangles()) {
        if (triangle.organ != 0) continue;
        ASSERT_EQ(world->surfaces.friction(triangle), friction[triangle.region]);
        is_seen[friction[triangle.region] == organ.friction] = true;
    }
    EXPECT_TRUE(is_seen[0] && is_seen[1]);
    // Asked for by the command line, it is that of every region.
    const auto asked = load_world(parse_scene(scene_text, "scene.toml"), {.assets = assets, .friction = 0.3});
    for (const auto& triangle : asked->surfaces.triangles())
        ASSERT_EQ(asked->surfaces.friction(triangle), 0.3);
}

TEST(World, friction_of_a_region_out_of_bounds_or_of_none_is_refused_with_file_and_field) {
    const Folder folder;
    const auto anatomy = folder.path() / "anatomy" / "reference";
    std::filesystem::create_directories(anatomy);
    std::filesystem::copy(assets / "endoscopes", folder.path() / "endoscopes");
    std::filesystem::copy(assets / "anatomy" / "reference" / "upper-gi.glb", anatomy / "upper-gi.glb");
    std::ifstream in(assets / "anatomy" / "reference" / "anatomy.toml");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    SceneDescription scene = parse_scene(scene_text, "scene.toml");
    scene.organs = {"upper-gi"};
    const auto error = [&](const std::string& in_its_place) {
        std::ofstream(anatomy / "anatomy.toml") << replaced(text, "stomach = 0.05", in_its_place);
        return message_of([&] { load_world(scene, {.assets = folder.path()}); });
    };
    const std::string file = (anatomy / "anatomy.toml").string();
    EXPECT_EQ(error("stomach = -0.1"),
              file + ": organ[0].region_friction.stomach: is -0.1; it must lie between 0 and 10");
    EXPECT_EQ(error("stomach = nan"),
              file + ": organ[0].region_friction.stomach: is nan; it must lie between 0 and 10");
    EXPECT_EQ(error("stomach = \"slippery\""), file + ": organ[0].region_friction.stomach: must be a number");
    const std::string none = error("stomak = 0.05");
    EXPECT_TRUE(none.starts_with(file + ": organ upper-gi: region_friction.stomak: is no region of "
                                        "upper-gi.glb; remove it or name one of: "))
        << none;
    EXPECT_NE(none.find("stomach"), std::string::npos) << none;
    EXPECT_EQ(error("stomach = 0.06"), "nothing was refused");
}

TEST(Datasheet, every_shipped_datasheet_is_read) {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(assets / "endoscopes")) {
        if (entry.path().extension() != ".toml") continue;
        EXPECT_EQ(read_endoscope(entry.path()).id, entry.path().stem()) << entry.path();
        ++count;
    }
    EXPECT_GE(count, 3);
    for (const char* name : {"needle", "forceps"})
        EXPECT_EQ(read_instrument(assets / "instruments" / (std::string(name) + ".toml")).id, name);
}

TEST(Datasheet, segments_in_the_wrong_order_or_of_the_wrong_length_are_refused) {
    EXPECT_EQ(datasheet_error(replaced(shipped(), "length = 0.94\n", "length = 0.84\n")),
              "scope.toml: working_length: is 1.03, but the segments' lengths add up to 0.93; correct one of "
              "them");
    EXPECT_NE(datasheet_error(replaced(shipped(), "bends = true", "bends = false")).find("segment[1].bends"),
              std::string::npos);
    EXPECT_NE(datasheet_error(replaced(shipped(), "name = \"shaft\"", "name = \"shaft\"\nbends = true"))
                  .find("segment[0].bends: is true; begin with the shaft"),
              std::string::npos);
}

TEST(Datasheet, a_figure_without_a_source_is_refused) {
    EXPECT_EQ(datasheet_error(replaced(shipped(), "flexural_rigidity = \"", "#flexural_rigidity = \"")),
              "scope.toml: segment[0].source.flexural_rigidity: is missing; say where the figure is from, or "
              "why it is a guess");
    EXPECT_EQ(datasheet_error(replaced(shipped(), "[torque.source]", "[torque.source]\ncolour = \"red\"")),
              "scope.toml: torque.source.colour: names no figure of this table; remove it");
}

TEST(Datasheet, an_instrument_is_read_as_strictly) {
    const std::string text = read_text(assets / "instruments" / "needle.toml");
    EXPECT_EQ(message_of([&] { parse_instrument(replaced(text, "mass_per_length = 0", "weight = 0"), "n"); }),
              "n: mass_per_length: is missing; add it (docs/scenes.md)");
    EXPECT_NE(message_of([&] { parse_instrument("colour = 1\n" + text, "n"); }).find("n: colour: "),
              std::string::npos);
    EXPECT_EQ(find_datasheet(assets / "instruments", "needle", "--instrument"),
              assets / "instruments" / "needle.toml");
    EXPECT_EQ(message_of([&] { find_datasheet(assets / "instruments", "spoon", "--instrument"); }),
              "--instrument: spoon: is neither a file nor one of forceps, needle");
}

} // namespace calot::simulation
