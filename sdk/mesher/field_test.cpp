#include "description.hpp"
#include "noise.hpp"
#include "overlaps.hpp"
#include "patterns.hpp"
#include "sweep.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <unistd.h>

namespace {

using namespace calot::mesher;

TEST(Shapes, a_sphere_and_a_capsule_measure_distance) {
    const auto sphere = make_ellipsoid({1, 2, 3}, {5, 5, 5}, {10, 20, 30}, 2);
    const auto capsule = make_capsule({0, 0, 0}, {0, 0, 10}, 2, 2);
    EXPECT_NEAR(sphere->value({1, 2, 11}), 3, 1e-9);
    EXPECT_NEAR(sphere->value({1, 5, 3}), -2, 1e-9);
    EXPECT_NEAR(capsule->value({5, 0, 4}), 3, 1e-12);
    EXPECT_NEAR(capsule->value({0, 0, 14}), 2, 1e-12);
}

TEST(Shapes, a_smooth_union_adds_in_the_corner_and_nothing_far_from_it) {
    const auto a = make_half_space({0, 0, 0}, {1, 0, 0}), b = make_half_space({0, 0, 0}, {0, 1, 0});
    const auto both = make_union({a, b}, 4);
    EXPECT_NEAR(both->value({0, 0, 0}), -4.0 / 6, 1e-12);
    EXPECT_DOUBLE_EQ(both->value({1, 10, 0}), 1);
}

TEST(Shapes, a_shell_has_both_its_surfaces) {
    const auto shell = make_shell(make_ellipsoid({}, {20, 20, 20}, {}, 2), 3, 1);
    EXPECT_NEAR(shell->value({21, 0, 0}), 0, 1e-9);
    EXPECT_NEAR(shell->value({17, 0, 0}), 0, 1e-9);
    EXPECT_LT(shell->value({19, 0, 0}), -1.9);
}

TEST(Sweep, a_ring_of_constant_radius_measures_distance_like_a_torus) {
    std::vector<Knot> knots;
    for (int i = 0; i <= 24; ++i) {
        const double a = M_PI * i / 24;
        knots.push_back({.at = {50 * std::cos(a), 50 * std::sin(a), 0},
                         .plus_u = 8,
                         .minus_u = 8,
                         .plus_v = 8,
                         .minus_v = 8});
    }
    const Sweep ring(knots, false, {}, Cap::round, Cap::round);
    EXPECT_NEAR(ring.length(), 50 * M_PI, 0.05);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> angle(0.3, M_PI - 0.3), around(0, 2 * M_PI), radius(1, 20);
    for (int i = 0; i < 1000; ++i) {
        const double a = angle(random), b = around(random), r = radius(random), d = 50 + r * std::cos(b);
        const double got = ring.value({d * std::cos(a), d * std::sin(a), r * std::sin(b)});
        EXPECT_NEAR(got, r - 8, 0.02) << "error " << got - (r - 8);
    }
}

TEST(Sweep, up_turns_the_section_as_the_readme_says) {
    // Running caudally with up anterior: u is left, v is anterior.
    const Sweep s({{.at = {0, 100, 0}, .plus_u = 10, .minus_u = 6, .plus_v = 4, .minus_v = 3},
                   {.at = {0, 0, 0}, .plus_u = 10, .minus_u = 6, .plus_v = 4, .minus_v = 3}},
                  true, {0, 0, 1}, Cap::flat, Cap::flat);
    EXPECT_NEAR(s.value({10, 50, 0}), 0, 1e-9);
    EXPECT_NEAR(s.value({-6, 50, 0}), 0, 1e-9);
    EXPECT_NEAR(s.value({0, 50, 4}), 0, 1e-9);
    EXPECT_NEAR(s.value({0, 50, -3}), 0, 1e-9);
    EXPECT_NEAR(s.value({0, 100, 0}), 0, 1e-9) << "a flat cap ends at its knot";
    EXPECT_NEAR(s.value({0, 105, 0}), 5, 1e-9);
    EXPECT_NEAR(s.place({0, 50, 3.9}).phi, M_PI / 2, 1e-9);
    EXPECT_NEAR(s.place({1, 50, 0}).s, 50, 1e-6);
}

TEST(Sweep, its_field_has_no_jumps_where_bends_are_wider_than_radii) {
    const Sweep s({{.at = {0, 0, 0}, .plus_u = 6, .minus_u = 8, .plus_v = 5, .minus_v = 7},
                   {.at = {40, 10, 5}, .plus_u = 12, .minus_u = 9, .plus_v = 9, .minus_v = 9},
                   {.at = {80, 0, 20}, .plus_u = 5, .minus_u = 5, .plus_v = 5, .minus_v = 5}},
                  false, {}, Cap::round, Cap::round);
    double steepest = 0, last = s.value({-30, 3, 4});
    for (double x = -30 + 0.01; x < 120; x += 0.01) {
        const double now = s.value({x, 3, 4});
        steepest = std::max(steepest, std::abs(now - last) / 0.01);
        last = now;
    }
    EXPECT_LT(steepest, 2.5) << "change of the field per mm along a line";
}

TEST(Noise, is_bounded_continuous_and_the_same_everywhere) {
    double low = 0, high = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec p{0.37 * i, 0.11 * i, -0.23 * i};
        const double v = gradient_noise(p, 5);
        low = std::min(low, v), high = std::max(high, v);
        EXPECT_NEAR(gradient_noise(p + Vec{1e-7, 0, 0}, 5), v, 1e-5);
    }
    EXPECT_GT(low, -1.2);
    EXPECT_LT(low, -0.6);
    EXPECT_LT(high, 1.2);
    EXPECT_GT(high, 0.6);
    EXPECT_EQ(gradient_noise({3, -7, 11}, 1), 0) << "gradient noise is zero on its lattice";
    EXPECT_NE(gradient_noise({0.3, 0.4, 0.5}, 1), gradient_noise({0.3, 0.4, 0.5}, 2));
}

TEST(Patterns, haustra_leave_their_three_bands_flat) {
    const auto axis = std::make_shared<const Sweep>(
        std::vector<Knot>{{.at = {0, 0, 0}, .plus_u = 20, .minus_u = 20, .plus_v = 20, .minus_v = 20},
                          {.at = {300, 0, 0}, .plus_u = 20, .minus_u = 20, .plus_v = 20, .minus_v = 20}},
        true, Vec{0, 0, 1}, Cap::round, Cap::round);
    const pattern::Haustra h{axis, 30, 16, 5, 0, 1};
    for (int band = 0; band < 3; ++band) {
        double most = 0, between = 0;
        for (double x = 40; x < 260; x += 1) {
            const double on = band * 2 * M_PI / 3, off = on + M_PI / 3;
            // u is cranial (y) for a curve to the left with up anterior, v is anterior (z).
            most = std::max(most, relief(h, {x, 20 * std::cos(on), 20 * std::sin(on)}));
            between = std::max(between, relief(h, {x, 20 * std::cos(off), 20 * std::sin(off)}));
        }
        EXPECT_LT(most, 0.02) << "band " << band;
        EXPECT_GT(between, 0.8) << "between bands " << band << " and " << band + 1;
    }
}

TEST(Patterns, semilunar_folds_stand_between_the_bands_of_the_haustra_and_on_their_creases) {
    const auto axis = std::make_shared<const Sweep>(
        std::vector<Knot>{{.at = {0, 0, 0}, .plus_u = 20, .minus_u = 20, .plus_v = 20, .minus_v = 20},
                          {.at = {300, 0, 0}, .plus_u = 20, .minus_u = 20, .plus_v = 20, .minus_v = 20}},
        true, Vec{0, 0, 1}, Cap::round, Cap::round);
    const pattern::Haustra h{axis, 30, 16, 5, 0, 1};
    const pattern::Semilunar f{axis, 30, 2.5, 0, 1};
    for (int band = 0; band < 3; ++band) {
        double on_band = 0, highest = 0, at = 0;
        for (double x = 40; x < 260; x += 0.5) {
            const double on = band * 2 * M_PI / 3, off = on + M_PI / 3;
            on_band = std::max(on_band, relief(f, {x, 20 * std::cos(on), 20 * std::sin(on)}));
            const double here = relief(f, {x, 20 * std::cos(off), 20 * std::sin(off)});
            if (here > highest) highest = here, at = x;
        }
        EXPECT_LT(on_band, 0.01) << "band " << band;
        EXPECT_GE(highest, 0.7) << "between bands " << band << " and " << band + 1;
        EXPECT_LE(highest, 1);
        const double off = band * 2 * M_PI / 3 + M_PI / 3;
        EXPECT_LT(relief(h, {at, 20 * std::cos(off), 20 * std::sin(off)}), 0.05) << "a crease under the fold";
    }
}

// ---- Descriptions
// --------------------------------------------------------------------------------------------------

const std::string good = R"(format = 1
name = "ball"
title = "A ball"
triangles = 2000
edge = 2.0
deviation = 0.1
solid = "ball"
[[shape]]
id = "ball"
kind = "ellipsoid"
centre = [0, 0, 0]
radii = [10, 10, 10]
source = ["stomach.wall_thickness", "E: a test"]
[[region]]
name = "ball"
)";

std::string complaint(const std::string& text) {
    const auto file = std::filesystem::temp_directory_path() /
                      ("calot-description-" + std::to_string(std::random_device{}()) + ".toml");
    std::ofstream(file) << text;
    std::string line;
    try {
        read_organ(file, {"stomach.wall_thickness"});
    } catch (const DescriptionError& error) {
        line = error.what();
    }
    std::filesystem::remove(file);
    return line;
}

std::string with(const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

TEST(Description, a_good_one_is_read) {
    EXPECT_EQ(complaint(good), "");
}

TEST(Description, what_is_wrong_is_named_in_one_line_with_file_field_and_remedy) {
    const std::pair<std::string, std::string> cases[] = {
        {with("format = 1", "format = 9"), "format"},
        {with("name = \"ball\"", "name = \"../ball\""), "name"},
        {with("triangles = 2000", "triangles = 1e99"), "triangles"},
        {with("edge = 2.0", "edge = nan"), "edge"},
        {with("edge = 2.0", ""), "'edge' is missing"},
        {with("solid = \"ball\"", "solid = \"bell\""), "no shape 'bell'"},
        {with("kind = \"ellipsoid\"", "kind = \"cone\""), "use sweep"},
        {with("radii = [10, 10, 10]", "radii = [10, -10, 10]"), "shape 'ball'.radii"},
        {with("radii = [10, 10, 10]", "radii = [10, 10]"), "three numbers"},
        {with("radii = [10, 10, 10]", "radii = \"ten\""), "not a number"},
        {with("source = [\"stomach.wall_thickness\", \"E: a test\"]", ""), "'source' is missing"},
        {with("\"E: a test\"", "\"stomach.colour\""), "no quantity of facts.tsv"},
        {with("\"E: a test\"", "\"E: \""), "no quantity of facts.tsv"},
        {with("[[region]]", "colour = 3\n[[region]]"), "unknown key"},
        {with("[[region]]", "[[region]]\ninside = \"ball\""), "everything else"},
        {with("kind = \"ellipsoid\"", "kind = \"half-space\""), "missing"},
        {good + "[[shape", "not valid TOML"},
        {with("centre = [0, 0, 0]\n", "knots = [[0,0,0,1],[0,0,0,1]]\n"), "missing"},
    };
    for (const auto& [text, expected] : cases) {
        const std::string line = complaint(text);
        EXPECT_NE(line.find(expected), std::string::npos)
            << "expected '" << expected << "', got '" << line << "'";
        EXPECT_NE(line.find(".toml:"), std::string::npos) << line;
        EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    }
}

TEST(Description, a_shape_that_doubles_thirty_times_is_refused) {
    std::string text = good.substr(0, good.find("[[region]]"));
    std::string last = "ball";
    for (int i = 0; i < 30; ++i) {
        const std::string id = "u" + std::to_string(i);
        text += "[[shape]]\nid = \"" + id + "\"\nkind = \"union\"\nof = [\"" + last + "\", \"" + last +
                "\"]\nsource = \"E: a test\"\n";
        last = id;
    }
    EXPECT_NE(complaint(text + "[[region]]\nname = \"all\"\n").find("too many parts"), std::string::npos);
}

TEST(Description, broken_ones_never_crash) {
    std::mt19937 random(11);
    int refused = 0;
    for (int i = 0; i < 1500; ++i) {
        std::string text = good;
        for (int k = 0; k < 4; ++k) {
            const std::size_t at = random() % text.size();
            if (random() % 2)
                text[at] = static_cast<char>(32 + random() % 95);
            else
                text.erase(at, 1 + random() % 8);
        }
        refused += !complaint(text).empty();
    }
    EXPECT_GT(refused, 1000);
}

TEST(Description, an_organ_can_be_made_from_another_and_says_from_which) {
    const auto folder = std::filesystem::temp_directory_path() / ("calot-uses-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    const auto write =
        [&](const std::string& name, const std::string& shapes, const std::string& solid) {
            std::ofstream(folder / name)
                << "format = 1\nname = \"a\"\ntitle = \"A\"\ntriangles = 1000\nedge = 3\n"
                   "deviation = 0.2\nsolid = \"" +
                       solid + "\"\n" + shapes + "[[region]]\nname = \"all\"\n";
            return folder / name;
        };
    const std::string ball = "[[shape]]\nid = \"ball\"\nkind = \"ellipsoid\"\ncentre = [1, 2, 3]\nradii = 5\n"
                             "source = \"E: a test\"\n";
    const auto use = [](const std::string& file, const std::string& more = {}) {
        return "[[shape]]\nid = \"other\"\nkind = \"organ\"\nfile = \"" + file + "\"\n" + more +
               "source = \"E: a test\"\n";
    };
    write("one.toml", ball, "ball");
    write("two.toml", use("one.toml"), "other");
    const Organ three = read_organ(write("three.toml", use("two.toml"), "other"), {"x"});
    EXPECT_NEAR(three.solid->value({1, 2, 10}), 2, 1e-9);
    ASSERT_EQ(three.uses.size(), 2u) << "used directly, and through the one used";
    EXPECT_EQ(three.uses.at("one.toml"), read_organ(folder / "one.toml", {"x"}).sha256);

    for (const auto& [shapes, expected] : std::vector<std::pair<std::string, std::string>>{
             {use("circle.toml"), "circle"},
             {use("../one.toml"), "without a path"},
             {use("none.toml"), "no such file"},
             {use("one.toml", "shape = \"cube\"\n"), "no shape 'cube'"}}) {
        const auto file = write("circle.toml", shapes, "other");
        try {
            read_organ(file, {"x"});
            ADD_FAILURE() << "taken: " << shapes;
        } catch (const DescriptionError& error) {
            EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
        }
    }
    std::filesystem::remove_all(folder);
}

TEST(Overlaps, two_balls_share_a_lens_and_a_third_touches_none) {
    std::vector<Organ> organs(3);
    const double centres[] = {0, 17, 40};
    for (std::size_t i = 0; i < 3; ++i) {
        organs[i].name = std::to_string(i);
        organs[i].solid = make_ellipsoid({centres[i], 0, 0}, {10, 10, 10}, {}, 2);
    }
    const auto found = find_overlaps(organs, 0.5);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].depth, 3, 0.6);
    // Two caps of height 1.5 mm: pi h^2 (3 r - h) / 3 each.
    EXPECT_NEAR(found[0].volume, 2 * 3.14159 * 1.5 * 1.5 * (30 - 1.5) / 3 / 1000, 0.01);
}

} // namespace
