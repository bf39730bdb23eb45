#include "geometry/distance.hpp"
#include "geometry/self_contacts.hpp"
#include "geometry/test_shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>

using namespace calot::geometry;
using calot::geometry::test::Random;

namespace {

constexpr double radius = 6.3e-3, margin = 2e-3;

struct Line {
    std::vector<double> block, radii;

    explicit Line(const std::vector<Vec3>& nodes) : block(3 * nodes.size()), radii(nodes.size() - 1, radius) {
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            block[i] = nodes[i].x;
            block[nodes.size() + i] = nodes[i].y;
            block[2 * nodes.size() + i] = nodes[i].z;
        }
    }
    Chain chain(std::size_t first_segment = 0) const { return Chain::of_block(block, radii, first_segment); }
};

// A helix of one and a half turns whose pitch is `pitch`: the turns lie side by side.
Line helix(double helix_radius, double pitch, std::size_t nodes, double turns) {
    std::vector<Vec3> places;
    for (std::size_t i = 0; i < nodes; ++i) {
        const double angle =
            2 * std::numbers::pi * turns * static_cast<double>(i) / static_cast<double>(nodes - 1);
        places.push_back({helix_radius * std::cos(angle), helix_radius * std::sin(angle),
                          pitch * angle / (2 * std::numbers::pi)});
    }
    return Line(places);
}

void expect_well_formed(std::span<const SelfContact> contacts, const Chain& chain) {
    for (const SelfContact& c : contacts) {
        const Vec3 here = chain.node(c.segment) + c.t * (chain.node(c.segment + 1) - chain.node(c.segment));
        const Vec3 there = chain.node(c.other_segment) +
                           c.other_t * (chain.node(c.other_segment + 1) - chain.node(c.other_segment));
        ASSERT_NEAR(norm(c.normal), 1.0, 1e-12);
        ASSERT_NEAR(norm(there + (c.gap + 2 * radius) * c.normal - here), 0.0, 1e-12);
        ASSERT_NEAR(norm(there + radius * c.normal - c.point), 0.0, 1e-12);
        ASSERT_LE(c.gap, margin);
        ASSERT_NE(c.id >> 63, 0u);
    }
}

TEST(SelfContacts, a_straight_chain_has_none) {
    std::vector<Vec3> nodes;
    nodes.reserve(100);
    for (int i = 0; i < 100; ++i)
        nodes.push_back({0.002 * i, 0, 0}); // nodes much closer than the radius
    SelfContacts query(100);
    EXPECT_TRUE(query.find(Line(nodes).chain(), margin).empty());
    EXPECT_TRUE(query.valid());
}

TEST(SelfContacts, a_gentle_bend_at_the_smallest_radius_of_an_endoscope_has_none) {
    const Line bend = helix(0.025, 0.0, 30, 0.58); // 210 degrees
    SelfContacts query(30);
    EXPECT_TRUE(query.find(bend.chain(), margin).empty());
}

TEST(SelfContacts, a_loop_touches_itself_once_where_it_crosses) {
    std::vector<Vec3> nodes;
    for (int i = 0; i <= 10; ++i)
        nodes.push_back({0.0103 * i - 0.0537, 0, 0});
    for (int i = 1; i <= 27; ++i) { // round and back over it at a right angle, one diameter higher
        const double a = 1.5 * std::numbers::pi * i / 27;
        nodes.push_back(
            Vec3{0.0493 + 0.05 * std::sin(a), 0.05 - 0.05 * std::cos(a), (2 * radius - 1e-4) * i / 27});
    }
    for (int i = 1; i <= 10; ++i)
        nodes.push_back(nodes.back() + Vec3{0, -0.0097, 0});
    const Line line(nodes);
    SelfContacts query(nodes.size());
    const auto found = query.find(line.chain(), margin);
    expect_well_formed(found, line.chain());
    ASSERT_GE(found.size(), 1u);
    const auto deepest = std::ranges::min_element(found, {}, &SelfContact::gap);
    EXPECT_NEAR(deepest->gap, -1e-4, 1e-6);
    EXPECT_NEAR(deepest->normal.z, 1.0, 1e-3);
    EXPECT_LT(deepest->other_segment, 10u);
    EXPECT_GT(deepest->segment, 35u);
    // Whatever else is within the margin is not a second crossing.
    EXPECT_EQ(std::ranges::count_if(found, [](const SelfContact& c) { return c.gap < 0.0; }), 1);
}

TEST(SelfContacts, turns_side_by_side_are_held_all_along) {
    const Line coil = helix(0.03, 2 * radius - 2e-4, 60, 2.0);
    SelfContacts query(60);
    const auto found = query.find(coil.chain(), margin);
    expect_well_formed(found, coil.chain());
    std::set<std::uint32_t> held;
    for (const SelfContact& c : found)
        if (c.gap < 0.0) held.insert(c.segment);
    // Two turns of 59 segments: those of the second lie on the first.
    EXPECT_GE(held.size(), 55u);
    for (const SelfContact& c : found)
        EXPECT_GT(std::fabs(c.normal.z), 0.95);
}

TEST(SelfContacts, the_nearest_pair_is_always_among_them) {
    Random random(31);
    SelfContacts query(12);
    int touching = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        // Two straight parts joined by a detour, so that only they can touch.
        const Vec3 u = random.in_cube(1), v = random.in_cube(1), meet = random.in_cube(0.01);
        std::vector<Vec3> nodes;
        nodes.reserve(12);
        for (int i = 0; i < 5; ++i)
            nodes.push_back((0.01 * (i - 2) / norm(u)) * u);
        nodes.push_back({0.5, 0.5, 0.5});
        nodes.push_back({0.5, 0.4, 0.5});
        for (int i = 0; i < 5; ++i)
            nodes.push_back(meet + (0.01 * (i - 2) / norm(v)) * v);
        const Line line(nodes);
        double nearest = std::numeric_limits<double>::infinity();
        for (int i = 0; i <= 4; ++i)
            for (int j = 6; j <= 10; ++j)
                nearest = std::min(
                    nearest, closest_of_segments(nodes[i], nodes[i + 1], nodes[j], nodes[j + 1]).distance2);
        const double expected = std::sqrt(nearest) - 2 * radius;
        const auto found = query.find(line.chain(), margin);
        ASSERT_NO_FATAL_FAILURE(expect_well_formed(found, line.chain())) << "trial " << trial;
        double deepest = std::numeric_limits<double>::infinity();
        for (const SelfContact& c : found)
            if (std::min(c.segment, c.other_segment) <= 4 && std::max(c.segment, c.other_segment) >= 6)
                deepest = std::min(deepest, c.gap);
        if (expected > margin) {
            ASSERT_EQ(deepest, std::numeric_limits<double>::infinity()) << "trial " << trial;
        } else {
            ASSERT_NEAR(deepest, expected, 0.005 * radius + 1e-9) << "trial " << trial;
            ++touching;
        }
    }
    EXPECT_GT(touching, 1000);
}

TEST(SelfContacts, long_chains_are_pruned_without_missing_a_pair) {
    // A long chain in a ball of yarn: the same contacts as when each pair of parts is asked for alone.
    Random random(32);
    std::vector<Vec3> nodes{{0, 0, 0}};
    Vec3 heading{1, 0, 0};
    while (nodes.size() < 300) {
        heading = heading + random.in_cube(0.4) - 4.0 * nodes.back();
        heading = (1 / norm(heading)) * heading;
        nodes.push_back(nodes.back() + 0.01 * heading);
    }
    const Line line(nodes);
    SelfContacts query(300);
    const auto found = query.find(line.chain(), margin);
    ASSERT_NO_FATAL_FAILURE(expect_well_formed(found, line.chain()));
    std::size_t crossings = 0;
    for (std::size_t i = 0; i < 299; ++i)
        for (std::size_t j = 0; j + 10 < i; ++j) {
            const SegmentPair pair = closest_of_segments(nodes[i], nodes[i + 1], nodes[j], nodes[j + 1]);
            if (!(pair.s > 0 && pair.s < 1 && pair.t > 0 && pair.t < 1)) continue;
            const double gap = std::sqrt(pair.distance2) - 2 * radius;
            if (gap > -1e-3 || gap < -3e-3) continue; // deep enough to be reported, rare enough to be kept
            ++crossings;
            const auto there = std::ranges::find_if(
                found, [&](const SelfContact& c) { return c.segment == i && c.gap <= gap + 1e-9; });
            EXPECT_NE(there, found.end()) << "segments " << i << " and " << j << ", gap " << gap;
        }
    EXPECT_GT(crossings, 5u);
}

TEST(SelfContacts, a_contact_keeps_its_identity_while_the_loop_tightens) {
    SelfContacts query(60);
    std::set<std::uint64_t> first, last;
    for (int tick = 0; tick < 50; ++tick) {
        const Line coil = helix(0.03 - 5e-5 * tick, 2 * radius, 60, 2.0);
        last.clear();
        for (const SelfContact& c : query.find(coil.chain(), margin))
            last.insert(c.id);
        if (tick == 0) first = last;
    }
    std::vector<std::uint64_t> kept;
    std::ranges::set_intersection(first, last, std::back_inserter(kept));
    EXPECT_GE(kept.size(), first.size() * 9 / 10)
        << first.size() << " at first, " << last.size() << " at last";
}

TEST(SelfContacts, resumes_from_saved_bytes_and_refuses_others) {
    SelfContacts query(60), resumed(60);
    (void)query.find(helix(0.03, 2 * radius, 60, 2.0).chain(), margin);
    std::vector<std::byte> state(query.state_size());
    query.save(state);
    ASSERT_TRUE(resumed.load(state));
    const Line next = helix(0.0299, 2 * radius, 60, 2.0);
    const auto a = query.find(next.chain(), margin), b = resumed.find(next.chain(), margin);
    ASSERT_EQ(a.size(), b.size());
    ASSERT_FALSE(a.empty());
    for (std::size_t i = 0; i < a.size(); ++i)
        EXPECT_EQ(a[i].id, b[i].id);
    ChainContacts other(60); // as many slots, but not of the chain with itself
    EXPECT_EQ(other.state_size(), state.size());
    EXPECT_FALSE(other.load(state));
}

TEST(SelfContacts, hostile_chains_give_none_and_say_so) {
    SelfContacts query(5);
    EXPECT_TRUE(query.find(Chain{}, margin).empty());
    EXPECT_FALSE(query.valid());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(query.find(Line({{0, 0, 0}, {nan, 0, 0}, {1, 0, 0}}).chain(), margin).empty());
    EXPECT_FALSE(query.valid());
    EXPECT_TRUE(query.find(Line({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}).chain(), margin).empty());
    EXPECT_TRUE(query.valid());
}

} // namespace
