// The queries on the checked-in anatomy: a shaft along the way that procedures take through it.
#include "geometry/chain_contacts.hpp"
#include "geometry/distance.hpp"

#include <calot/meshio/read.hpp>

#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

using namespace calot::geometry;

namespace {

constexpr double radius = 6.3e-3, margin = 2e-3; // the shaft's, facts.tsv endoscope.GIF-2T160.OD
const std::filesystem::path folder = std::filesystem::path(CALOT_SOURCE_DIR) / "assets/anatomy/reference";

class AnatomyContacts : public testing::Test {
  protected:
    AnatomyContacts() : mesh(calot::meshio::read_mesh(folder / "upper-gi.glb")) {
        const std::vector<std::uint32_t> regions(mesh.region.begin(), mesh.region.end());
        const OrganSurface organ{"upper-gi",
                                 {mesh.vertices.data()->data(), 3 * mesh.vertices.size()},
                                 {mesh.triangles.data()->data(), 3 * mesh.triangles.size()},
                                 regions,
                                 {}};
        scene = TriangleScene({&organ, 1});
        const toml::table file = toml::parse_file((folder / "anatomy.toml").string());
        for (const auto& point : *file["landmark"]["path"]["points"].as_array())
            path.push_back(vector(point));
        ring = vector(*file["landmark"]["viscerotomy"]["position"].node());
        out = vector(*file["landmark"]["viscerotomy"]["normal"].node());
    }

    static Vec3 vector(const toml::node& node) {
        const toml::array& a = *node.as_array();
        return {*a[0].value<double>(), *a[1].value<double>(), *a[2].value<double>()};
    }

    std::span<const Contact> find(ChainContacts& query, const std::vector<Vec3>& nodes) {
        block.resize(3 * nodes.size());
        radii.assign(nodes.size() - 1, radius);
        for (std::size_t i = 0; i < nodes.size(); ++i)
            for (int k = 0; k < 3; ++k)
                block[k * nodes.size() + i] = nodes[i][k];
        return query.find(scene, Chain::of_block(block, radii), margin);
    }

    // Distance of a segment by trying all triangles.
    double brute_distance(Vec3 p0, Vec3 p1) const {
        double best = std::numeric_limits<double>::infinity();
        for (const auto& t : scene.triangles())
            best = std::min(best, closest_segment_triangle(p0, p1, scene.corner(t, 0), scene.corner(t, 1),
                                                           scene.corner(t, 2))
                                      .distance2);
        return std::sqrt(best);
    }

    calot::meshio::TriangleMesh mesh;
    TriangleScene scene;
    std::vector<Vec3> path;
    Vec3 ring, out;
    std::vector<double> block, radii;
};

TEST_F(AnatomyContacts, the_mesh_is_whole_for_the_queries) {
    EXPECT_EQ(scene.skipped_triangles(), 0u);
    EXPECT_EQ(scene.irregular_edges(), 0u);
    EXPECT_TRUE(std::ranges::all_of(
        scene.edges(), [](const auto& edge) { return edge.triangle[1] != TriangleScene::none; }));
    EXPECT_TRUE(scene.has_screens());
}

TEST_F(AnatomyContacts, the_path_runs_free_and_outside_of_the_wall) {
    ChainContacts query(path.size());
    EXPECT_TRUE(find(query, path).empty());
    for (std::size_t i = 0; i < path.size(); ++i) {
        EXPECT_EQ(organ_containing(scene, path[i]), TriangleScene::none) << "point " << i;
        EXPECT_GT(nearest_point(scene, path[i], 0.1).distance, radius) << "point " << i;
    }
}

TEST_F(AnatomyContacts, a_shaft_pushed_aside_is_held_where_the_nearest_wall_is) {
    ChainContacts query(path.size());
    int touching = 0;
    for (int direction = 0; direction < 4; ++direction) {
        const double angle = 0.4 + direction * 1.5707963267948966;
        const Vec3 aside = 4e-3 * Vec3{std::cos(angle), std::sin(angle), 0};
        std::vector<Vec3> nodes;
        for (const Vec3& p : path)
            nodes.push_back(p + aside);
        query.reset();
        const auto contacts = find(query, nodes);
        for (std::uint32_t i = 0; i + 1 < nodes.size(); ++i) {
            const double expected = brute_distance(nodes[i], nodes[i + 1]) - radius;
            // A part that two segments meet is given to the one that meets it deeper.
            double deepest = std::numeric_limits<double>::infinity();
            for (const Contact& c : contacts) {
                if (c.segment + 1 >= i && c.segment <= i + 1) deepest = std::min(deepest, c.gap);
                if (c.segment == i) {
                    EXPECT_GE(c.gap, expected - 1e-9) << "nearer than anything is";
                }
            }
            if (expected > margin - 1e-9) continue;
            ++touching;
            EXPECT_LE(deepest, expected + 0.005 * radius) << "direction " << direction << ", segment " << i;
        }
        for (const Contact& c : contacts) {
            // On the lumen's side of the wall, and pushing towards it.
            EXPECT_EQ(organ_containing(scene, c.point + 1e-5 * c.normal), TriangleScene::none);
            EXPECT_EQ(organ_containing(scene, c.point - 1e-5 * c.normal), 0u);
            EXPECT_NE(mesh.region_names[c.region], "serosa");
        }
    }
    EXPECT_GT(touching, 50);
}

TEST_F(AnatomyContacts, the_incision_lets_the_shaft_through_and_holds_it_on_every_side) {
    // Straight through the ring, then shifted until it meets the rim on each side in turn.
    const Vec3 side = [&] {
        const Vec3 s = cross(out, {0, 0, 1});
        return (1 / norm(s)) * s;
    }();
    const Vec3 up = cross(side, out);
    ChainContacts query(7);
    std::vector<Vec3> straight;
    for (int i = -3; i <= 3; ++i)
        straight.push_back(ring + (0.01 * i) * out);
    for (const Contact& c : find(query, straight))
        EXPECT_GT(c.gap, 0.0);
    for (int direction = 0; direction < 16; ++direction) {
        const double angle = direction * 0.39269908169872414;
        const Vec3 aside = std::cos(angle) * side + std::sin(angle) * up;
        std::vector<Vec3> nodes = straight;
        for (Vec3& node : nodes)
            node = node + 4e-3 * aside; // 18 mm across, 12.6 mm of shaft: 2.7 mm of play
        query.reset();
        const auto contacts = find(query, nodes);
        const auto deepest = std::ranges::min_element(contacts, {}, &Contact::gap);
        ASSERT_NE(deepest, contacts.end()) << "direction " << direction;
        EXPECT_LT(deepest->gap, 0.0) << "direction " << direction;
        EXPECT_LT(dot(deepest->normal, aside), -0.5) << "direction " << direction;
    }
}

TEST_F(AnatomyContacts, points_within_the_wall_are_told_from_those_in_the_lumen) {
    int within = 0;
    for (const Vec3& p : path) {
        const NearestPoint wall = nearest_point(scene, p, 0.03);
        if (!wall) continue;
        const Vec3 away = (1 / wall.distance) * (wall.point - p);
        EXPECT_EQ(organ_containing(scene, wall.point - 5e-4 * away), TriangleScene::none);
        EXPECT_EQ(organ_containing(scene, wall.point + 5e-4 * away), 0u);
        ++within;
    }
    EXPECT_GT(within, 40);
}

} // namespace
