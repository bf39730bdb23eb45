#include "organ_mesh.hpp"
#include "surface.hpp"

#include <calot/meshio/write.hpp>

#include <gtest/gtest.h>

#include <cmath>

namespace {

using namespace calot;
using namespace calot::mesher;

Organ organ(ShapePtr solid, double edge, std::size_t budget) {
    Organ o;
    o.name = "test";
    o.title = "Test";
    o.triangles = budget;
    o.edge = edge;
    o.solid = std::move(solid);
    o.regions.push_back({"all", nullptr, edge, 0.1 * edge});
    return o;
}

TEST(OrganMesh, a_ball_is_closed_manifold_outward_and_of_the_right_size_and_place) {
    const auto made = mesh_organ(organ(make_ellipsoid({30, 20, 10}, {15, 15, 15}, {}, 2), 2, 8000));
    EXPECT_EQ(made.problem, "");
    const double expected = 4.0 / 3 * M_PI * std::pow(0.015, 3);
    EXPECT_NEAR(made.report.volume, expected, 0.02 * expected);
    // x left, y cranial, z anterior becomes x left, y posterior, z superior.
    EXPECT_NEAR(0.5 * (made.report.minimum[0] + made.report.maximum[0]), 0.030, 2e-4);
    EXPECT_NEAR(0.5 * (made.report.minimum[1] + made.report.maximum[1]), -0.010, 2e-4);
    EXPECT_NEAR(0.5 * (made.report.minimum[2] + made.report.maximum[2]), 0.020, 2e-4);
    for (std::size_t i = 0; i < made.mesh.vertices.size(); ++i) {
        const auto& p = made.mesh.vertices[i];
        const auto& n = made.mesh.normals[i];
        const double outward =
            ((p[0] - 0.030) * n[0] + (p[1] + 0.010) * n[1] + (p[2] - 0.020) * n[2]) / 0.015;
        ASSERT_GT(outward, 0.99) << "vertex " << i;
    }
}

TEST(OrganMesh, a_closed_wall_has_an_outer_and_an_inner_surface) {
    const auto made =
        mesh_organ(organ(make_shell(make_ellipsoid({}, {20, 15, 15}, {}, 2), 3, 0), 2.5, 20000));
    EXPECT_EQ(made.problem, "");
    EXPECT_EQ(made.report.components, 2u);
    const double expected = 4.0 / 3 * M_PI * (20 * 15 * 15 - 17 * 12 * 12) * 1e-9;
    EXPECT_NEAR(made.report.volume, expected, 0.04 * expected);
}

TEST(OrganMesh, two_parts_far_apart_are_both_found) {
    const auto a = make_ellipsoid({}, {5, 5, 5}, {}, 2), b = make_ellipsoid({60, 0, 0}, {4, 4, 4}, {}, 2);
    const auto made = mesh_organ(organ(make_union({a, b}, 0), 2, 4000));
    EXPECT_EQ(made.problem, "");
    EXPECT_EQ(made.report.components, 2u);
}

TEST(OrganMesh, a_region_ends_along_edges_in_a_smooth_line) {
    Organ o = organ(make_ellipsoid({}, {15, 15, 15}, {}, 2), 2, 8000);
    o.regions.insert(o.regions.begin(), {"cap", make_half_space({0, 0, 6}, {0, 0, -1}), 2, 0.2});
    const auto made = mesh_organ(o);
    EXPECT_EQ(made.problem, "");
    // z = 6 mm is y = -0.006 m; the shared vertices of the two regions lie there.
    std::vector<int> regions(made.mesh.vertices.size(), 0);
    for (std::size_t t = 0; t < made.mesh.triangles.size(); ++t)
        for (const auto v : made.mesh.triangles[t])
            regions[v] |= 1 << made.mesh.region[t];
    int shared = 0;
    for (std::size_t v = 0; v < regions.size(); ++v)
        if (regions[v] == 3) {
            ++shared;
            EXPECT_NEAR(made.mesh.vertices[v][1], -0.006, 0.0002);
        }
    EXPECT_GT(shared, 20);
}

TEST(OrganMesh, the_same_organ_gives_the_same_bytes) {
    const Organ o = organ(
        make_union({make_ellipsoid({}, {12, 9, 9}, {}, 2), make_capsule({}, {25, 5, 0}, 4, 3)}, 4), 2, 8000);
    const std::string first = meshio::to_glb(mesh_organ(o).mesh);
    const std::vector<char> shift(1'000'003); // moves what is allocated next
    EXPECT_TRUE(meshio::to_glb(mesh_organ(o).mesh) == first)
        << "with " << shift.size() << " bytes in between";
}

TEST(OrganMesh, a_budget_that_is_too_small_is_named) {
    const Organ o = organ(make_ellipsoid({}, {15, 15, 15}, {}, 2), 1.5, 1500);
    EXPECT_NE(mesh_organ(o).problem.find("more than the budget of 1500"), std::string::npos);
    Organ hopeless = organ(make_ellipsoid({}, {60, 60, 60}, {}, 2), 1, 100);
    EXPECT_THROW(mesh_organ(hopeless), SurfaceError);
}

TEST(OrganMesh, surfaces_that_cut_each_other_are_found) {
    auto a = mesh_organ(organ(make_ellipsoid({}, {10, 10, 10}, {}, 2), 3, 4000)).mesh;
    const auto b = mesh_organ(organ(make_ellipsoid({12, 0, 0}, {10, 10, 10}, {}, 2), 3, 4000)).mesh;
    const auto base = static_cast<std::uint32_t>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const auto& t : b.triangles)
        a.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    a.normals.clear(), a.colours.clear(), a.region.clear();
    const auto both = examine(std::move(a), 0);
    EXPECT_GT(both.self_intersections, 10u);
    EXPECT_NE(both.problem.find("cut each other"), std::string::npos);
}

} // namespace
