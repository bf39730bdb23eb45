// The command that times geometry runs and says what it timed; its scenes are what they claim to be.
#include "bench/bench.hpp"
#include "bench/geometry_scenes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

namespace calot::bench {
namespace {

int run(const std::vector<std::string>& words, std::string& out, std::string& errors) {
    std::ostringstream o, e;
    const int code = run_geometry(words, o, e);
    out = o.str(), errors = e.str();
    return code;
}

TEST(BenchGeometry, prints_a_row_for_each_setting_of_a_task) {
    std::string out, errors;
    const int code = run({"capsules", "--rounds", "1", "--csv"}, out, errors);
    EXPECT_LE(code, 1) << "a machine may be slow, but not wrong: " << errors;
    EXPECT_EQ(out.rfind("problem,model,nodes,dt,quantity,measured,reference,error,bound,met\n", 0), 0u)
        << out;
    std::size_t rows = 0;
    for (std::size_t at = 0; (at = out.find("\ncapsules,calot,100,", at)) != std::string::npos; ++at)
        ++rows;
    EXPECT_EQ(rows, 6u) << out;
}

TEST(BenchGeometry, refuses_what_it_does_not_time) {
    std::string out, errors;
    EXPECT_EQ(run({"cubes"}, out, errors), 2);
    EXPECT_NE(errors.find("\"cubes\""), std::string::npos) << errors;
    EXPECT_EQ(run({"--rounds", "0"}, out, errors), 2);
    EXPECT_EQ(run({"--setting", "at ease"}, out, errors), 2);
    EXPECT_NE(errors.find("\"at ease\""), std::string::npos) << errors;
}

TEST(BenchGeometry, its_shafts_lie_in_the_lumen_and_touch_the_wall) {
    for (const auto kind : {FoldedTube::Kind::stomach, FoldedTube::Kind::colon}) {
        const FoldedTube tube(kind);
        const bool is_colon = kind == FoldedTube::Kind::colon;
        const geometry::TriangleScene scene = (is_colon ? tube.wall(260, 36) : tube.wall(70, 71)).scene();
        EXPECT_EQ(scene.skipped_triangles(), 0u);
        EXPECT_EQ(scene.irregular_edges(), 0u);
        constexpr std::size_t n = 100;
        constexpr double radius = 6.3e-3;
        const auto block = tube.shaft_on_wall(n, radius, 0.01);
        std::size_t in_wall = 0, near = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const geometry::Vec3 p{block[i], block[n + i], block[2 * n + i]};
            in_wall += organ_containing(scene, p) != geometry::TriangleScene::none;
            const geometry::NearestPoint q = nearest_point(scene, p, 0.02);
            ASSERT_TRUE(q) << "node " << i;
            EXPECT_GT(q.distance, 0.7 * radius) << "node " << i; // pressed against the stomach's folds
            near += q.distance < radius + 2e-3;
        }
        EXPECT_EQ(in_wall, 0u);
        EXPECT_GT(near, n / 2) << "nodes within 2 mm of touching, " << (is_colon ? "colon" : "stomach");
    }
}

} // namespace
} // namespace calot::bench
