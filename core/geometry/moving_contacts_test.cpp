// Contacts with a surface that moves are those with the same surface built anew where it has got to.
#include "geometry/chain_contacts.hpp"
#include "geometry/test_shapes.hpp"

#include <gtest/gtest.h>

#include <numbers>

using namespace calot::geometry;
using namespace calot::geometry::test;

namespace {

constexpr double radius = 6.3e-3, margin = 2e-3;

// A chain along a helix in a tube of 30 mm, or through the middle of whatever it is.
std::vector<double> chain_at(std::size_t nodes, double wound, double phase) {
    std::vector<double> block(3 * nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
        const double angle = 0.4 * static_cast<double>(i) + phase;
        block[i] = wound * std::cos(angle);
        block[nodes + i] = wound * std::sin(angle);
        block[2 * nodes + i] = 0.03 + 0.0032 * static_cast<double>(i);
    }
    return block;
}

void expect_same(std::span<const Contact> a, std::span<const Contact> b, int tick) {
    ASSERT_EQ(a.size(), b.size()) << "tick " << tick;
    for (std::size_t i = 0; i < a.size(); ++i)
        ASSERT_TRUE(a[i].id == b[i].id && a[i].triangle == b[i].triangle && a[i].segment == b[i].segment &&
                    a[i].t == b[i].t && a[i].point == b[i].point && a[i].normal == b[i].normal &&
                    a[i].gap == b[i].gap)
            << "tick " << tick << ", contact " << i << ", gaps " << a[i].gap << " and " << b[i].gap;
}

// Moves `shape` by `way(vertex, tick)` every `period` ticks and compares. Returns the number of contacts.
template<class Way>
std::size_t compare(const Shape& shape, double wound, double speed, int period, Way&& way) {
    constexpr std::size_t nodes = 60;
    const std::vector<double> radii(nodes - 1, radius);
    TriangleScene moving = shape.scene();
    Shape now = shape;
    TriangleScene anew = shape.scene();
    ChainContacts with_moving(nodes), with_anew(nodes);
    std::size_t count = 0;
    for (int tick = 0; tick < 60; ++tick) {
        if (tick % period == 0) {
            now = shape.mapped([&](Vec3 v) { return v + way(v, tick); });
            EXPECT_TRUE(moving.move_vertices(now.vertices));
            anew = now.scene();
        }
        const auto block = chain_at(nodes, wound, speed * tick / wound);
        const auto a = with_moving.find(moving, Chain::of_block(block, radii), margin);
        const auto b = with_anew.find(anew, Chain::of_block(block, radii), margin);
        expect_same(a, b, tick);
        if (testing::Test::HasFatalFailure()) return 0;
        count += a.size();
    }
    return count;
}

TEST(MovingContacts, with_a_tube_that_breathes_are_those_with_the_tube_built_anew) {
    const Shape tube = tube_wall(0.03, 0.034, 0.25, 40, 40);
    const auto breathe = [](Vec3 v, int tick) {
        const double way = 1e-3 * std::sin(0.3 * tick + 30 * v.z);
        return (way / std::hypot(v.x, v.y)) * Vec3{v.x, v.y, 0.3 * std::hypot(v.x, v.y)};
    };
    EXPECT_GT(compare(tube, 0.0232, 1e-4, 3, breathe), 1500u);
    EXPECT_GT(compare(tube, 0.0232, 3e-4, 1, breathe), 1500u) << "each tick, fast";
}

TEST(MovingContacts, with_loose_and_thin_triangles_are_those_with_them_built_anew) {
    Shape mess = soup(7, 3000, 0.05, 0.006);
    for (std::size_t i = 0; i < mess.vertices.size(); i += 3)
        mess.vertices[i + 2] = 0.12 + 2 * mess.vertices[i + 2];
    const Shape flat = soup(8, 500, 0.04, 0.004).mapped([](Vec3 v) {
        return Vec3{v.x, 1e-3 * v.y, v.z + 0.1};
    });
    const auto first = static_cast<std::uint32_t>(mess.vertices.size() / 3);
    mess.vertices.insert(mess.vertices.end(), flat.vertices.begin(), flat.vertices.end());
    for (const std::uint32_t v : flat.triangles)
        mess.triangles.push_back(first + v);
    const auto drift = [](Vec3 v, int tick) {
        return 1e-5 * tick * Vec3{std::sin(200 * v.y), std::sin(200 * v.z), std::cos(200 * v.x)};
    };
    EXPECT_GT(compare(mess, 0.02, 1e-4, 2, drift), 1500u);
}

TEST(MovingContacts, with_a_copy_that_moves_otherwise_are_its_own) {
    const Shape tube = tube_wall(0.03, 0.034, 0.25, 48, 60);
    TriangleScene one = tube.scene();
    ASSERT_TRUE(one.move_vertices(tube.vertices));
    TriangleScene other = one;
    const Shape wide = tube.mapped([](Vec3 v) {
        return Vec3{1.02 * v.x, 1.02 * v.y, v.z};
    }),
                narrow = tube.mapped([](Vec3 v) {
                    return Vec3{0.98 * v.x, 0.98 * v.y, v.z};
                });
    ASSERT_TRUE(one.move_vertices(wide.vertices));
    ASSERT_TRUE(other.move_vertices(narrow.vertices));
    EXPECT_NE(one.surface(), other.surface());
    const std::vector<double> radii(59, radius);
    const auto block = chain_at(60, 0.0232, 0);
    ChainContacts shared(60), fresh(60);
    (void)shared.find(one, Chain::of_block(block, radii), margin);
    const auto a = shared.find(other, Chain::of_block(block, radii), margin);
    const auto b = fresh.find(other, Chain::of_block(block, radii), margin);
    ASSERT_EQ(a.size(), b.size());
    ASSERT_GT(a.size(), 50u);
    for (std::size_t i = 0; i < a.size(); ++i)
        EXPECT_EQ(a[i].gap, b[i].gap);
}

} // namespace
