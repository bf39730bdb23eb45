// What procedures and contact rely on in the checked-in anatomy: whole meshes, and a way through them.
#include "test_geometry.hpp"

#include <calot/meshio/check.hpp>
#include <calot/meshio/read.hpp>
#include <calot/meshio/sha256.hpp>
#include <calot/meshio/write.hpp>

#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

namespace {

using namespace calot::meshio;

const std::filesystem::path folder = std::filesystem::path(CALOT_SOURCE_DIR) / "assets/anatomy/reference";
class Anatomy : public testing::Test {
  protected:
    toml::table list = toml::parse_file((folder / "anatomy.toml").string());
    std::vector<Vec3> path() {
        std::vector<Vec3> points;
        toml::array& a = *list["landmark"]["path"]["points"].as_array();
        for (std::size_t i = 0; i < a.size(); ++i)
            points.push_back(vec(toml::node_view<toml::node>(a.get(i))));
        return points;
    }
};

TEST_F(Anatomy, every_mesh_is_the_closed_outward_boundary_of_a_solid) {
    ASSERT_TRUE(list["organ"].is_array_of_tables());
    std::size_t triangles = 0;
    for (auto& node : *list["organ"].as_array()) {
        toml::table& organ = *node.as_table();
        const auto file = folder / organ["mesh"].value<std::string>().value();
        const MeshReport r = check(read_mesh(file));
        EXPECT_EQ(r.problem(), "") << file;
        triangles += r.triangles;
        const double friction = organ["friction"].value<double>().value();
        EXPECT_TRUE(friction >= 0 && friction < 1) << file << ": friction " << friction;
    }
    EXPECT_LE(triangles, 160'000u) << "of 200,000 for static anatomy; the rest is for what procedures add";
}

TEST_F(Anatomy, every_mesh_was_made_from_the_description_beside_it) {
    for (auto& node : *list["organ"].as_array()) {
        const auto file = folder / (*node.as_table())["mesh"].value<std::string>().value();
        auto description = file;
        description.replace_extension(".toml");
        std::string made_from;
        const std::string other = "uses_sha256:"; // a description whose shapes this one was carved by
        for (const auto& [key, value] : read_glb_extras(file)) {
            if (key == "description_sha256") made_from = value;
            if (key.rfind(other, 0) == 0) {
                EXPECT_EQ(value, sha256_file(folder / key.substr(other.size())))
                    << file << ": " << key << ": mesh it again with calot-mesher";
            }
        }
        EXPECT_EQ(made_from, sha256_file(description)) << file << ": mesh it again with calot-mesher";
    }
}

TEST_F(Anatomy, the_endoscope_fits_along_the_path_and_through_the_ring) {
    const TriangleMesh wall = read_mesh(folder / "upper-gi.glb");
    const auto points = path();
    ASSERT_GE(points.size(), 10u);
    double least = std::numeric_limits<double>::infinity();
    Vec3 where{};
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        EXPECT_LE(norm(points[i + 1] - points[i]), 0.010) << "points " << i << " and " << i + 1;
        for (int k = 0; k < 4; ++k) {
            const Vec3 p = points[i] + (0.25 * k) * (points[i + 1] - points[i]);
            if (const double c = clearance(wall, p); c < least) least = c, where = p;
        }
    }
    EXPECT_GE(least, endoscope_radius)
        << "clearance of the path in m, at " << where[0] << ", " << where[1] << ", " << where[2];
    for (std::size_t i = 0; i < points.size(); i += 4)
        EXPECT_FALSE(inside(wall, points[i])) << "point " << i << " lies in the wall";
}

TEST_F(Anatomy, the_path_bends_no_tighter_than_the_endoscope_can) {
    const auto p = path();
    for (std::size_t i = 2; i + 2 < p.size(); ++i) { // the circle through three points, 16 mm apart
        const Vec3 a = p[i] - p[i - 2], b = p[i + 2] - p[i];
        const double area = norm(cross(a, b));
        if (area < 1e-9) continue;
        const double radius = norm(a) * norm(b) * norm(p[i + 2] - p[i - 2]) / (2 * area);
        EXPECT_GE(radius, 0.025) << "bend radius in m at point " << i
                                 << "; facts.tsv endoscope.min_bend_radius";
    }
}

TEST_F(Anatomy, the_ring_is_where_the_landmark_says_and_as_wide) {
    const TriangleMesh wall = read_mesh(folder / "upper-gi.glb");
    const Vec3 ring = vec(list["landmark"]["viscerotomy"]["position"]);
    const Vec3 normal = vec(list["landmark"]["viscerotomy"]["normal"]);
    const double radius = 0.5 * list["landmark"]["viscerotomy"]["ring_diameter"].value<double>().value();
    EXPECT_NEAR(norm(normal), 1, 1e-3);
    EXPECT_NEAR(clearance(wall, ring), radius, 0.0007) << "distance from the ring's centre to its rim";
    // Outside the stomach along the normal, inside against it: the wall is all round the ring, 3 mm beyond
    // its rim.
    const Vec3 side = cross(normal, Vec3{0, 0, 1}), across = (1 / norm(side)) * side,
               along = cross(across, normal);
    for (int k = 0; k < 8; ++k) {
        const double angle = k * M_PI / 4, r = radius + 0.004;
        const Vec3 out = ring + (r * std::cos(angle)) * across + (r * std::sin(angle)) * along;
        bool met = false;
        for (int step = -8; step <= 8; ++step)
            met = met || inside(wall, out + (0.001 * step) * normal);
        EXPECT_TRUE(met) << "no wall " << k * 45 << " degrees round the ring";
    }
}

TEST_F(Anatomy, the_guide_stands_at_the_upper_end_and_points_into_the_oesophagus) {
    const Vec3 guide = vec(list["landmark"]["guide"]["position"]),
               direction = vec(list["landmark"]["guide"]["direction"]);
    const auto points = path();
    EXPECT_NEAR(norm(direction), 1, 1e-3);
    EXPECT_LT(norm(points[0] - guide), 1e-3);
    const Vec3 first = points[1] - points[0];
    EXPECT_GT(dot(direction, first) / norm(first), 0.99) << "guide and path should run the same way";
}

TEST_F(Anatomy, each_place_for_a_clip_lies_in_its_duct_or_artery) {
    for (const std::string organ : {"cystic-duct", "cystic-artery"}) {
        const TriangleMesh mesh = read_mesh(folder / (organ + ".glb"));
        for (const std::string number : {"1", "2", "3"}) {
            const std::string id = organ + "-clip-" + number;
            const Vec3 at = vec(list["landmark"][id]["position"]);
            EXPECT_TRUE(inside(mesh, at)) << id;
            EXPECT_NEAR(norm(vec(list["landmark"][id]["direction"])), 1, 1e-3) << id;
        }
    }
}

TEST_F(Anatomy, the_gallbladder_lies_in_its_bed) {
    const Vec3 bed = vec(list["landmark"]["gallbladder-bed"]["position"]);
    for (const char* organ : {"liver.glb", "gallbladder.glb"})
        EXPECT_LE(clearance(read_mesh(folder / organ), bed), 0.002) << organ << ": m from the bed's centre";
}

TEST_F(Anatomy, the_way_from_the_incision_into_the_free_space_is_clear) {
    const double radius = 0.5 * list["landmark"]["viscerotomy"]["ring_diameter"].value<double>().value();
    std::vector<Vec3> corridor;
    for (auto& p : *list["landmark"]["corridor"]["points"].as_array())
        corridor.push_back(vec(toml::node_view<toml::node>(p)));
    ASSERT_GE(corridor.size(), 3u);
    EXPECT_GE(norm(corridor.back() - corridor.front()), 0.085) << "an endoscope needs that much room to turn";
    for (auto& node : *list["organ"].as_array()) {
        const std::string mesh = (*node.as_table())["mesh"].value<std::string>().value();
        if (mesh == "upper-gi.glb") continue; // the corridor starts in its wall
        const TriangleMesh organ = read_mesh(folder / mesh);
        for (std::size_t i = 0; i + 1 < corridor.size(); ++i)
            for (int k = 0; k < 4; ++k) {
                const Vec3 p = corridor[i] + (0.25 * k) * (corridor[i + 1] - corridor[i]);
                EXPECT_GE(clearance(organ, p), radius) << mesh << " near corridor point " << i;
            }
        for (const Vec3& p : corridor)
            EXPECT_FALSE(inside(organ, p)) << mesh;
    }
}

} // namespace
