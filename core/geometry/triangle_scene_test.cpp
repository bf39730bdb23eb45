#include "geometry/distance.hpp"
#include "geometry/test_shapes.hpp"
#include "geometry/triangle_scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <stdexcept>

using namespace calot::geometry;
using namespace calot::geometry::test;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

// Distance and first triangle (as given) by trying all.
std::pair<double, std::uint32_t> brute_nearest(const Shape& shape, Vec3 p) {
    double best = inf;
    std::uint32_t id = TriangleScene::none;
    for (std::uint32_t t = 0; t < shape.triangle_count(); ++t) {
        const Vec3 q =
            closest_on_triangle(p, shape.corner(t, 0), shape.corner(t, 1), shape.corner(t, 2)).point;
        if (norm2(p - q) < best) {
            best = norm2(p - q);
            id = t;
        }
    }
    return {std::sqrt(best), id};
}

void expect_nearest_as_brute_force(const TriangleScene& scene, const Shape& shape, std::uint64_t seed) {
    Random random(seed);
    for (int trial = 0; trial < 500; ++trial) {
        const Vec3 p = random.in_cube(1.5);
        const auto [distance, id] = brute_nearest(shape, p);
        const NearestPoint found = nearest_point(scene, p, inf);
        ASSERT_TRUE(found) << "trial " << trial;
        ASSERT_EQ(found.distance, distance) << "trial " << trial;
        ASSERT_EQ(scene.triangles()[found.position].id, id) << "trial " << trial;
        ASSERT_TRUE(nearest_point(scene, p, distance * (1 + 1e-12))) << "trial " << trial;
        ASSERT_FALSE(nearest_point(scene, p, distance * (1 - 1e-12))) << "trial " << trial;
    }
}

TEST(TriangleScene, finds_the_same_nearest_point_as_brute_force) {
    for (const std::uint32_t count : {1u, 3u, 9u, 100u, 2000u}) {
        const Shape shape = soup(count, count, 1.0, 0.3);
        expect_nearest_as_brute_force(shape.scene(), shape, count + 1);
    }
}

TEST(TriangleScene, ties_go_to_the_triangle_given_first) {
    const Shape cube = box({-1, -1, -1}, {1, 1, 1}, 8);
    const TriangleScene scene = cube.scene();
    const auto [distance, id] = brute_nearest(cube, {0, 0, 0});
    const NearestPoint found = nearest_point(scene, {0, 0, 0}, 5.0);
    EXPECT_EQ(found.distance, distance);
    EXPECT_EQ(scene.triangles()[found.position].id, id);
}

TEST(TriangleScene, finds_the_same_as_brute_force_after_its_vertices_moved) {
    const Shape before = soup(5, 800, 1.0, 0.3), after = soup(6, 800, 1.0, 0.4);
    TriangleScene scene = before.scene();
    ASSERT_TRUE(scene.move_vertices(after.vertices));
    EXPECT_FALSE(scene.has_screens());
    expect_nearest_as_brute_force(scene, after, 7);
}

TEST(TriangleScene, refuses_moves_that_are_not_finite_and_stays_as_it_was) {
    const Shape shape = sphere({0, 0, 0}, 1.0, 8, 8);
    TriangleScene scene = shape.scene();
    const std::uint64_t version = scene.version();
    std::vector<double> moved = shape.vertices;
    moved[10] = nan;
    EXPECT_FALSE(scene.move_vertices(moved));
    EXPECT_FALSE(scene.move_vertices(std::span(moved).first(9)));
    EXPECT_EQ(scene.version(), version);
    expect_nearest_as_brute_force(scene, shape, 8);
}

TEST(TriangleScene, boxes_that_overlap_are_the_ones_brute_force_finds) {
    const Shape shape = soup(9, 3000, 1.0, 0.1);
    const TriangleScene scene = shape.scene();
    Random random(10);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3 p = random.in_cube(1.0), q = p + random.in_cube(0.2);
        std::vector<bool> visited(shape.triangle_count());
        scene.tree().overlapping(box_of(p, q, 0.01), [&](std::uint32_t leaf) {
            for (std::uint32_t i = scene.tree().leaf_begin(leaf); i < scene.tree().leaf_begin(leaf + 1);
                 ++i) {
                ASSERT_FALSE(visited[scene.triangles()[i].id]) << "visited twice";
                visited[scene.triangles()[i].id] = true;
            }
        });
        for (std::uint32_t t = 0; t < shape.triangle_count(); ++t) {
            bool overlaps = true;
            for (int k = 0; k < 3; ++k) {
                const auto [lo, hi] =
                    std::minmax({shape.corner(t, 0)[k], shape.corner(t, 1)[k], shape.corner(t, 2)[k]});
                overlaps &= lo <= std::max(p[k], q[k]) + 0.01 && hi >= std::min(p[k], q[k]) - 0.01;
            }
            ASSERT_TRUE(visited[t] || !overlaps) << "trial " << trial << ", triangle " << t << " missed";
        }
    }
}

TEST(TriangleScene, an_infinite_query_box_ends) {
    const TriangleScene scene = sphere({0, 0, 0}, 1.0, 4, 5).scene();
    Box everything;
    for (int k = 0; k < 3; ++k)
        std::swap(everything.lo[k], everything.hi[k]);
    std::size_t seen = 0;
    scene.tree().overlapping(everything, [&](std::uint32_t leaf) {
        seen += scene.tree().leaf_begin(leaf + 1) - scene.tree().leaf_begin(leaf);
    });
    EXPECT_EQ(seen, scene.triangles().size());
}

TEST(TriangleScene, the_same_triangles_give_the_same_tree_bit_for_bit) {
    const Shape shape = soup(11, 5000, 1.0, 0.05);
    const TriangleScene a = shape.scene(), b = shape.scene();
    ASSERT_EQ(a.tree().nodes().size(), b.tree().nodes().size());
    EXPECT_EQ(std::memcmp(a.tree().nodes().data(), b.tree().nodes().data(), a.tree().nodes().size_bytes()),
              0);
    EXPECT_TRUE(std::ranges::equal(a.tree().order(), b.tree().order()));
}

TEST(TriangleScene, survives_triangles_all_in_one_place_and_ever_smaller_ones) {
    Shape same, shrinking;
    for (int i = 0; i < 300; ++i) {
        const std::uint32_t a = same.add({0, 0, 0}), b = same.add({1, 0, 0});
        same.triangle(a, b, same.add({0, 1, 0}));
    }
    double size = 1.0;
    for (int i = 0; i < 250; ++i, size *= 0.8) {
        const std::uint32_t a = shrinking.add({size, 0, 0}), b = shrinking.add({size, size / 9, 0});
        shrinking.triangle(a, b, shrinking.add({size, 0, size / 9}));
    }
    EXPECT_EQ(nearest_point(same.scene(), {0.2, 0.2, 1}, 2.0).distance, 1.0);
    expect_nearest_as_brute_force(shrinking.scene(), shrinking, 12);
}

TEST(TriangleScene, an_empty_scene_answers_nothing) {
    const TriangleScene scene{std::span<const OrganSurface>{}};
    EXPECT_TRUE(scene.empty());
    EXPECT_FALSE(nearest_point(scene, {0, 0, 0}, inf));
    EXPECT_EQ(organ_containing(scene, {0, 0, 0}), TriangleScene::none);
}

TEST(TriangleScene, refuses_broken_organs_by_name) {
    const auto message = [](const OrganSurface& organ) -> std::string {
        try {
            const OrganSurface organs[] = {organ};
            TriangleScene scene(organs);
            return "accepted";
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
    };
    const Shape good = sphere({0, 0, 0}, 1.0, 4, 4);
    EXPECT_EQ(message(good.surface()), "accepted");

    Shape bad = good;
    bad.vertices[7] = nan;
    EXPECT_EQ(message(bad.surface("liver")),
              "organ 'liver': vertex 2 is not finite or farther than 1 km from the origin");
    bad.vertices[7] = 1e300;
    EXPECT_NE(message(bad.surface("liver")).find("vertex 2"), std::string::npos);
    bad = good;
    bad.triangles[5] = 1000;
    EXPECT_EQ(message(bad.surface("liver")), "organ 'liver': triangle 1 uses vertex 1000 of 14");
    bad = good;
    bad.triangles.pop_back();
    EXPECT_NE(message(bad.surface()).find("no multiple of three"), std::string::npos);
    bad = good;
    bad.regions = {0, 1};
    EXPECT_NE(message(bad.surface()).find("2 region numbers"), std::string::npos);
    bad.regions.assign(bad.triangle_count(), 3);
    const double friction[] = {0.1, 0.2};
    EXPECT_NE(message(bad.surface("s", friction)).find("region 3"), std::string::npos);
    const double negative[] = {-0.1}, not_a_number[] = {nan};
    EXPECT_NE(message(good.surface("s", negative)).find("friction of region 0"), std::string::npos);
    EXPECT_NE(message(good.surface("s", not_a_number)).find("friction of region 0"), std::string::npos);
}

TEST(TriangleScene, leaves_out_triangles_without_area_and_keeps_their_neighbours_numbers) {
    Shape shape = box({0, 0, 0}, {1, 1, 1}, 1);
    shape.triangle(0, 0, 1);
    shape.triangle(0, 1, 2);
    const std::uint32_t last = static_cast<std::uint32_t>(shape.triangle_count()) - 1;
    const TriangleScene scene = shape.scene();
    EXPECT_EQ(scene.skipped_triangles(), 1u);
    EXPECT_EQ(scene.triangles().size(), shape.triangle_count() - 1);
    EXPECT_TRUE(std::ranges::any_of(scene.triangles(), [&](const auto& t) { return t.id == last; }));
}

TEST(TriangleScene, welds_vertices_and_joins_faces_over_seams) {
    const TriangleScene scene = box({0, 0, 0}, {1, 1, 1}, 3).scene(); // six faces with vertices of their own
    EXPECT_EQ(scene.vertices().size(), 56u);
    EXPECT_EQ(scene.edges().size(), 162u); // V - E + F = 2
    for (const auto& edge : scene.edges())
        EXPECT_NE(edge.triangle[1], TriangleScene::none);
}

TEST(TriangleScene, every_edge_and_vertex_belongs_to_exactly_one_triangle) {
    const TriangleScene scene = sphere({0, 0, 0}, 1.0, 9, 12).scene();
    std::size_t edges = 0, vertices = 0;
    for (const auto& t : scene.triangles()) {
        edges += __builtin_popcount(t.owns & 7);
        vertices += __builtin_popcount(t.owns >> 3);
    }
    EXPECT_EQ(edges, scene.edges().size());
    EXPECT_EQ(vertices, scene.vertices().size());
}

TEST(Winding, tells_inside_from_outside_of_a_tube_wall) {
    const Shape wall = tube_wall(0.010, 0.014, 0.1, 48, 20);
    const TriangleScene scene = wall.scene();
    Random random(13);
    int inside = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const Vec3 p{random.in(-0.016, 0.016), random.in(-0.016, 0.016), random.in(-0.01, 0.11)};
        const double r = std::hypot(p.x, p.y), sag = 1 - std::cos(std::numbers::pi / 48);
        if (std::min(std::fabs(r - 0.010), std::fabs(r - 0.014)) < 0.014 * sag) continue;
        const bool expected = r > 0.010 && r < 0.014 && p.z > 0 && p.z < 0.1;
        ASSERT_EQ(organ_containing(scene, p) == 0, expected) << p.x << ' ' << p.y << ' ' << p.z;
        inside += expected;
    }
    EXPECT_GT(inside, 300);
}

TEST(Winding, is_right_for_rays_through_edges_and_corners) {
    const TriangleScene scene = box({-1, -1, -1}, {1, 1, 1}, 4).scene();
    for (int i = -6; i <= 6; ++i) // every ray runs through grid lines or corners
        for (int j = -6; j <= 6; ++j)
            for (int k = -6; k <= 6; ++k) {
                const Vec3 p{i * 0.25, j * 0.25, k * 0.25};
                const double m = std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
                if (m == 1.0) continue; // on the surface: either
                int winding[1];
                ASSERT_TRUE(winding_numbers(scene, p, winding));
                ASSERT_EQ(winding[0], m < 1.0 ? 1 : 0) << p.x << ' ' << p.y << ' ' << p.z;
            }
}

TEST(Winding, counts_each_organ_by_itself) {
    const Shape outer = sphere({0, 0, 0}, 1.0, 16, 16), inner = sphere({0.2, 0, 0}, 0.5, 16, 16);
    const OrganSurface organs[] = {outer.surface("outer"), inner.surface("inner")};
    const TriangleScene scene(organs);
    int winding[2];
    ASSERT_TRUE(winding_numbers(scene, {0.3, 0, 0}, winding));
    EXPECT_EQ(winding[0], 1);
    EXPECT_EQ(winding[1], 1);
    ASSERT_TRUE(winding_numbers(scene, {-0.5, 0, 0}, winding));
    EXPECT_EQ(winding[0], 1);
    EXPECT_EQ(winding[1], 0);
    EXPECT_FALSE(winding_numbers(scene, {nan, 0, 0}, winding));
}

TEST(Winding, agrees_with_the_side_of_the_nearest_face_on_a_crumpled_sphere) {
    Random random(14);
    Shape shape = sphere({0, 0, 0}, 1.0, 24, 24).mapped([&](Vec3 v) { return v + random.in_cube(0.02); });
    const TriangleScene scene = shape.scene();
    int compared = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        const Vec3 p = random.in_cube(1.1);
        const NearestPoint near = nearest_point(scene, p, inf);
        const auto& t = scene.triangles()[near.position];
        const auto on = closest_on_triangle(p, scene.corner(t, 0), scene.corner(t, 1), scene.corner(t, 2));
        if (on.part != TrianglePart::face || near.distance < 1e-9) continue;
        const Vec3 n =
            cross(scene.corner(t, 1) - scene.corner(t, 0), scene.corner(t, 2) - scene.corner(t, 0));
        ASSERT_EQ(organ_containing(scene, p) == 0, dot(p - near.point, n) < 0) << "trial " << trial;
        ++compared;
    }
    EXPECT_GT(compared, 1000);
}

} // namespace
