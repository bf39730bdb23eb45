#include "geometry/chain_contacts.hpp"
#include "geometry/distance.hpp"
#include "geometry/test_shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <set>

using namespace calot::geometry;
using namespace calot::geometry::test;

namespace {

constexpr double radius = 6.3e-3, margin = 2e-3;

// A chain's storage: one block of 3 N, as the pipeline keeps it.
struct Line {
    std::vector<double> block, radii;

    explicit Line(const std::vector<Vec3>& nodes, double r = radius)
        : block(3 * nodes.size()), radii(nodes.size() - 1, r) {
        for (std::size_t i = 0; i < nodes.size(); ++i)
            set(i, nodes[i]);
    }
    std::size_t size() const { return block.size() / 3; }
    void set(std::size_t i, Vec3 v) {
        block[i] = v.x;
        block[size() + i] = v.y;
        block[2 * size() + i] = v.z;
    }
    Vec3 node(std::size_t i) const { return {block[i], block[size() + i], block[2 * size() + i]}; }
    Chain chain(std::size_t first_segment = 0) const { return Chain::of_block(block, radii, first_segment); }
};

Line straight(Vec3 from, Vec3 to, std::size_t nodes) {
    std::vector<Vec3> places;
    for (std::size_t i = 0; i < nodes; ++i)
        places.push_back(from + (static_cast<double>(i) / static_cast<double>(nodes - 1)) * (to - from));
    return Line(places);
}

// Sphere of 5 cm with vertices displaced by up to `noise`, less where they are close together.
Shape lumpy_sphere(Random& random, double noise) {
    return sphere({0, 0, 0}, 0.05, 40, 60).mapped([&](Vec3 v) {
        return v + random.in_cube(noise * std::hypot(v.x, v.y) / 0.05);
    });
}

std::vector<Contact> contacts_of(const TriangleScene& scene, const Line& line) {
    ChainContacts query(line.size());
    const auto found = query.find(scene, line.chain(), margin);
    return {found.begin(), found.end()};
}

bool same(const Contact& a, const Contact& b) {
    return a.id == b.id && a.organ == b.organ && a.triangle == b.triangle && a.segment == b.segment &&
           a.t == b.t && a.point == b.point && a.normal == b.normal && a.gap == b.gap &&
           a.friction == b.friction;
}

// Distance from segment to surface by trying all triangles.
double brute_distance(const Shape& shape, Vec3 p0, Vec3 p1) {
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < shape.triangle_count(); ++t)
        best = std::min(
            best, closest_segment_triangle(p0, p1, shape.corner(t, 0), shape.corner(t, 1), shape.corner(t, 2))
                      .distance2);
    return std::sqrt(best);
}

void expect_well_formed(std::span<const Contact> contacts, const TriangleScene& scene, const Line& line) {
    for (const Contact& c : contacts) {
        const Vec3 a = line.node(c.segment), b = line.node(c.segment + 1);
        const Vec3 on_axis = a + c.t * (b - a);
        ASSERT_NEAR(norm(c.normal), 1.0, 1e-12);
        ASSERT_NEAR(norm(on_axis - (c.point + (c.gap + radius) * c.normal)), 0.0, 1e-9)
            << "normal and gap do not lead from the surface to the centreline, segment " << c.segment << " t "
            << c.t;
        ASSERT_LE(c.gap, margin);
        const auto& t = *std::ranges::find_if(scene.triangles(), [&](const auto& triangle) {
            return triangle.organ == c.organ && triangle.id == c.triangle;
        });
        const Vec3 on =
            closest_on_triangle(c.point, scene.corner(t, 0), scene.corner(t, 1), scene.corner(t, 2)).point;
        ASSERT_NEAR(norm(on - c.point), 0.0, 1e-7) << "the point is not on the triangle it names";
    }
}

TEST(ChainContacts, a_shaft_on_a_flat_wall_has_one_contact_at_each_node) {
    const Shape wall = box({-0.2, -0.2, -0.05}, {0.2, 0.2, 0}, 40);
    const TriangleScene scene = wall.scene();
    const Line line = straight({-0.0503, 0.0117, radius - 1e-4}, {0.0497, 0.0217, radius - 1e-4}, 11);
    const auto contacts = contacts_of(scene, line);
    expect_well_formed(contacts, scene, line);
    ASSERT_EQ(contacts.size(), 11u);
    for (const Contact& c : contacts) {
        EXPECT_NEAR(c.normal.z, 1.0, 1e-12);
        EXPECT_NEAR(c.gap, -1e-4, 1e-12);
        EXPECT_EQ(c.t, c.segment == 9 && &c == &contacts.back() ? 1.0 : 0.0);
    }
}

TEST(ChainContacts, the_nearest_surface_of_each_segment_is_always_among_them) {
    Random random(21);
    const Shape lumpy = lumpy_sphere(random, 0.001);
    const TriangleScene scene = lumpy.scene();
    ChainContacts query(2);
    int touching = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        Vec3 p0 = random.in_cube(0.06);
        p0 = (random.in(0.052, 0.062) / norm(p0)) * p0;
        const Line line({p0, p0 + random.in_cube(0.008)});
        if (organ_containing(scene, line.node(0)) == 0 || organ_containing(scene, line.node(1)) == 0)
            continue;
        const double expected = brute_distance(lumpy, line.node(0), line.node(1)) - radius;
        if (expected == -radius) continue; // the centreline itself crosses the surface
        query.reset();
        const auto found = query.find(scene, line.chain(), margin);
        ASSERT_NO_FATAL_FAILURE(expect_well_formed(found, scene, line));
        double deepest = std::numeric_limits<double>::infinity();
        for (const Contact& c : found)
            deepest = std::min(deepest, c.gap);
        if (expected > margin) {
            ASSERT_TRUE(found.empty()) << "trial " << trial;
        } else {
            // What both ends imply is left out up to 0.005 radii.
            ASSERT_GE(deepest, expected - 1e-9) << "trial " << trial;
            ASSERT_LE(deepest, expected + 0.005 * radius + 1e-9) << "trial " << trial;
            ++touching;
        }
    }
    EXPECT_GT(touching, 500);
}

TEST(ChainContacts, a_shaft_lying_in_a_tube_is_held_from_its_side_only_and_by_every_node) {
    const Shape wall = tube_wall(0.010, 0.014, 0.2, 64, 80);
    const TriangleScene scene = wall.scene();
    const double down = 0.010 * std::cos(std::numbers::pi / 64) - radius + 5e-5; // 50 um into the wall
    const Line line = straight({0, down, 0.05}, {0, down, 0.15}, 11);
    const auto contacts = contacts_of(scene, line);
    expect_well_formed(contacts, scene, line);
    std::set<std::uint32_t> held;
    for (const Contact& c : contacts) {
        if (c.gap > 0) continue;
        EXPECT_LT(c.normal.y, -0.99) << "segment " << c.segment;
        held.insert(c.segment + (c.t > 0.5));
    }
    EXPECT_EQ(held.size(), 11u);
}

TEST(ChainContacts, a_shaft_filling_a_tube_is_held_from_all_sides) {
    const Shape wall = tube_wall(0.0064, 0.0104, 0.2, 24, 40);
    const TriangleScene scene = wall.scene();
    const Line line = straight({0, 0, 0.05}, {0, 0, 0.15}, 11);
    const auto contacts = contacts_of(scene, line);
    expect_well_formed(contacts, scene, line);
    for (std::size_t node = 0; node < 11; ++node) {
        // Whatever direction the node may try, a contact opposes it.
        for (int k = 0; k < 36; ++k) {
            const double angle = k * std::numbers::pi / 18;
            const Vec3 push{std::cos(angle), std::sin(angle), 0};
            double best = 1.0;
            for (const Contact& c : contacts)
                if (c.segment + (c.t > 0.5) == node) best = std::min(best, dot(c.normal, push));
            EXPECT_LT(best, -0.5) << "node " << node << ", direction " << 10 * k;
        }
    }
}

TEST(ChainContacts, the_far_face_of_a_thin_wall_is_ignored_on_either_side) {
    const Shape wall = box({-0.1, -0.1, 0}, {0.1, 0.1, 0.004}, 40);
    const TriangleScene scene = wall.scene();
    for (const double depth : {0.0, 1e-3, 3e-3}) {
        const double above = 0.004 + radius - depth, below = -radius + depth;
        const auto over = contacts_of(scene, straight({-0.033, 0, above}, {0.031, 0.01, above}, 7));
        const auto under = contacts_of(scene, straight({-0.033, 0, below}, {0.031, 0.01, below}, 7));
        ASSERT_EQ(over.size(), 7u);
        ASSERT_EQ(under.size(), 7u);
        for (const Contact& c : over) {
            EXPECT_NEAR(c.normal.z, 1.0, 1e-12);
            EXPECT_NEAR(c.gap, -depth, 1e-12);
        }
        for (const Contact& c : under) {
            EXPECT_NEAR(c.normal.z, -1.0, 1e-12);
            EXPECT_NEAR(c.gap, -depth, 1e-12);
        }
    }
}

TEST(ChainContacts, a_shaft_through_a_round_hole_touches_the_rim_between_its_nodes) {
    // The incision: a hole of 18 mm in a wall of 4 mm, rounded; the shaft 12.6 mm, pressed against one side.
    const Shape plate = plate_with_hole(0.009, 0.05, 0.004, 96, 12, 12);
    const TriangleScene scene = plate.scene();
    for (int k = 0; k < 24; ++k) {
        const double angle = 0.01 + k * std::numbers::pi / 12;
        const Vec3 side{std::cos(angle), std::sin(angle), 0};
        const Vec3 offset = (0.009 - radius + 1e-4) * side;
        const Line line = straight(offset + Vec3{0, 0, -0.025}, offset + Vec3{0, 0, 0.025}, 6);
        const auto contacts = contacts_of(scene, line);
        expect_well_formed(contacts, scene, line);
        const auto deepest = std::ranges::min_element(contacts, {}, &Contact::gap);
        ASSERT_NE(deepest, contacts.end());
        EXPECT_EQ(deepest->segment, 2u);
        EXPECT_NEAR(deepest->t, 0.5, 0.05);
        EXPECT_LT(dot(deepest->normal, side), -0.99);
        EXPECT_NEAR(deepest->gap, -1e-4, 2e-5); // the polygon's sides lie up to 5 um inside the circle
    }
}

TEST(ChainContacts, a_shaft_tilted_in_a_hole_is_held_by_opposite_rims) {
    const Shape plate = plate_with_hole(0.0065, 0.05, 0.004, 96, 12, 12);
    const TriangleScene scene = plate.scene();
    const double tilt = 0.25;
    const Vec3 along{std::sin(tilt), 0, std::cos(tilt)};
    const Line line = straight(-0.03 * along, 0.03 * along, 8);
    const auto contacts = contacts_of(scene, line);
    expect_well_formed(contacts, scene, line);
    const bool left =
        std::ranges::any_of(contacts, [](const Contact& c) { return c.normal.x > 0.9 && c.gap < 0.0; });
    const bool right =
        std::ranges::any_of(contacts, [](const Contact& c) { return c.normal.x < -0.9 && c.gap < 0.0; });
    EXPECT_TRUE(left && right) << contacts.size() << " contacts";
}

TEST(ChainContacts, a_shaft_across_folds_rests_on_every_crest) {
    // Rugae: ridges along y, 12 mm apart, 3 mm high, nodes at 10 mm.
    Shape folds = box({-0.06, -0.03, -0.02}, {0.06, 0.03, 0}, 60).mapped([](Vec3 v) {
        if (v.z < -1e-9) return v;
        return Vec3{v.x, v.y, 1.5e-3 * std::cos(v.x * 2 * std::numbers::pi / 0.012)};
    });
    const TriangleScene scene = folds.scene();
    const double z = 1.5e-3 + radius - 5e-5;
    const Line line = straight({-0.0403, 0.002, z}, {0.0397, 0.004, z}, 9);
    const auto contacts = contacts_of(scene, line);
    expect_well_formed(contacts, scene, line);
    for (int crest = -3; crest <= 3; ++crest) {
        const bool held = std::ranges::any_of(contacts, [&](const Contact& c) {
            return std::fabs(c.point.x - 0.012 * crest) < 1.6e-3 && c.normal.z > 0.99 && c.gap < 0.0;
        });
        EXPECT_TRUE(held) << "crest " << crest;
    }
}

TEST(ChainContacts, ends_shared_by_segments_are_not_reported_twice) {
    Random random(22);
    const Shape lumpy = lumpy_sphere(random, 0.0007);
    const TriangleScene scene = lumpy.scene();
    for (int trial = 0; trial < 200; ++trial) {
        Vec3 n = random.in_cube(1), u = cross(n, random.in_cube(1));
        n = (1 / norm(n)) * n;
        u = (1 / norm(u)) * u;
        std::vector<Vec3> nodes;
        for (int i = -4; i <= 4; ++i)
            nodes.push_back(0.0566 * (std::cos(0.15 * i) * n + std::sin(0.15 * i) * u));
        const Line line(nodes);
        const auto contacts = contacts_of(scene, line);
        expect_well_formed(contacts, scene, line);
        EXPECT_GE(contacts.size(), 9u);
        for (std::size_t i = 0; i < contacts.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                EXPECT_FALSE(norm(contacts[i].point - contacts[j].point) < 1e-4 &&
                             dot(contacts[i].normal, contacts[j].normal) > 0.999)
                    << "contacts " << j << " and " << i << " of trial " << trial;
    }
}

TEST(ChainContacts, gap_and_normal_change_without_jumps_while_sliding_over_a_convex_surface) {
    const Shape ball = sphere({0, 0, 0}, 0.05, 30, 40);
    const TriangleScene scene = ball.scene();
    ChainContacts query(2);
    double last_gap = 0;
    Vec3 last_normal{};
    for (int step = 0; step <= 4000; ++step) {
        const double angle = -1.0 + 2.0 * step / 4000; // 28 um a step along the surface
        const Vec3 p = 0.0562 * Vec3{std::cos(angle), 0.3 * std::sin(angle), 0.95 * std::sin(angle)};
        const Line line({p, (1 + 0.01 / norm(p)) * p}); // pointing away: the first node touches
        const auto found = query.find(scene, line.chain(), margin);
        ASSERT_EQ(found.size(), 1u) << "step " << step;
        if (step > 0) {
            ASSERT_LT(std::fabs(found[0].gap - last_gap), 3e-5) << "step " << step;
            // On an edge the normal turns by travel / distance; on a face not at all.
            ASSERT_LT(norm(found[0].normal - last_normal), 3e-5 / 6e-3 * 1.5) << "step " << step;
        }
        last_gap = found[0].gap;
        last_normal = found[0].normal;
    }
}

TEST(ChainContacts, a_contact_keeps_its_identity_while_it_slides) {
    const Shape wall = box({-0.2, -0.2, -0.05}, {0.2, 0.2, 0}, 60);
    const TriangleScene scene = wall.scene();
    ChainContacts query(11);
    std::vector<std::uint64_t> ids;
    for (int tick = 0; tick < 300; ++tick) { // 0.3 m/s
        const double x = -0.08 + 3e-4 * tick;
        const auto found =
            query.find(scene, straight({x, 0.001, radius}, {x + 0.1, 0.002, radius}, 11).chain(), margin);
        ASSERT_EQ(found.size(), 11u);
        std::vector<std::uint64_t> now;
        for (const Contact& c : found)
            now.push_back(c.id);
        if (tick > 0) {
            ASSERT_EQ(now, ids) << "tick " << tick;
        }
        ids = now;
    }
    EXPECT_EQ(std::set<std::uint64_t>(ids.begin(), ids.end()).size(), 11u);
}

TEST(ChainContacts, the_contact_at_a_rim_keeps_its_identity_from_segment_to_segment) {
    const Shape plate = plate_with_hole(0.009, 0.05, 0.004, 96, 12, 12);
    const TriangleScene scene = plate.scene();
    ChainContacts query(11);
    std::set<std::uint64_t> ids;
    for (int tick = 0; tick < 200; ++tick) { // 60 mm: six segments pass the rim
        const double z = -0.08 + 3e-4 * tick, x = 0.009 - radius;
        const auto found = query.find(scene, straight({x, 0, z}, {x, 0, z + 0.1}, 11).chain(), margin);
        const auto deepest = std::ranges::min_element(found, {}, &Contact::gap);
        ASSERT_NE(deepest, found.end()) << "tick " << tick;
        ASSERT_NEAR(deepest->gap, 0.0, 1e-4) << "tick " << tick;
        ids.insert(deepest->id);
    }
    EXPECT_LE(ids.size(), 1u);
}

TEST(ChainContacts, a_centreline_that_sinks_into_a_wall_is_pushed_back_to_the_side_it_came_from) {
    const Shape wall = box({-0.1, -0.1, 0}, {0.1, 0.1, 0.004}, 40);
    const TriangleScene scene = wall.scene();
    ChainContacts query(4);
    std::uint64_t id = 0;
    for (int tick = 0; tick <= 45; ++tick) { // from touching down to 3.2 mm inside, nearer to the far face
        const double z = 0.004 + radius - 2.1e-4 * tick;
        const auto found = query.find(scene, straight({-0.013, 0, z}, {0.017, 0, z}, 4).chain(), margin);
        ASSERT_EQ(found.size(), 4u) << "tick " << tick;
        for (const Contact& c : found) {
            ASSERT_NEAR(c.normal.z, 1.0, 1e-12) << "tick " << tick;
            ASSERT_NEAR(c.gap, -2.1e-4 * tick, 1e-12) << "tick " << tick;
        }
        if (tick > 0) {
            ASSERT_EQ(found[0].id, id) << "tick " << tick;
        }
        id = found[0].id;
    }
}

TEST(ChainContacts, a_segment_pressed_past_a_sharp_edge_is_pushed_back_over_it) {
    // Across the edge of a block, both nodes outside of it, down to 2 mm beyond the edge.
    const TriangleScene scene = box({-0.1, -0.1, -0.1}, {0, 0.1, 0}, 20).scene();
    const double half = std::numbers::sqrt2 / 2;
    const Vec3 out{half, 0, half}, along{half, 0, -half};
    ChainContacts query(2);
    std::uint64_t id = 0;
    for (int tick = 0; tick <= 40; ++tick) {
        const double height = radius - 2.1e-4 * tick; // of the centreline over the edge
        const Vec3 middle = height * out + Vec3{0, 0.0123, 0};
        const Line line({middle - 5e-3 * along, middle + 5e-3 * along});
        const auto found = query.find(scene, line.chain(), margin);
        const auto at_edge =
            std::ranges::find_if(found, [](const Contact& c) { return c.t > 0.0 && c.t < 1.0; });
        ASSERT_NE(at_edge, found.end()) << "tick " << tick;
        ASSERT_NEAR(at_edge->gap, height - radius, 1e-9) << "tick " << tick;
        ASSERT_GT(dot(at_edge->normal, out), 0.999) << "tick " << tick;
        if (tick > 0) {
            ASSERT_EQ(at_edge->id, id) << "tick " << tick;
        }
        id = at_edge->id;
    }
}

TEST(ChainContacts, a_tip_driven_at_the_fastest_insertion_never_passes_a_thin_wall) {
    // A chain of points, each pushed 0.3 mm a tick along z by the base; contacts of the tick before hold it
    // back, as in the tick pipeline. 4 mm of wall across its way, hit head on and at a slant.
    const Shape wall = box({-0.4, -0.4, 0}, {0.4, 0.4, 0.004}, 80);
    const TriangleScene scene = wall.scene();
    for (const double slant : {0.0, 0.6, 1.2}) {
        const Vec3 along{std::sin(slant), 0, std::cos(slant)};
        Line line = straight(Vec3{0, 0, -0.02} - 0.09 * along, Vec3{0, 0, -0.02}, 10);
        ChainContacts query(10);
        std::vector<Contact> held;
        for (int tick = 0; tick < 1000; ++tick) {
            Line next = line;
            for (std::size_t i = 0; i < 10; ++i)
                next.set(i, line.node(i) + 3e-4 * along);
            for (const Contact& c : held) { // what the constraint of each contact allows
                const std::size_t node = c.segment + (c.t > 0.5);
                const double gap = dot(next.node(node) - c.point, c.normal) - radius;
                if (gap < 0.0) next.set(node, next.node(node) - gap * c.normal);
            }
            const auto found =
                query.find(scene, line.chain(), margin); // of the older positions: one tick late
            held.assign(found.begin(), found.end());
            line = next;
            for (std::size_t i = 0; i < 10; ++i)
                ASSERT_LT(line.node(i).z, -radius + 1e-9)
                    << "tick " << tick << ", node " << i << ", slant " << slant;
        }
        EXPECT_FALSE(held.empty());
    }
}

TEST(ChainContacts, depends_on_nothing_but_its_inputs_and_its_memory) {
    Random random(23);
    const Shape lumpy = lumpy_sphere(random, 0.001);
    const TriangleScene scene = lumpy.scene(), again = lumpy.scene();
    ChainContacts one(9), other(9), resumed(9);
    std::vector<std::byte> state(one.state_size());
    for (int tick = 0; tick < 100; ++tick) {
        std::vector<Vec3> nodes;
        for (int i = -4; i <= 4; ++i) {
            const double a = 0.15 * i + 0.003 * tick;
            nodes.push_back(Vec3{0.0564 * std::cos(a), 0.0564 * std::sin(a), 2e-4 * tick - 0.01});
        }
        const Line line(nodes);
        if (tick == 50) {
            one.save(state);
            ASSERT_TRUE(resumed.load(state));
        }
        const auto a = one.find(scene, line.chain(), margin), b = other.find(again, line.chain(), margin);
        ASSERT_TRUE(std::ranges::equal(a, b, same)) << "tick " << tick;
        if (tick < 50) continue;
        const auto c = resumed.find(scene, line.chain(), margin);
        ASSERT_TRUE(std::ranges::equal(a, c, same)) << "resumed, tick " << tick;
    }
}

TEST(ChainContacts, remembered_candidates_and_screens_never_change_a_result) {
    // A scene whose vertices were moved, to where they were, answers without either.
    Random random(24);
    const Shape shapes[] = {
        lumpy_sphere(random, 0.001), lumpy_sphere(random, 0), plate_with_hole(0.02, 0.06, 0.004, 64, 8, 12),
        tube_wall(0.02, 0.024, 0.1, 30, 20), box({-0.03, -0.03, -0.03}, {0.03, 0.03, 0.03}, 9)};
    std::size_t compared = 0;
    for (const Shape& shape : shapes) {
        const TriangleScene scene = shape.scene();
        TriangleScene plain = scene;
        ASSERT_TRUE(plain.move_vertices(shape.vertices));
        ASSERT_TRUE(scene.has_screens() && !plain.has_screens());
        for (int run = 0; run < 45; ++run) {
            ChainContacts fast(8), slow(8);
            std::vector<Vec3> nodes{random.in_cube(0.07)};
            for (int i = 1; i < 8; ++i)
                nodes.push_back(nodes.back() + random.in_cube(0.01));
            const Vec3 speed = random.in_cube(4e-4);
            for (int tick = 0; tick < 60; ++tick) {
                for (Vec3& node : nodes)
                    node = node + speed + random.in_cube(5e-5);
                const Line line(nodes);
                const auto a = fast.find(scene, line.chain(), margin),
                           b = slow.find(plain, line.chain(), margin);
                ASSERT_TRUE(std::ranges::equal(a, b, same))
                    << "shape " << &shape - shapes << ", run " << run << ", tick " << tick << ": " << a.size()
                    << " and " << b.size() << " contacts";
                compared += a.size();
            }
        }
    }
    EXPECT_GT(compared, 10000u);
}

TEST(ChainContacts, refuses_states_that_it_did_not_write) {
    ChainContacts query(3);
    std::vector<std::byte> state(query.state_size());
    query.save(state);
    EXPECT_TRUE(query.load(state));
    EXPECT_FALSE(query.load(std::span(state).first(state.size() - 1)));
    EXPECT_FALSE(ChainContacts(4).load(state));
    std::vector<std::byte> wrong = state;
    wrong[0] ^= std::byte{1};
    EXPECT_FALSE(query.load(wrong));
    wrong = state;
    std::memset(wrong.data() + 32, 0xff, 8); // the first count
    EXPECT_FALSE(query.load(wrong));
}

TEST(ChainContacts, knows_organ_region_triangle_and_friction) {
    Shape floor = box({-0.1, -0.1, -0.05}, {0.1, 0.1, 0}, 10),
          shelf = box({-0.1, -0.1, 0.02}, {0.1, 0.1, 0.07}, 10);
    floor.regions.resize(floor.triangle_count());
    for (std::size_t t = 0; t < floor.triangle_count(); ++t)
        floor.regions[t] = floor.corner(t, 0).x < 0 ? 0 : 1;
    const double floor_friction[] = {0.1, 0.2}, shelf_friction[] = {0.3};
    const OrganSurface organs[] = {floor.surface("floor", floor_friction),
                                   shelf.surface("shelf", shelf_friction)};
    const TriangleScene scene(organs);
    const Line low = straight({-0.055, 0.003, radius}, {0.055, 0.003, radius}, 12);
    const auto below = contacts_of(scene, low);
    ASSERT_EQ(below.size(), 12u);
    for (const Contact& c : below) {
        EXPECT_EQ(c.organ, 0u);
        EXPECT_EQ(c.region, floor.regions[c.triangle]);
        EXPECT_EQ(c.friction, floor_friction[c.region]);
    }
    const auto above =
        contacts_of(scene, straight({-0.05, 0.003, 0.02 - radius}, {0.05, 0.003, 0.02 - radius}, 11));
    ASSERT_EQ(above.size(), 11u);
    EXPECT_EQ(above[5].organ, 1u);
    EXPECT_EQ(above[5].friction, 0.3);
}

TEST(ChainContacts, leaves_out_what_is_not_inserted_and_honours_each_radius) {
    const Shape wall = box({-0.2, -0.2, -0.05}, {0.2, 0.2, 0}, 40);
    const TriangleScene scene = wall.scene();
    Line line = straight({-0.05, 0.001, 5e-3}, {0.05, 0.001, 5e-3}, 11);
    for (std::size_t i = 0; i < 5; ++i)
        line.radii[i] = 4e-3;
    for (std::size_t i = 5; i < 10; ++i)
        line.radii[i] = 5.5e-3;
    ChainContacts query(11);
    const auto found = query.find(scene, line.chain(3), margin);
    ASSERT_EQ(found.size(), 8u);
    for (const Contact& c : found) {
        EXPECT_GE(c.segment, 3u);
        EXPECT_NEAR(c.gap, 5e-3 - line.radii[c.segment], 1e-12);
    }
    EXPECT_EQ(query.find(scene, line.chain(10), margin).size(), 0u);
    EXPECT_TRUE(query.valid());
}

TEST(ChainContacts, hostile_chains_give_no_contacts_and_say_so) {
    const TriangleScene scene = box({-0.2, -0.2, -0.05}, {0.2, 0.2, 0}, 4).scene();
    ChainContacts query(5);
    Line line = straight({0, 0, radius}, {0.04, 0, radius}, 5);
    EXPECT_EQ(query.find(scene, line.chain(), margin).size(), 5u);
    const auto refused = [&](const Chain& chain, double m = margin) {
        return query.find(scene, chain, m).empty() && !query.valid();
    };
    Line bad = line;
    bad.set(2, {std::numeric_limits<double>::quiet_NaN(), 0, 0});
    EXPECT_TRUE(refused(bad.chain()));
    bad.set(2, {0, std::numeric_limits<double>::infinity(), 0});
    EXPECT_TRUE(refused(bad.chain()));
    bad = line;
    bad.radii[1] = -1;
    EXPECT_TRUE(refused(bad.chain()));
    bad.radii[1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(refused(bad.chain()));
    bad.radii.pop_back();
    EXPECT_TRUE(refused(bad.chain()));
    EXPECT_TRUE(refused(straight({0, 0, 0}, {1, 0, 0}, 6).chain()));
    EXPECT_TRUE(refused(Chain{}));
    EXPECT_TRUE(refused(line.chain(), -1.0));
    EXPECT_TRUE(refused(line.chain(), std::numeric_limits<double>::quiet_NaN()));
    EXPECT_EQ(query.find(scene, line.chain(), margin).size(), 5u);
    EXPECT_TRUE(query.valid());
}

TEST(ChainContacts, nodes_in_one_place_and_nodes_on_the_surface_are_survived) {
    const TriangleScene scene = box({-0.2, -0.2, -0.05}, {0.2, 0.2, 0}, 40).scene();
    const Line line({{0, 0, 0}, {0, 0, 0}, {0.01, 0, 0}, {0.02, 0, 0.02}});
    const auto contacts = contacts_of(scene, line);
    expect_well_formed(contacts, scene, line);
    EXPECT_GE(contacts.size(), 3u);
    for (const Contact& c : contacts)
        EXPECT_NEAR(c.normal.z, 1.0, 1e-9);
}

TEST(ChainContacts, an_empty_scene_gives_no_contacts) {
    const TriangleScene scene{std::span<const OrganSurface>{}};
    EXPECT_TRUE(contacts_of(scene, straight({0, 0, 0}, {0.1, 0, 0}, 5)).empty());
}

} // namespace
