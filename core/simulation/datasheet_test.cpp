#include "host/error.hpp"
#include "simulation/endoscope.hpp"
#include "simulation/endoscope_datasheet.hpp"
#include "simulation/scene.hpp"
#include "simulation/toml_reader.hpp"
#include "simulation/world.hpp"

#include <calot/math.hpp>

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
    EXPECT_DOUBLE_EQ(sheet.insertion_tube.length + sheet.bending_section.length, 1.03);
    EXPECT_DOUBLE_EQ(sheet.insertion_tube.outer_radius, 0.0063);
    EXPECT_NEAR(sheet.angulation.up, 210 * std::numbers::pi / 180, 1e-12);
    EXPECT_NEAR(sheet.camera.field_of_view, 140 * std::numbers::pi / 180, 1e-12);
    ASSERT_EQ(sheet.channels.size(), 2u);
    EXPECT_DOUBLE_EQ(sheet.channels[1].diameter, 0.0037);
}

TEST(Datasheet, a_negative_stiffness_is_refused_with_file_field_and_bounds) {
    const std::string line =
        datasheet_error(replaced(shipped(), "flexural_rigidity = 0.033", "flexural_rigidity = -0.033"));
    EXPECT_EQ(line,
              "scope.toml: insertion_tube.flexural_rigidity: is -0.033; it must lie between 1e-05 and 1");
}

TEST(Datasheet, an_unknown_key_is_refused_by_name) {
    EXPECT_EQ(
        datasheet_error(replaced(shipped(), "wheel_ratio = 1.0", "wheel_ratio = 1.0\nwheel_radius = 2")),
        "scope.toml: angulation.wheel_radius: is unknown; remove it or correct its name");
    EXPECT_EQ(datasheet_error("colour = 1\n" + shipped()),
              "scope.toml: colour: is unknown; remove it or correct its name");
}

TEST(Datasheet, what_is_missing_not_finite_of_wrong_type_or_no_toml_is_refused) {
    EXPECT_NE(
        datasheet_error(replaced(shipped(), "drag = ", "#drag = ")).find("insertion_tube.drag: is missing"),
        std::string::npos);
    EXPECT_NE(datasheet_error(replaced(shipped(), "up_degrees = 210", "up_degrees = nan"))
                  .find("angulation.up_degrees"),
              std::string::npos);
    EXPECT_NE(
        datasheet_error(replaced(shipped(), "format = 1", "format = \"1\"")).find("must be a whole number"),
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

TEST(Endoscope, wheels_bend_the_tip_by_their_angle_up_and_left) {
    Endoscope scope(parse_endoscope(shipped(), "scope.toml"), 100);
    EXPECT_NEAR(scope.length(), 1.03, 1e-12);
    const double wheel[2] = {1.2, -0.5};
    scope.set_bending(wheel);
    // Frames that follow the rest curvature: joint by joint, half of each neighbour.
    const auto rest = scope.rest_darboux();
    const auto lengths = scope.lengths();
    Quat q;
    for (std::size_t i = 1; i < lengths.size(); ++i) {
        Vec3 turn = 0.5 * (lengths[i - 1] * vec3(&rest[3 * (i - 1)]) + lengths[i] * vec3(&rest[3 * i]));
        const double angle = norm(turn);
        q = q * axis_angle(normalized(turn), angle);
    }
    const Vec3 tip = rotate(q, {0, 0, 1});
    const double total = std::acos(tip.z);
    EXPECT_NEAR(total, std::hypot(1.2, 0.5), 0.01);
    EXPECT_GT(tip.y, 0) << "the up wheel bends towards +y";
    EXPECT_LT(tip.x, 0) << "a wheel to the right bends away from +x, which is left";
}

TEST(Endoscope, angulation_lags_by_its_backlash_its_speed_and_its_limits) {
    Endoscope scope(parse_endoscope(shipped(), "scope.toml"), 100);
    const std::uint32_t free[2] = {0, 0}, held[2] = {1, 1};
    const double slack = 0.5 * 8 * std::numbers::pi / 180;
    const auto settle = [&](double up, double left, const std::uint32_t brake[2]) {
        const double wheel[2] = {up, left};
        for (int tick = 0; tick < 3000; ++tick)
            scope.steer(wheel, brake, 1e-3);
    };
    settle(1.0, 0, free);
    EXPECT_NEAR(scope.bending()[0], 1.0 - slack, 1e-9);
    settle(1.0 - slack, 0, free);
    EXPECT_NEAR(scope.bending()[0], 1.0 - slack, 1e-9) << "within the backlash nothing moves";
    settle(0.0, 0, held);
    EXPECT_NEAR(scope.bending()[0], 1.0 - slack, 1e-9) << "a braked wheel stays";
    settle(0.0, 0, free);
    EXPECT_NEAR(scope.bending()[0], slack, 1e-9);
    settle(100, 0, free);
    EXPECT_NEAR(scope.bending()[0], 210 * std::numbers::pi / 180 - slack, 1e-9) << "up stops at 210 degrees";
    const double back[2] = {0, 0};
    const double before = scope.bending()[0];
    scope.steer(back, free, 1e-3);
    EXPECT_NEAR(before - scope.bending()[0], 200 * std::numbers::pi / 180 * 1e-3, 1e-12);
}

TEST(Endoscope, laid_along_a_path_keeps_every_length_and_ends_at_the_insertion) {
    const Endoscope scope(parse_endoscope(shipped(), "scope.toml"), 100);
    calot_guide guide{};
    guide.present = 1;
    guide.direction[2] = -1;
    const geometry::Vec3 path[] = {{0, 0, 0}, {0, 0, -0.1}, {0.02, 0, -0.2}, {0.02, -0.05, -0.3}};
    const auto nodes = scope.laid_along(guide, path, 0.25);
    const auto frames = scope.frames_along(nodes, 0.3);
    for (std::size_t i = 0; i + 1 < scope.nodes(); ++i) {
        const Vec3 piece = vec3(&nodes[3 * i + 3]) - vec3(&nodes[3 * i]);
        EXPECT_NEAR(norm(piece), scope.lengths()[i], 1e-12);
        EXPECT_NEAR(norm(rotate(quat(&frames[4 * i]), {0, 0, 1}) - normalized(piece)), 0, 1e-9);
    }
    EXPECT_DOUBLE_EQ(nodes[0], 0.0) << "the base lies in the guide";
    EXPECT_GT(nodes[2], 0.7);
    const Vec3 up = rotate(quat(frames.data()), {0, 1, 0});
    EXPECT_NEAR(up.y, -std::cos(0.3), 1e-9) << "turned from anterior by the rotation";
    EXPECT_THROW(scope.laid_along(guide, path, 0.5), std::invalid_argument);
}

} // namespace calot::simulation
