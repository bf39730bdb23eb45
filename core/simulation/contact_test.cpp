// Contacts through the whole pipeline: with the shaft itself, and with organs whose friction differs by
// region and along the shaft. Scenes are made here, so that what is right is known.
#include "geometry/distance.hpp"
#include "geometry/test_shapes.hpp"
#include "simulation/collision.hpp"
#include "simulation/endoscope.hpp"
#include "simulation/test_parts.hpp"

#include <calot/math.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace calot::simulation {
namespace {

using geometry::test::Shape;
constexpr double pi = std::numbers::pi, shaft_radius = 6.3e-3;

calot_pose pose_at(geometry::Vec3 position, geometry::Vec3 direction) {
    return pose({position.x, position.y, position.z},
                between({0, 0, 1}, normalized(Vec3{direction.x, direction.y, direction.z})));
}

// A scene without gravity: the guide where the path begins, the shaft `insertion` along it.
World world_with(std::span<const geometry::OrganSurface> organs, std::vector<geometry::Vec3> path,
                 double insertion) {
    World world;
    world.scene.file = "test";
    world.scene.gravity = {0, 0, 0};
    world.scene.starts = {{.name = "default", .path = "path", .insertion = insertion}};
    world.endoscope =
        read_endoscope(std::filesystem::path(CALOT_SOURCE_DIR) / "assets/endoscopes/gif-2t160.toml");
    Landmark guide, way;
    guide.id = "guide", way.id = "path";
    guide.pose = pose_at(path[0], path[1] - path[0]);
    way.points = std::move(path);
    world.anatomy.landmarks = {guide, way};
    for (const geometry::OrganSurface& surface : organs) {
        world.anatomy.organs.emplace_back();
        world.anatomy.organs.back().id = surface.name;
    }
    world.surfaces = geometry::TriangleScene(organs);
    return world;
}

// A drum of 40 mm inside in which the shaft lies wound in two turns, a diameter and 0.6 mm from one to the
// next, between a floor and a lid: it would spring open and out otherwise.
std::shared_ptr<const World> drum() {
    constexpr double wound = 0.033, pitch = 2 * shaft_radius + 6e-4, turns = 4, insertion = 0.41;
    std::vector<geometry::Vec3> path;
    for (int i = 0; i <= 400; ++i) {
        const double angle = 2 * pi * turns * i / 400;
        path.push_back({wound * std::cos(angle), wound * std::sin(angle), -pitch * angle / (2 * pi)});
    }
    const double floor = -pitch * insertion / (2 * pi * wound) - shaft_radius - 1e-3;
    const Shape wall = geometry::test::tube_wall(0.04, 0.05, 0.2, 60, 20).mapped([](geometry::Vec3 v) {
        return v - geometry::Vec3{0, 0, 0.1};
    });
    const Shape plate = geometry::test::box({-0.06, -0.06, floor - 0.01}, {0.06, 0.06, floor}, 8);
    const double ceiling = shaft_radius + 1e-3;
    const Shape lid = geometry::test::box({-0.06, -0.06, ceiling}, {0.06, 0.06, ceiling + 0.01}, 8);
    const double friction[] = {0.02};
    const geometry::OrganSurface organs[] = {wall.surface("wall", friction), plate.surface("floor", friction),
                                             lid.surface("lid", friction)};
    return std::make_shared<World>(world_with(organs, path, insertion));
}

struct Watch : Observer {
    std::vector<std::uint32_t> marks;
    std::function<void(const Snapshot&)> see;
    void ticked(const Snapshot& s) override {
        if (see) see(s);
    }
    void marked(std::int64_t, std::uint32_t mark) override { marks.push_back(mark); }
};

void push(std::shared_ptr<const World> world, unsigned threads, std::int64_t ticks, double speed,
          Watch& watch) {
    test::Parts parts;
    const host::Instance rod = parts.rod();
    test::ScriptedHands hands([&](std::int64_t tick, calot_controls& c) {
        c.insertion = speed * 1e-3 * static_cast<double>(tick);
    });
    Simulation simulation({.world = std::move(world),
                           .rod = {rod.id(), rod.abi()},
                           .device = {},
                           .replay = &hands,
                           .procedure = {},
                           .threads = threads,
                           .max_force = 30}); // more folds the shaft up
    simulation.add_observer(watch);
    simulation.run({.speed = Speed::max, .max_ticks = ticks});
}

double part_along_normal(const calot_contact_report& c) {
    return -dot(vec3(c.force), vec3(c.normal)); // the force is on the other side
}
double part_across_normal(const calot_contact_report& c) {
    return norm(vec3(c.force) + part_along_normal(c) * vec3(c.normal));
}

// Of parts that are no neighbours: how near their axes come.
double nearest_axes(const Snapshot& s, std::size_t first, std::size_t apart) {
    const auto node = [&](std::size_t i) {
        return geometry::Vec3{s.position[3 * i], s.position[3 * i + 1], s.position[3 * i + 2]};
    };
    double nearest2 = 1;
    for (std::size_t i = first; 3 * i + 3 < s.position.size(); ++i)
        for (std::size_t j = first; j + apart < i; ++j)
            nearest2 =
                std::min(nearest2,
                         geometry::closest_of_segments(node(i), node(i + 1), node(j), node(j + 1)).distance2);
    return std::sqrt(nearest2);
}

} // namespace

TEST(SelfContact, a_shaft_wound_up_in_a_drum_lies_on_itself_and_does_not_pass_through) {
    Watch watch;
    double nearest = 1, strongest = 0;
    std::size_t most = 0, deep = 0;
    std::vector<double> ratios; // of the force across to that along the normal, where it presses
    std::map<std::uint64_t, int> lasted;
    watch.see = [&](const Snapshot& s) {
        std::size_t count = 0;
        for (const calot_contact_report& c : s.contacts()) {
            if (c.organ != ContactOwner::shaft) continue;
            ++count;
            ++lasted[c.id];
            if (part_along_normal(c) > 0.05) ratios.push_back(part_across_normal(c) / part_along_normal(c));
        }
        most = std::max(most, count);
        strongest = std::max(strongest, s.self_force);
        // What lies in the guide as yet is left out: about 0.6 m of the 1.03 m at first.
        if (s.tick % 20 != 0) return;
        const double axes = nearest_axes(s, 62, 5);
        nearest = std::min(nearest, axes);
        deep += axes < 2 * shaft_radius - 1e-3;
    };
    push(drum(), 1, 1000, 0.1, watch);
    EXPECT_GT(most, 10u) << "contacts of the shaft with itself at one tick";
    EXPECT_GT(strongest, 1.0) << "N, sum over the shaft";
    // As for organs: hardly ever a millimetre deep, and never half a radius.
    EXPECT_LE(deep, 2u) << "of 50 looks";
    EXPECT_GT(nearest, 1.5 * shaft_radius) << "m between axes, of 12.6 mm";
    ASSERT_GT(ratios.size(), 1000u);
    std::ranges::sort(ratios);
    // Some stick and some slip; fast turning adds the film that damps it.
    EXPECT_LT(ratios[ratios.size() / 10], 0.8 * Collision::self_friction);
    EXPECT_GT(ratios[ratios.size() * 8 / 10], 0.9 * Collision::self_friction);
    EXPECT_LT(ratios[ratios.size() * 8 / 10], 1.1 * Collision::self_friction);
    const int longest = std::ranges::max_element(lasted, {}, [](const auto& l) { return l.second; })->second;
    EXPECT_GT(longest, 300) << "ticks that a contact kept its identity";
}

TEST(SelfContact, gives_the_same_bits_on_one_and_more_threads) {
    const auto world = drum();
    Watch one, two;
    std::size_t count = 0;
    one.see = [&](const Snapshot& s) {
        for (const calot_contact_report& c : s.contacts())
            count += c.organ == ContactOwner::shaft;
    };
    push(world, 1, 300, 0.1, one);
    push(world, 2, 300, 0.1, two);
    EXPECT_GT(count, 300u) << "contacts with itself";
    ASSERT_EQ(one.marks.size(), 300u);
    EXPECT_EQ(one.marks, two.marks);
}

TEST(Collision, the_deepest_of_both_kinds_stay_when_not_all_fit) {
    const auto world = drum();
    std::vector<double> position;
    const auto& path = world->anatomy.find("path")->points;
    for (std::size_t i = 0; i < 80; ++i)
        for (int k = 0; k < 3; ++k)
            position.push_back(path[4 * i][k] * (k < 2 ? 0.0337 / 0.033 : 0.95));
    const std::vector<double> radius(79, shaft_radius);
    const auto found = [&](std::size_t most) {
        Collision collision(world->surfaces, radius, most, false);
        collision.begin(position, 0.001, 0);
        return collision.finish();
    };
    const ContactList all = found(1000), few = found(40);
    EXPECT_EQ(all.left_out, 0u);
    ASSERT_GT(all.count, 100u);
    ASSERT_EQ(few.count, 40u);
    EXPECT_EQ(few.left_out, all.count - 40);
    std::vector<double> gaps, kept;
    std::set<std::uint32_t> owners;
    for (const calot_contact& c : all.all())
        gaps.push_back(c.gap);
    for (std::size_t i = 0; i < few.count; ++i) {
        kept.push_back(few.contact[i].gap);
        owners.insert(few.owner[i].organ);
        EXPECT_EQ(few.owner[i].organ == ContactOwner::shaft, few.contact[i].flags == CALOT_CONTACT_SELF);
    }
    std::ranges::sort(gaps), std::ranges::sort(kept);
    gaps.resize(40);
    EXPECT_EQ(kept, gaps);
    EXPECT_TRUE(owners.contains(ContactOwner::shaft) && owners.size() > 1) << "both kinds are among them";
    EXPECT_EQ(few.deepest, all.deepest) << "health is told of all that was found";
    EXPECT_EQ(few.deepest_self, all.deepest_self);
}

TEST(Friction, of_a_region_times_the_factor_of_a_segment_is_what_a_sliding_shaft_feels) {
    // A tube of 10 mm inside that turns by a right angle; its second half is three times as rough.
    constexpr double straight = 0.1, bend = 0.08, smooth = 0.06, rough = 0.18, factor = 0.5;
    const auto bent = [&](geometry::Vec3 v) -> geometry::Vec3 {
        if (v.z <= straight) return v;
        const double angle = std::min((v.z - straight) / bend, pi / 2);
        const double rest = v.z - straight - bend * angle, out = bend - v.x;
        return {bend - out * std::cos(angle) + rest * std::sin(angle), v.y,
                straight + out * std::sin(angle) + rest * std::cos(angle)};
    };
    const Shape line = geometry::test::tube_wall(0.010, 0.014, 0.5, 32, 120);
    Shape tube = line.mapped(bent);
    for (std::size_t t = 0; t < line.triangle_count(); ++t)
        tube.regions.push_back(line.corner(t, 0).z > straight + bend * pi / 4 ? 1 : 0);
    const double friction[] = {smooth, rough};
    const geometry::OrganSurface organs[] = {tube.surface("tube", friction)};
    std::vector<geometry::Vec3> path;
    for (int i = 0; i <= 100; ++i)
        path.push_back(bent({0, 0, 0.45 * i / 100}));
    World world = world_with(organs, path, 0.3);
    for (ShaftSegment& segment : world.endoscope.segments)
        if (segment.bends) segment.friction_factor = factor;
    const Endoscope endoscope(world.endoscope, 100);

    std::map<std::pair<std::uint32_t, bool>, std::vector<double>>
        ratios; // by region, in the bending section?
    Watch watch;
    watch.see = [&](const Snapshot& s) {
        if (s.tick < 500) return; // until everything slides
        for (const calot_contact_report& c : s.contacts())
            if (part_along_normal(c) > 0.05)
                ratios[{c.region, c.segment >= endoscope.first_bending_segment()}].push_back(
                    part_across_normal(c) / part_along_normal(c));
    };
    push(std::make_shared<World>(world), 1, 1500, 0.08, watch);
    for (const std::uint32_t region : {0u, 1u})
        for (const bool bends : {false, true}) {
            if (region == 0 && bends) continue; // it has passed the smooth half
            std::vector<double>& found = ratios[{region, bends}];
            ASSERT_GT(found.size(), 200u) << "region " << region << ", bending section " << bends;
            std::ranges::nth_element(found, found.begin() + found.size() / 2);
            const double expected = (region == 0 ? smooth : rough) * (bends ? factor : 1);
            // The film that damps turning adds a little, whatever the coefficient.
            EXPECT_NEAR(found[found.size() / 2], expected, 0.1 * expected)
                << "median over " << found.size() << " contacts of region " << region << ", bending section "
                << bends;
        }
}

} // namespace calot::simulation
