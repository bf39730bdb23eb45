// The rod against closed forms, and what a step must keep whatever it is given.
#include "direct_rod.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace calot::rod_direct {
namespace {

const Quat along_x{0.70710678118654752, 0, 0.70710678118654752, 0};

struct Uniform {
    int nodes = 41;
    double length = 0.4, mass = 0.2, radius = 6e-3, bending = 0.03, torsion = 0.04, drag = 0;
};

DirectRod straight(const Uniform& u, int contacts = 8) {
    const auto m = static_cast<std::size_t>(u.nodes) - 1;
    const auto each = [&](double v) { return std::vector<double>(m, v); };
    RodDescription d;
    d.nodes = u.nodes;
    d.length = each(u.length / static_cast<double>(m));
    d.rest_darboux.assign(3 * m, 0.0);
    d.properties = {each(u.mass), each(u.radius), each(u.bending), each(u.bending), each(u.torsion),
                    each(0),      each(0),        each(u.drag),    each(1)};
    d.max_contacts = contacts;
    for (int i = 0; i < u.nodes; ++i) {
        d.position.insert(d.position.end(), {u.length * i / (u.nodes - 1), 0, 0});
        if (i + 1 < u.nodes) d.frame.insert(d.frame.end(), {along_x.w, along_x.x, along_x.y, along_x.z});
    }
    return DirectRod(d);
}

double worst_stretch(const DirectRod& rod, double length) {
    double worst = 0;
    for (int i = 0; i + 1 < rod.nodes(); ++i)
        worst = std::max(worst, std::abs(norm(rod.position(i + 1) - rod.position(i)) / length - 1));
    return worst;
}

TEST(DirectRod, sags_as_a_linear_beam_under_a_small_tip_load) {
    Uniform u;
    u.drag = 4;
    DirectRod rod = straight(u);
    RodStep in;
    in.base.mode = RodEndMode::clamped, in.base.orientation = along_x;
    in.tip.mode = RodEndMode::loaded, in.tip.force = {0, 1e-4, 0};
    for (int k = 0; k < 4000; ++k)
        ASSERT_TRUE(rod.step(in));
    const double got = rod.position(40).y, expected = 1e-4 * std::pow(u.length, 3) / (3 * u.bending);
    EXPECT_NEAR(got / expected, 1, 2e-4) << "got " << got << ", expected " << expected;
    EXPECT_NEAR(rod.base_force().y, -1e-4, 1e-8);
    EXPECT_NEAR(rod.base_torque().z, -1e-4 * u.length, 1e-8);
}

TEST(DirectRod, does_not_stretch_when_pushed_into_a_held_tip_at_long_ticks) {
    for (double dt : {1e-3, 1e-2}) {
        Uniform u;
        DirectRod rod = straight(u);
        RodStep in;
        in.dt = dt, in.gravity = {0, 9.81, 0};
        in.base.mode = in.tip.mode = RodEndMode::clamped;
        in.base.orientation = in.tip.orientation = along_x;
        in.tip.position = {u.length, 0, 0};
        for (double t = 0; t < 2; t += dt) {
            in.base.position = {std::min(0.2, 0.2 * t), 0, 0};
            ASSERT_TRUE(rod.step(in));
            ASSERT_LT(worst_stretch(rod, u.length / 40), 1e-12) << "at " << t << " s";
        }
        EXPECT_LT(norm(rod.position(40) - in.tip.position), 1e-6) << "the tip left its clamp";
    }
}

// The last node lies on a rigid floor at the height of the clamp.
TEST(DirectRod, rests_on_a_prop_with_three_eighths_of_its_weight) {
    Uniform u;
    u.drag = 4;
    DirectRod rod = straight(u);
    RodStep in;
    in.gravity = {0, 9.81, 0};
    in.base.mode = RodEndMode::clamped, in.base.orientation = along_x;
    for (int k = 0; k < 4000; ++k) {
        RodContact c;
        c.segment = 39, c.along = 1, c.normal = {0, -1, 0};
        c.gap = -rod.position(40).y, c.centre = rod.position(40), c.id = 7;
        in.contacts = {&c, 1};
        ASSERT_TRUE(rod.step(in));
    }
    // A propped cantilever carries 3/8 w L at its prop.
    const double got = -rod.contact_impulses()[0].y / in.dt, expected = 0.375 * 9.81 * u.mass * u.length;
    EXPECT_NEAR(got / expected, 1, 5e-3) << "got " << got << ", expected " << expected;
    EXPECT_NEAR(rod.position(40).y, 0, 1e-6);
}

TEST(DirectRod, sticks_below_the_coulomb_bound_and_slides_above_it) {
    for (double pull : {0.9, 1.1}) {
        Uniform u;
        DirectRod rod = straight(u, 100);
        RodStep in;
        in.gravity = {0, 9.81, 0};
        const double weight = 9.81 * u.mass * u.length, mu = 0.3;
        in.base.mode = RodEndMode::loaded, in.base.force = {pull * mu * weight, 0, 0};
        std::vector<RodContact> floor(41);
        for (int k = 0; k < 1000; ++k) {
            for (int i = 0; i < 41; ++i) {
                RodContact& c = floor[static_cast<std::size_t>(i)];
                c = {};
                c.segment = std::max(0, i - 1), c.along = i == 0 ? 0 : 1, c.normal = {0, -1, 0};
                c.gap = -rod.position(i).y, c.centre = rod.position(i), c.friction = mu;
                c.id = static_cast<std::uint64_t>(i) + 1;
            }
            in.contacts = floor;
            ASSERT_TRUE(rod.step(in));
        }
        if (pull < 1)
            EXPECT_LT(rod.position(0).x, 1e-4) << "slid though held";
        else // x = (pull - 1) mu g t^2 / 2, t = 1 s
            EXPECT_NEAR(rod.position(0).x / (0.5 * 0.1 * mu * 9.81), 1, 0.1) << rod.position(0).x;
    }
}

TEST(DirectRod, resumes_to_the_same_bits) {
    Uniform u;
    DirectRod a = straight(u), b = straight(u);
    RodStep in;
    in.gravity = {1, 9.81, 2};
    in.base.mode = RodEndMode::clamped, in.base.orientation = along_x;
    for (int k = 0; k < 200; ++k)
        a.step(in);
    std::vector<double> state(a.state_size());
    a.save(state);
    ASSERT_TRUE(b.load(state));
    for (int k = 0; k < 200; ++k)
        a.step(in), b.step(in);
    std::vector<double> first(state.size()), second(state.size());
    a.save(first), b.save(second);
    EXPECT_EQ(first, second);
    state[5] = std::nan("");
    EXPECT_FALSE(b.load(state));
}

TEST(DirectRod, a_step_that_overflows_leaves_it_where_it_was_and_at_rest) {
    Uniform u;
    DirectRod rod = straight(u);
    RodStep in;
    in.gravity = {0, 9.81, 0};
    for (int k = 0; k < 10; ++k)
        ASSERT_TRUE(rod.step(in));
    const Vec3 tip = rod.position(40);
    ASSERT_GT(norm(rod.velocity(40)), 0.0);
    in.gravity = {std::nan(""), 0, 0};
    EXPECT_FALSE(rod.step(in));
    EXPECT_EQ(rod.position(40), tip);
    EXPECT_EQ(rod.velocity(40), Vec3{});
}

} // namespace
} // namespace calot::rod_direct
