#include "geometry/candidates.hpp"
#include "geometry/near_segment.hpp"
#include "geometry/surface_minima.hpp"
#include "geometry/test_shapes.hpp"

#include <gtest/gtest.h>

using namespace calot::geometry;
using namespace calot::geometry::test;

namespace {

struct Count {
    int all = 0, known = 0; // minima, and those of leaves whose plane is known
};

// Every minimum that point p or segment p-q has in front of a part lies above the plane of the part's leaf.
void expect_above_planes(const TriangleScene& scene, Vec3 p, Vec3 q, double reach, Count& count) {
    Minimum minimum;
    for (std::uint32_t leaf = 0; leaf < scene.tree().leaf_count(); ++leaf) {
        const TriangleScene::LeafPlane& plane = scene.plane(leaf);
        const auto expect = [&](bool found, const char* part) {
            if (!found || minimum.behind) return;
            ++count.all;
            count.known += plane.normal[0] != 0 || plane.normal[1] != 0 || plane.normal[2] != 0;
            const Vec3 on_chain = p + minimum.t * (q - p);
            EXPECT_GE(detail::height_over(plane, on_chain), static_cast<double>(plane.lowest) - 1e-6)
                << part << " of leaf " << leaf << ", " << minimum.distance << " m away";
        };
        for (std::uint32_t i = scene.tree().leaf_begin(leaf); i < scene.tree().leaf_begin(leaf + 1); ++i) {
            const TriangleScene::Triangle& t = scene.triangles()[i];
            expect(face_minimum(scene, i, p, reach, minimum), "a face");
            for (int k = 0; k < 3; ++k) {
                if (t.owns >> k & 1) {
                    expect(edge_minimum(scene, t.edge[k], p, reach, false, minimum), "an edge");
                    expect(edge_minimum_along(scene, t.edge[k], p, q, reach, minimum), "an edge along");
                }
                if (t.owns >> (3 + k) & 1) {
                    expect(vertex_minimum(scene, t.vertex[k], p, reach, minimum), "a vertex");
                    expect(vertex_minimum_along(scene, t.vertex[k], p, q, reach, minimum), "a vertex along");
                }
            }
        }
    }
}

TEST(Screens, whatever_touches_a_leaf_from_outside_is_above_its_plane) {
    Random random(5);
    const Shape shapes[] = {box({-0.04, -0.03, -0.01}, {0.04, 0.03, 0.01}, 12),
                            tube_wall(0.010, 0.014, 0.08, 24, 20),
                            sphere({0, 0, 0}, 0.05, 20, 30).mapped([&](Vec3 v) {
                                return v + random.in_cube(0.0015 * std::hypot(v.x, v.y) / 0.05);
                            })};
    for (const Shape& shape : shapes) {
        const TriangleScene scene = shape.scene();
        ASSERT_TRUE(scene.has_screens());
        Count count;
        for (int trial = 0; trial < 1000; ++trial) {
            const Vec3 p = random.in_cube(0.07);
            expect_above_planes(scene, p, p + random.in_cube(0.01), 0.02, count);
        }
        EXPECT_GT(count.all, 100);
        EXPECT_GT(count.known, count.all / 3) << "of " << count.all;
    }
}

} // namespace
