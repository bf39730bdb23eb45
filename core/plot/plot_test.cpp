#include "host/error.hpp"
#include "plot/beads.hpp"
#include "plot/chart.hpp"
#include "plot/ticks.hpp"
#include "plot/whole_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <unistd.h>

namespace calot::plot {

namespace {

class Plot : public testing::Test {
  protected:
    Plot() { std::filesystem::create_directories(folder); }
    ~Plot() override { std::filesystem::remove_all(folder); }
    static std::string content(const std::filesystem::path& file) {
        std::ifstream from(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(from), {}};
    }
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("calot-plot-" + std::to_string(::getpid()));
};

std::vector<Panel> some_panels() {
    Panel curve{.title = "Force", .x_label = "deflection (m)", .y_label = "force (N)"};
    curve.series.push_back({.label = "data", .mark = Mark::points, .x = {0, 1, 2, NAN}, .y = {0, 2, 3, 4}});
    Panel log{.title = "Error", .x_label = "nodes", .y_label = "error", .is_log_x = true, .is_log_y = true};
    log.series.push_back({.label = "second order", .x = {10, 100, 1000}, .y = {1e-2, 1e-4, 0}});
    return {curve, log, Panel{.title = "empty"}, Panel{.title = "shape", .is_to_scale = true}};
}

} // namespace

TEST(Axis, has_a_few_round_ticks_inside_it) {
    const double ends[][2] = {{0, 1}, {-3, 1e4}, {2, 2}, {0, 0}, {1e-9, 2e-9}, {-1e300, 1e300}};
    for (const auto& [low, high] : ends) {
        const Axis axis = make_axis(low, high, false, 6);
        EXPECT_LE(axis.low, low);
        EXPECT_GE(axis.high, high);
        EXPECT_GE(axis.ticks.size(), 2u) << low << " to " << high;
        EXPECT_LE(axis.ticks.size(), 12u) << low << " to " << high;
        for (const double tick : axis.ticks)
            EXPECT_TRUE(tick >= axis.low - 1e-9 * (axis.high - axis.low) && tick <= axis.high) << tick;
    }
    const Axis log = make_axis(-5.2, -1.1, true, 6);
    EXPECT_EQ(log.labels.front(), "1e-05");
    const Axis decade = make_axis(-2.7, -1.5, true, 6);
    EXPECT_EQ(decade.labels, (std::vector<std::string>{"0.002", "0.005", "0.01", "0.02"}));
}

TEST_F(Plot, is_written_as_svg_with_its_labels_and_as_png) {
    draw(some_panels(), folder / "a.svg");
    const std::string svg = content(folder / "a.svg");
    EXPECT_TRUE(svg.starts_with("<?xml")) << svg.substr(0, 40);
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
    draw(some_panels(), folder / "a.png");
    EXPECT_TRUE(content(folder / "a.png").starts_with("\x89PNG"));
    EXPECT_THROW(draw(some_panels(), folder / "a.jpg"), host::UserError);
    EXPECT_THROW(draw(some_panels(), folder / "none" / "a.png"), host::UserError);
}

TEST_F(Plot, beads_that_touch_are_drawn_in_another_colour) {
    Vessel vessel{.radius = 3e-3};
    for (int i = 0; i <= 100; ++i)
        vessel.axis.push_back({1e-3 * i, 5e-3 * std::sin(0.05 * i), 0});
    BeadString string{.title = "a rod", .radius = 1e-3};
    for (int i = 0; i < 50; ++i)
        string.beads.push_back({{2e-3 * i, 0, 0}, i % 2 == 0});
    const auto discs = [&](bool some_touch) {
        for (Bead& b : string.beads)
            b.is_touching = b.is_touching && some_touch;
        draw(vessel, {string}, folder / "beads.svg");
        const std::string svg = content(folder / "beads.svg");
        // The green and the red that are in the middle of a disc.
        const auto count = [&](const char* colour) {
            std::size_t n = 0;
            for (std::size_t at = svg.find(colour); at != std::string::npos; at = svg.find(colour, at + 1))
                ++n;
            return n;
        };
        return std::pair{count("20%, 72%, 22%") + count("rgb(20%,72%,22%)"),
                         count("86%, 18%, 14%") + count("rgb(86%,18%,14%)")};
    };
    const auto [green, red] = discs(true);
    EXPECT_EQ(green, 26u) << "25 beads and the legend";
    EXPECT_EQ(red, 26u);
    EXPECT_EQ(discs(false).first, 1u) << "the legend only";
}

TEST_F(Plot, a_file_that_cannot_be_replaced_stays_as_it_was) {
    write_whole(folder / "a.txt", "before");
    std::filesystem::create_directory(folder / "b");
    EXPECT_THROW(write_whole(folder / "b", "after"), host::UserError) << "a folder is in its place";
    write_whole(folder / "a.txt", "after");
    EXPECT_EQ(content(folder / "a.txt"), "after");
    int files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder))
        ++files;
    EXPECT_EQ(files, 2) << "no part is left lying";
}

} // namespace calot::plot
