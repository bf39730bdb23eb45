#include "geometry/distance.hpp"
#include "geometry/test_shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

using namespace calot::geometry;
using calot::geometry::test::Random;

namespace {

// Smallest distance from p over a grid of the triangle's points: never below the true one, at most `step`
// above.
double sampled_distance(Vec3 p, Vec3 a, Vec3 b, Vec3 c, int n) {
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) {
            const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
            best = std::min(best, norm(p - (a + u * (b - a) + v * (c - a))));
        }
    return best;
}

bool in_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
    const Vec3 n = cross(b - a, c - a);
    const double slack = -1e-9 * norm2(n);
    return dot(n, cross(b - a, p - a)) >= slack && dot(n, cross(c - b, p - b)) >= slack &&
           dot(n, cross(a - c, p - c)) >= slack && std::fabs(dot(n, p - a)) <= 1e-9 * norm(n);
}

TEST(Distance, point_to_triangle_is_never_beaten_by_samples_and_never_far_from_them) {
    Random random(1);
    for (int trial = 0; trial < 2000; ++trial) {
        const Vec3 a = random.in_cube(1), b = random.in_cube(1), c = random.in_cube(1), p = random.in_cube(2);
        const Vec3 q = closest_on_triangle(p, a, b, c).point;
        ASSERT_TRUE(in_triangle(q, a, b, c)) << "trial " << trial;
        const double sampled = sampled_distance(p, a, b, c, 40);
        const double longest = std::max({norm(b - a), norm(c - b), norm(a - c)});
        ASSERT_LE(norm(p - q), sampled + 1e-12) << "trial " << trial;
        ASSERT_GE(norm(p - q), sampled - longest / 40) << "trial " << trial;
    }
}

TEST(Distance, the_part_of_a_triangle_is_the_one_the_point_lies_on) {
    const Vec3 a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
    EXPECT_EQ(closest_on_triangle({-1, -1, 1}, a, b, c).part, TrianglePart::vertex0);
    EXPECT_EQ(closest_on_triangle({2, -1, 1}, a, b, c).part, TrianglePart::vertex1);
    EXPECT_EQ(closest_on_triangle({-1, 2, 1}, a, b, c).part, TrianglePart::vertex2);
    EXPECT_EQ(closest_on_triangle({0.5, -1, 1}, a, b, c).part, TrianglePart::edge0);
    EXPECT_EQ(closest_on_triangle({1, 1, 1}, a, b, c).part, TrianglePart::edge1);
    EXPECT_EQ(closest_on_triangle({-1, 0.5, 1}, a, b, c).part, TrianglePart::edge2);
    EXPECT_EQ(closest_on_triangle({0.2, 0.2, 1}, a, b, c).part, TrianglePart::face);
}

TEST(Distance, triangles_without_area_are_the_segment_or_point_they_are) {
    const Vec3 p{0.5, 1, 0};
    EXPECT_EQ(closest_on_triangle(p, {0, 0, 0}, {1, 0, 0}, {0.25, 0, 0}).point, (Vec3{0.5, 0, 0}));
    EXPECT_EQ(closest_on_triangle(p, {0, 0, 0}, {0, 0, 0}, {1, 0, 0}).point, (Vec3{0.5, 0, 0}));
    EXPECT_EQ(closest_on_triangle(p, {2, 0, 0}, {2, 0, 0}, {2, 0, 0}).point, (Vec3{2, 0, 0}));
}

TEST(Distance, segment_to_triangle_is_never_beaten_by_samples_and_never_far_from_them) {
    Random random(2);
    int crossings = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const Vec3 a = random.in_cube(1), b = random.in_cube(1), c = random.in_cube(1);
        const Vec3 p0 = random.in_cube(1.5), p1 = random.in_cube(1.5);
        const SegmentTrianglePair pair = closest_segment_triangle(p0, p1, a, b, c);
        const double distance = std::sqrt(pair.distance2);
        ASSERT_TRUE(in_triangle(pair.on_triangle, a, b, c)) << "trial " << trial;
        ASSERT_NEAR(norm(pair.on_segment - (p0 + pair.t * (p1 - p0))), 0, 1e-12) << "trial " << trial;
        ASSERT_NEAR(norm(pair.on_segment - pair.on_triangle), distance, 1e-12) << "trial " << trial;
        double sampled = std::numeric_limits<double>::infinity();
        for (int i = 0; i <= 200; ++i) {
            const Vec3 p = p0 + (i / 200.0) * (p1 - p0);
            sampled = std::min(sampled, norm(p - closest_on_triangle(p, a, b, c).point));
        }
        ASSERT_LE(distance, sampled + 1e-12) << "trial " << trial;
        ASSERT_GE(distance, sampled - norm(p1 - p0) / 400 - 1e-12) << "trial " << trial;
        crossings += pair.distance2 == 0.0;
    }
    EXPECT_GT(crossings, 100);
}

TEST(Distance, parallel_segments_meet_in_the_middle_of_their_overlap) {
    const SegmentPair pair = closest_of_segments({0, 0, 0}, {4, 0, 0}, {6, 1, 0}, {2, 1, 0});
    EXPECT_NEAR(pair.on_first.x, 3.0, 1e-12);
    EXPECT_NEAR(pair.on_second.x, 3.0, 1e-12);
    EXPECT_NEAR(pair.distance2, 1.0, 1e-12);
}

TEST(Distance, segments_match_dense_sampling) {
    Random random(3);
    for (int trial = 0; trial < 3000; ++trial) {
        const Vec3 p0 = random.in_cube(1), q0 = random.in_cube(1), q1 = random.in_cube(1);
        const Vec3 p1 = trial % 10 == 0 ? p0 + random.in(-2, 2) * (q1 - q0) : random.in_cube(1);
        const SegmentPair pair = closest_of_segments(p0, p1, q0, q1);
        double sampled = std::numeric_limits<double>::infinity();
        for (int i = 0; i <= 200; ++i) {
            const Vec3 p = p0 + (i / 200.0) * (p1 - p0);
            const double t = std::clamp(dot(p - q0, q1 - q0) / norm2(q1 - q0), 0.0, 1.0);
            sampled = std::min(sampled, norm(p - (q0 + t * (q1 - q0))));
        }
        ASSERT_LE(std::sqrt(pair.distance2), sampled + 1e-9) << "trial " << trial;
        ASSERT_GE(std::sqrt(pair.distance2), sampled - norm(p1 - p0) / 400 - 1e-9) << "trial " << trial;
    }
}

} // namespace
