// Models beside each other, at sizes that a test can wait for.
#include "bench/bench.hpp"
#include "bench/block_solve.hpp"
#include "bench/floors.hpp"
#include "bench/rod_problems.hpp"
#include "bench/test_plugins.hpp"

#include <gtest/gtest.h>

#include <cairo.h>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

namespace calot::bench {
namespace {

namespace fs = std::filesystem;

// Lines of CSV without the header, split at the commas.
std::vector<std::vector<std::string>> run_csv(std::vector<std::string> arguments, int& code) {
    std::ostringstream out, errors;
    arguments.push_back("--csv");
    code = run_rod(plugins(), arguments, out, errors);
    std::vector<std::vector<std::string>> rows;
    std::istringstream lines(out.str());
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line, "problem,model,nodes,dt,quantity,measured,reference,error,bound,met") << errors.str();
    while (std::getline(lines, line)) {
        std::vector<std::string> cells(1);
        for (const char c : line)
            c == ',' ? cells.emplace_back() : cells.back() += c, void();
        rows.push_back(cells);
    }
    return rows;
}

fs::path folder() {
    fs::path f = fs::path(CALOT_BINARY_DIR) / "tests" / "rod_compare.out";
    fs::create_directories(f);
    return f;
}

TEST(Floors, are_solved) {
    const double first = block_solve(); // throws if its residual is not small
    EXPECT_NE(block_solve(), first) << "every call solves another right side";
    // 4 x_1 - x_2 = 1 ...: far from the ends x = 1/2.
    EXPECT_NEAR(tridiagonal_run(99), 0.5 * (1 - (2 - std::sqrt(3.0))), 1e-12);
}

TEST(Compare, has_every_quantity_of_every_model) {
    int code = 0;
    const auto rows =
        run_csv({"--compare", "--models", "org.calot.rod-cosserat,org.calot.rod-corde", "--nodes", "20",
                 "--patience", "4", "--no-peers", "--out", (folder() / "compare").string()},
                code);
    EXPECT_EQ(code, 0);
    std::map<std::string, std::map<std::string, std::string>> of;
    for (const auto& r : rows) {
        ASSERT_EQ(r.size(), 10u);
        EXPECT_EQ(r[0], "compare");
        of[r[1]][r[4]] = r[5];
    }
    for (const char* model : {"org.calot.rod-cosserat", "org.calot.rod-corde"})
        for (const char* quantity :
             {"us_free", "solves_free", "us_contacts", "solves_contacts", "contacts", "stretch",
              "elastica_error", "heavy_error", "damping_ratio", "stable_at_10_ms"})
            EXPECT_FALSE(of[model][quantity].empty()) << model << ' ' << quantity;
    EXPECT_GT(std::stod(of["org.calot.rod-corde"]["us_free"]), 0);
    EXPECT_LT(std::stod(of["org.calot.rod-cosserat"]["elastica_error"]), 0.01);
    EXPECT_LT(std::stod(of["org.calot.rod-cosserat"]["stretch"]),
              std::stod(of["org.calot.rod-corde"]["stretch"]));
    EXPECT_GE(std::stod(of["org.calot.rod-cosserat"]["contacts"]), 15);
    EXPECT_GT(std::stod(of["floor"]["us_block_solve_99x6"]), std::stod(of["floor"]["us_tridiagonal_99"]));
    for (const char* file : {"compare.png", "compare.svg", "compare.csv"})
        EXPECT_TRUE(fs::exists(folder() / "compare" / file)) << file;
}

TEST(Compare, says_what_it_skips) {
    std::ostringstream out, errors;
    ASSERT_EQ(run_rod(plugins(),
                      {"--compare", "--models", "org.calot.rod-corde", "--nodes", "150", "--patience", "0.2",
                       "--no-peers"},
                      out, errors),
              0)
        << errors.str();
    EXPECT_NE(out.str().find("rod-corde, 150 nodes, elastica_error: skipped"), std::string::npos)
        << out.str();
}

TEST(Vessel, the_penalty_model_shortens_and_the_inextensible_does_not) {
    int code = 0;
    const fs::path picture = folder() / "vessel.png";
    fs::remove(picture);
    const auto rows = run_csv({"vessel", "--models", "org.calot.rod-cosserat,org.calot.rod-corde", "--nodes",
                               "100", "--seed", "3", "--load", "8", "--out", picture.string()},
                              code);
    EXPECT_EQ(code, 0);
    std::map<std::string, double> corde, cosserat;
    for (const auto& r : rows)
        (r[1] == "org.calot.rod-corde" ? corde : cosserat)[r[4]] = std::stod(r[5]);
    EXPECT_EQ(corde["blocked"], 1) << "its tip should have met the vessel's end";
    EXPECT_EQ(cosserat["blocked"], 1);
    EXPECT_NEAR(corde["push"], 8, 0.1);
    EXPECT_LT(cosserat["compression_percent"], 0.5);
    EXPECT_GT(corde["compression_percent"], 5 * cosserat["compression_percent"]);
    EXPECT_GT(corde["colliding_nodes"], 5);

    cairo_surface_t* image = cairo_image_surface_create_from_png(picture.c_str());
    ASSERT_EQ(cairo_surface_status(image), CAIRO_STATUS_SUCCESS);
    const std::ptrdiff_t w = cairo_image_surface_get_width(image), h = cairo_image_surface_get_height(image);
    int red = 0, green = 0;
    for (std::ptrdiff_t y = 0; y < h; ++y) {
        const auto* line = cairo_image_surface_get_data(image) + y * cairo_image_surface_get_stride(image);
        for (std::ptrdiff_t x = 0; x < w; ++x) {
            const int b = line[4 * x], g = line[4 * x + 1], r = line[4 * x + 2];
            red += r > 180 && g < 90 && b < 90 ? 1 : 0;
            green += g > 120 && r < 100 && b < 120 ? 1 : 0;
        }
    }
    cairo_surface_destroy(image);
    EXPECT_GT(red, 200) << "nodes that are free are drawn red";
    EXPECT_GT(green, 200) << "nodes that collide are drawn green";
}

TEST(Vessel, is_the_same_for_the_same_seed_and_another_for_another) {
    const auto percent = [](const char* seed) {
        int code = 0;
        const auto rows =
            run_csv({"vessel", "--model", "org.calot.rod-corde", "--nodes", "60", "--seed", seed}, code);
        EXPECT_EQ(code, 0);
        return rows.empty() ? std::string() : rows[0][5];
    };
    const std::string one = percent("1");
    EXPECT_EQ(one, percent("1"));
    EXPECT_NE(one, percent("2"));
}

TEST(Vessel, refuses_a_picture_of_unknown_kind_before_it_works) {
    std::ostringstream out, errors;
    EXPECT_EQ(run_rod(plugins(), {"vessel", "--out", "vessel.gif"}, out, errors), 2);
    EXPECT_NE(errors.str().find("--out"), std::string::npos) << errors.str();
}

} // namespace
} // namespace calot::bench
