// The rod against closed forms and shooting solutions computed here.
#include "cosserat_rod.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace calot::rod_cosserat {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double EI = 0.033, GJ = 0.44, rhoA = 0.2, L = 1.0;
const Quat along_x{std::sqrt(0.5), 0, std::sqrt(0.5), 0}; // third axis to +x, second stays +y

struct Rod {
    std::vector<double> mass, radius, ei, gj, bending_damping, torsion_damping, drag, friction;
    RodDescription description;

    explicit Rod(int nodes, double length = L, double damping = 0.0, double flexural = EI) {
        const auto m = static_cast<std::size_t>(nodes - 1);
        mass.assign(m, rhoA), radius.assign(m, 0.0063), ei.assign(m, flexural), gj.assign(m, GJ);
        bending_damping.assign(m, 0.0), torsion_damping.assign(m, 0.0), drag.assign(m, damping * rhoA),
            friction.assign(m, 1.0);
        description.nodes = nodes;
        description.length.assign(m, length / static_cast<double>(m));
        description.rest_darboux.assign(3 * m, 0.0);
        for (int i = 0; i < nodes; ++i)
            description.position.insert(description.position.end(), {length * i / (nodes - 1), 0, 0});
        for (std::size_t j = 0; j < m; ++j)
            description.frame.insert(description.frame.end(), {along_x.w, along_x.x, along_x.y, along_x.z});
        description.max_contacts = 256;
    }
    CosseratRod make() {
        description.properties = {mass, radius, ei, ei, gj, bending_damping, torsion_damping, drag, friction};
        return CosseratRod(description);
    }
};

// Twice the lowest mode's angular frequency: close to critical, whatever the length.
double settling_damping(double length, double flexural = EI) {
    return 2.0 * 3.516 * std::sqrt(flexural / rhoA) / (length * length);
}

RodStep clamped(Quat orientation = along_x) {
    RodStep in;
    in.base.mode = RodEndMode::clamped;
    in.base.orientation = orientation;
    return in;
}

void run(CosseratRod& rod, const RodStep& in, int ticks) {
    for (int k = 0; k < ticks; ++k)
        ASSERT_TRUE(rod.step(in)) << "at tick " << k;
}

struct Shape {
    double drop, shortening;
};

// Clamped horizontal rod under a dead tip load (alpha = P L^2 / EI) and its own weight (beta = w L^3 / EI),
// of unit length: theta'' = -(alpha + beta (1 - s)) cos theta, theta(0) = 0, theta'(1) = 0, theta positive
// downwards. Runge-Kutta of fourth order from the tip, whose angle is found by bisection.
Shape shoot(double alpha, double beta) {
    const int steps = 4000;
    Shape shape{};
    const auto clamp_angle = [&](double tip) {
        double a = tip, k = 0.0, x = 0.0, y = 0.0, s = 1.0;
        const double h = -1.0 / steps;
        const auto slope = [&](double s, double a, double k) {
            return std::array{k, -(alpha + beta * (1.0 - s)) * std::cos(a), std::cos(a), std::sin(a)};
        };
        for (int i = 0; i < steps; ++i, s += h) {
            const auto f1 = slope(s, a, k), f2 = slope(s + h / 2, a + h / 2 * f1[0], k + h / 2 * f1[1]);
            const auto f3 = slope(s + h / 2, a + h / 2 * f2[0], k + h / 2 * f2[1]),
                       f4 = slope(s + h, a + h * f3[0], k + h * f3[1]);
            a += h / 6 * (f1[0] + 2 * f2[0] + 2 * f3[0] + f4[0]);
            k += h / 6 * (f1[1] + 2 * f2[1] + 2 * f3[1] + f4[1]);
            x += h / 6 * (f1[2] + 2 * f2[2] + 2 * f3[2] + f4[2]);
            y += h / 6 * (f1[3] + 2 * f2[3] + 2 * f3[3] + f4[3]);
        }
        shape = {-y, 1.0 + x};
        return a;
    };
    double low = 0.0, high = pi / 2;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (clamp_angle(middle) > 0.0 ? high : low) = middle;
    }
    return shape;
}

TEST(CosseratRod, the_shooting_solution_agrees_with_mattiasson) {
    // K. Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145: table 1.
    EXPECT_NEAR(shoot(1, 0).drop, 0.30172, 5e-6);
    EXPECT_NEAR(shoot(10, 0).drop, 0.81061, 5e-6);
    EXPECT_NEAR(shoot(10, 0).shortening, 0.55500, 5e-6);
}

TEST(CosseratRod, a_straight_rod_without_load_stays_where_it_is) {
    CosseratRod rod = Rod(100).make();
    rod.reset({0.1, 0.2, 0.3}, along_x);
    std::vector<Vec3> start;
    for (int i = 0; i < rod.nodes(); ++i)
        start.push_back(rod.position(i));
    run(rod, {}, 1000);
    for (int i = 0; i < rod.nodes(); ++i)
        EXPECT_LT(norm(rod.position(i) - start[i]), 1e-9 * L) << "node " << i;
}

TEST(CosseratRod, a_rod_curved_and_twisted_by_nature_stays_where_it_is) {
    Rod spec(60);
    for (std::size_t j = 0; j < spec.description.rest_darboux.size(); j += 3)
        store(Vec3{12.0, -3.0, 5.0}, &spec.description.rest_darboux[j]);
    CosseratRod rod = spec.make();
    rod.reset({}, along_x);
    std::vector<Vec3> start;
    for (int i = 0; i < rod.nodes(); ++i)
        start.push_back(rod.position(i));
    RodStep in = clamped();
    run(rod, in, 1000);
    for (int i = 0; i < rod.nodes(); ++i)
        EXPECT_LT(norm(rod.position(i) - start[i]), 1e-9 * L) << "node " << i;
}

TEST(CosseratRod, a_cantilever_bends_as_the_elastica_for_a_small_load) {
    Rod spec(50, L, settling_damping(L));
    CosseratRod rod = spec.make();
    rod.reset({}, along_x);
    RodStep in = clamped();
    in.tip.mode = RodEndMode::loaded;
    in.tip.force = {0, 0.2 * EI / (L * L), 0};
    run(rod, in, 8000);
    const double expected = shoot(0.2, 0).drop, got = rod.position(49).y;
    EXPECT_NEAR(got, expected, 0.005 * expected) << "error " << got / expected - 1;
}

TEST(CosseratRod, an_elastica_bends_as_shooting_says) {
    for (double alpha : {1.0, 10.0}) {
        Rod spec(100, L, settling_damping(L) * (alpha > 5 ? 2 : 1));
        CosseratRod rod = spec.make();
        rod.reset({}, along_x);
        RodStep in = clamped();
        in.tip.mode = RodEndMode::loaded;
        in.tip.force = {0, alpha * EI / (L * L), 0};
        run(rod, in, 8000);
        const Shape expected = shoot(alpha, 0);
        const Vec3 tip = rod.position(99);
        EXPECT_NEAR(tip.y, expected.drop, 0.005 * expected.drop) << "alpha " << alpha;
        EXPECT_NEAR(1 - tip.x, expected.shortening, 0.005 * expected.shortening) << "alpha " << alpha;
    }
}

TEST(CosseratRod, a_heavy_rod_hangs_as_shooting_says) {
    Rod spec(60, L, settling_damping(L));
    CosseratRod rod = spec.make();
    rod.reset({}, along_x);
    RodStep in = clamped();
    in.gravity = {0, 5 * EI / (L * L * L) / rhoA, 0};
    run(rod, in, 8000);
    const Shape expected = shoot(0, 5);
    EXPECT_NEAR(rod.position(59).y, expected.drop, 0.005 * expected.drop);
    EXPECT_NEAR(1 - rod.position(59).x, expected.shortening, 0.005 * expected.shortening);
    // Statics of the whole: the clamp carries the weight, and its moment about the base.
    const double weight = rhoA * L * in.gravity.y;
    EXPECT_NEAR(rod.base_force().y, -weight, 1e-4 * weight);
    double moment = 0.0;
    for (int i = 0; i < 60; ++i)
        moment += (i == 0 || i == 59 ? 0.5 : 1.0) / 59 * weight * rod.position(i).x;
    EXPECT_NEAR(rod.base_torque().z, -moment, 1e-4 * moment);
}

TEST(CosseratRod, an_end_moment_bends_it_into_a_circle) {
    Rod spec(100, L, settling_damping(L));
    CosseratRod rod = spec.make();
    rod.reset({}, along_x);
    RodStep in = clamped();
    in.tip.mode = RodEndMode::loaded;
    in.tip.torque = {0, 0, 2 * pi * EI / L};
    run(rod, in, 8000);
    EXPECT_LT(norm(rod.position(99) - rod.position(0)), 0.01 * L);
}

TEST(CosseratRod, an_end_torque_twists_it_by_length_over_stiffness) {
    Rod spec(20, L, 50.0);
    CosseratRod rod = spec.make();
    rod.reset({}, {});
    RodStep in = clamped({});
    in.tip.mode = RodEndMode::loaded;
    in.tip.torque = {0, 0, 0.2};
    run(rod, in, 1000);
    const Quat q = rod.tip_frame();
    const double got = 2 * std::atan2(q.z, q.w), expected = 0.2 * L / GJ;
    EXPECT_NEAR(got, expected, 0.005 * expected);
    EXPECT_NEAR(rod.base_torque().z, -0.2, 1e-6);
}

TEST(CosseratRod, turning_the_whole_scene_turns_the_result) {
    const Quat turn = normalized(Quat{0.3, -0.5, 0.7, 0.2});
    const auto swing = [&](Quat scene) {
        CosseratRod rod = Rod(40, L, 1.0).make();
        rod.reset({}, scene * along_x);
        RodStep in = clamped(scene * along_x);
        in.gravity = rotate(scene, {0, 9.81, 0});
        in.tip.mode = RodEndMode::loaded;
        in.tip.torque = rotate(scene, {0.05, 0.02, 0.03});
        for (int k = 0; k < 300; ++k)
            EXPECT_TRUE(rod.step(in));
        return rod;
    };
    const CosseratRod plain = swing({}), turned = swing(turn);
    EXPECT_GT(plain.position(39).y, 0.1) << "the comparison needs a large motion";
    for (int i = 0; i < 40; ++i)
        EXPECT_LT(norm(turned.position(i) - rotate(turn, plain.position(i))), 1e-9 * L) << "node " << i;
}

TEST(CosseratRod, free_vibration_gains_no_energy) {
    Rod spec(50);
    CosseratRod rod = spec.make();
    rod.reset({}, along_x);
    RodStep in = clamped();
    in.gravity = {0, 9.81, 0};
    ASSERT_TRUE(rod.step(in));
    const double start = rod.energies().total();
    double swing = 0.0, highest = start;
    for (int k = 0; k < 3000; ++k) {
        ASSERT_TRUE(rod.step(in));
        swing = std::max(swing, rod.energies().kinetic);
        highest = std::max(highest, rod.energies().total());
    }
    EXPECT_GT(swing, 0.1);
    EXPECT_LT(highest - start, 1e-6 * swing);
    EXPECT_LT(std::fabs(rod.arc_length() - L), 1e-6 * L);
}

TEST(CosseratRod, a_taut_light_rod_swings_as_a_string_in_shorter_substeps) {
    // 500 N on 50 g: by tension the grid's stiffest mode is beyond what substeps chosen for bending bear.
    constexpr double tension = 500, mass = 0.05, height = 1e-3;
    Rod spec(100, L, 0.0, 1e-3);
    spec.mass.assign(99, mass);
    for (int i = 0; i < 100; ++i)
        spec.description.position[3 * i + 1] = height * std::sin(pi / 2 * i / 99);
    CosseratRod rod = spec.make();
    RodStep in = clamped();
    in.tip.mode = RodEndMode::loaded;
    in.tip.force = {tension, 0, 0};
    ASSERT_TRUE(rod.step(in));
    const int slack = rod.substeps();
    // A string held at one end and drawn along a line at the other: a quarter of a wave.
    const double half_period = 2.0 * L / std::sqrt(tension / mass);
    run(rod, in, static_cast<int>(std::lround(half_period / in.dt)) - 1);
    EXPECT_GT(rod.substeps(), slack);
    EXPECT_NEAR(rod.position(99).y, -height, 0.02 * height);
    EXPECT_NEAR(rod.position(50).y, -height * std::sin(pi / 2 * 50 / 99), 0.02 * height);
    run(rod, in, 50 * static_cast<int>(std::lround(half_period / in.dt)));
    EXPECT_LT(rod.energies().kinetic, 0.5 * tension * (pi / 2 * height) * (pi / 2 * height) / 2);
    in.tip.force = {1, 0, 0};
    run(rod, in, 2);
    EXPECT_EQ(rod.substeps(), slack);
}

TEST(CosseratRod, bending_damping_costs_half_as_many_substeps_again_at_most) {
    int substeps[3] = {};
    double left[3] = {};
    const double damping[3] = {0.0, 2e-5, 0.02};
    for (int k = 0; k < 3; ++k) {
        Rod spec(100);
        spec.bending_damping.assign(99, damping[k]);
        CosseratRod rod = spec.make();
        rod.reset({}, along_x);
        RodStep in = clamped();
        in.gravity = {0, 9.81, 0};
        run(rod, in, 500);
        substeps[k] = rod.substeps();
        left[k] = rod.energies().total();
    }
    EXPECT_GT(substeps[1], substeps[0]);
    EXPECT_LE(substeps[2], substeps[0] * 3 / 2 + 1);
    EXPECT_LT(left[1], left[0]);
    EXPECT_LT(left[2], left[1]);
}

// A tube round the straight line from `a` on along `axis`, as contacts: the nearest wall for each segment's
// far node.
std::vector<RodContact> in_a_tube(const CosseratRod& rod, Vec3 a, Vec3 axis, double radius, double r,
                                  double friction) {
    std::vector<RodContact> list;
    for (int i = 1; i < rod.nodes(); ++i) {
        const Vec3 p = rod.position(i), d = p - a, off = d - dot(d, axis) * axis;
        if (dot(d, axis) < 0 || norm(off) < 1e-12) continue;
        RodContact c;
        c.segment = i - 1, c.along = 1.0, c.centre = p, c.friction = friction,
        c.id = static_cast<std::uint64_t>(i);
        c.normal = (-1.0 / norm(off)) * off;
        c.gap = radius - r - norm(off);
        list.push_back(c);
    }
    return list;
}

RodContact plane(const CosseratRod& rod, int node, Vec3 normal, double height, double r, double friction) {
    RodContact c;
    c.segment = std::max(node - 1, 0), c.along = node > 0 ? 1.0 : 0.0, c.centre = rod.position(node),
    c.friction = friction;
    c.id = static_cast<std::uint64_t>(node) + 1, c.normal = normal;
    c.gap = dot(normal, rod.position(node)) - height - r;
    return c;
}

TEST(CosseratRod, pressed_against_a_wall_it_does_not_shorten) {
    // A scope in a tube, driven by 50 N against a wall across it.
    Rod spec(100);
    spec.bending_damping.assign(99, 2e-5);
    CosseratRod rod = spec.make();
    rod.reset({-0.4, 0.001, 0}, along_x);
    RodStep in;
    in.guide = {true, {}, {1, 0, 0}};
    in.base.mode = RodEndMode::coupled;
    in.base.axial = {-0.4, 0.3, 5000, 100, 50};
    in.base.roll = {0, 0, 10, 0.1, 1};
    double worst = 0.0;
    for (int k = 0; k < 1500; ++k) {
        auto contacts = in_a_tube(rod, {}, {1, 0, 0}, 0.009, 0.0063, 0.1);
        contacts.push_back(plane(rod, 99, {-1, 0, 0}, -0.7, 0.0063, 0.1));
        contacts.back().id = 1000;
        in.contacts = contacts;
        ASSERT_TRUE(rod.step(in));
        in.base.axial.target = std::min(in.base.axial.target + 0.3e-3, 0.5);
        worst = std::max(worst, L - rod.arc_length());
    }
    EXPECT_NEAR(norm(rod.base_force()), 50, 1e-6);
    EXPECT_LT(worst, 1e-5 * L);
    EXPECT_NEAR(rod.position(99).x, 0.7 - 0.0063, 1e-6);
}

TEST(CosseratRod, the_base_carries_weight_and_contact_forces_at_rest) {
    Rod spec(60, 0.5, 10.0);
    CosseratRod rod = spec.make();
    rod.reset({}, along_x);
    RodStep in = clamped();
    in.gravity = {0, 9.81, 0};
    Vec3 contact{};
    for (int k = 0; k < 3000; ++k) {
        std::vector<RodContact> contacts{plane(rod, 59, {0, -1, 0}, -0.05, 0.0063, 0.3)};
        in.contacts = contacts;
        ASSERT_TRUE(rod.step(in));
        contact = (1 / in.dt) * rod.contact_impulses()[0];
    }
    const double weight = rhoA * 0.5 * 9.81;
    EXPECT_LT(contact.y, -0.1 * weight) << "the floor must carry something";
    EXPECT_LT(norm(rod.base_force() + contact + Vec3{0, weight, 0}), 0.01 * weight);
}

TEST(CosseratRod, friction_holds_below_the_coulomb_limit_and_slides_above) {
    for (double slope : {0.2, 0.4}) {
        Rod spec(20, 0.2, 0.0);
        CosseratRod rod = spec.make();
        rod.reset({0, 0, 0}, along_x);
        RodStep in;
        in.gravity = {9.81 * slope, 9.81, 0}; // the floor at y = r, its friction 0.3
        for (int k = 0; k < 1000; ++k) {
            std::vector<RodContact> contacts;
            for (int i = 0; i < 20; ++i)
                contacts.push_back(plane(rod, i, {0, -1, 0}, -0.0063, 0.0063, 0.3));
            in.contacts = contacts;
            ASSERT_TRUE(rod.step(in));
        }
        const double slid = rod.position(0).x, free = 0.5 * 9.81 * (slope - 0.3);
        if (slope < 0.3)
            EXPECT_LT(std::fabs(slid), 1e-6);
        else
            EXPECT_NEAR(slid, free, 0.02 * free);
    }
}

TEST(CosseratRod, a_rod_rolling_against_a_wall_feels_a_torque) {
    Rod spec(20, 0.2, 0.0);
    CosseratRod rod = spec.make();
    rod.reset({-0.1, 0, 0}, along_x);
    RodStep in;
    in.gravity = {0, 9.81, 0};
    in.guide = {true, {}, {1, 0, 0}};
    in.base.mode = RodEndMode::coupled;
    in.base.axial = {-0.1, 0, 5000, 100, 50};
    in.base.roll = {0, 2 * pi, 10, 0.1, 1};
    double torque = 0.0, normal = 0.0;
    for (int k = 0; k < 500; ++k) {
        std::vector<RodContact> contacts;
        for (int i = 12; i < 20; ++i)
            contacts.push_back(plane(rod, i, {0, -1, 0}, -0.0063, 0.0063, 0.3));
        in.contacts = contacts;
        ASSERT_TRUE(rod.step(in));
        in.base.roll.target += 2 * pi * in.dt;
        if (k < 400) continue;
        torque += rod.base_torque().x / 100;
        for (const Vec3& j : rod.contact_impulses())
            normal += -j.y / in.dt / 100;
    }
    EXPECT_GT(normal, 0.05);
    EXPECT_NEAR(torque, 0.3 * 0.0063 * normal, 0.05 * 0.3 * 0.0063 * normal);
    EXPECT_NEAR(rod.base_roll(), 2 * pi * 0.5, 0.1);
}

TEST(CosseratRod, device_limits_against_contacts_stay_finite_and_bounded) {
    Rod spec(100);
    spec.torsion_damping.assign(99, 0.02);
    CosseratRod rod = spec.make();
    rod.reset({-0.6, 0.002, 0.001}, along_x);
    RodStep in;
    in.gravity = {0, 9.81, 0};
    in.guide = {true, {}, {1, 0, 0}};
    in.base.mode = RodEndMode::coupled;
    in.base.axial = {-0.6, 0, 10000, 200, 50};
    in.base.roll = {0, 0, 50, 1, 1};
    std::vector<double> rest(3 * 99, 0.0);
    double most_twist = 0.0;
    for (int k = 0; k < 6000; ++k) {
        const double push = (k / 700) % 2 == 0 ? 0.3 : -0.3, turn = (k / 500) % 2 == 0 ? 2 * pi : -2 * pi;
        in.base.axial.velocity = push, in.base.roll.velocity = turn;
        for (int j = 90; j < 99; ++j)
            rest[3 * j] = 40 * std::sin(0.004 * k);
        in.rest_darboux = rest;
        auto contacts = in_a_tube(rod, {}, {1, 0, 0}, 0.012, 0.0063, 0.3);
        contacts.push_back(plane(rod, 99, {-1, 0, 0}, -0.45, 0.0063, 0.3));
        contacts.back().id = 1000;
        in.contacts = contacts;
        ASSERT_TRUE(rod.step(in)) << "at tick " << k;
        in.base.axial.target += push * in.dt, in.base.roll.target += turn * in.dt;
        for (int i = 0; i < 100; ++i) {
            const Vec3 p = rod.position(i);
            ASSERT_LT(std::hypot(p.y, p.z), 0.012 - 0.0063 + 0.00315) << "node " << i << " at tick " << k;
        }
        ASSERT_LT(rod.energies().kinetic, 0.5) << "at tick " << k;
        most_twist = std::max(most_twist, rod.energies().twist);
    }
    // Hands and walls twist it with 1 N m or so each: 4.5 J of it at 2 N m all along.
    EXPECT_LT(most_twist, 2.0 * L / GJ);
    EXPECT_LT(std::fabs(rod.arc_length() - L), 0.001 * L);
}

TEST(CosseratRod, a_step_that_overflows_leaves_it_where_it_was_and_at_rest) {
    CosseratRod rod = Rod(20).make();
    RodStep in = clamped();
    in.gravity = {0, 9.81, 0};
    run(rod, in, 10);
    const Vec3 tip = rod.position(19);
    ASSERT_GT(norm(rod.velocity(19)), 0.0);
    in.gravity.y = std::nan("");
    EXPECT_FALSE(rod.step(in));
    EXPECT_EQ(rod.position(19), tip);
    EXPECT_EQ(rod.velocity(19), Vec3{});
}

TEST(CosseratRod, a_saved_state_resumes_to_the_same_bits) {
    const auto scene = [](CosseratRod& rod, RodStep& in, std::vector<RodContact>& contacts) {
        contacts = in_a_tube(rod, {}, {1, 0, 0}, 0.012, 0.0063, 0.3);
        in.contacts = contacts;
    };
    Rod spec(60, 0.6);
    spec.bending_damping.assign(59, 3e-5);
    CosseratRod first = spec.make(), second = spec.make();
    first.reset({-0.2, 0.001, 0}, along_x);
    RodStep in;
    in.gravity = {0, 9.81, 1};
    in.guide = {true, {}, {1, 0, 0}};
    in.base.mode = RodEndMode::coupled;
    in.base.axial = {-0.2, 0.1, 5000, 100, 50};
    in.base.roll = {0, 1, 10, 0.1, 1};
    std::vector<RodContact> contacts;
    for (int k = 0; k < 200; ++k)
        scene(first, in, contacts), first.step(in);
    std::vector<double> a(first.state_size()), b(first.state_size());
    first.save(a);
    ASSERT_TRUE(second.load(a));
    for (int k = 0; k < 200; ++k) {
        scene(first, in, contacts), first.step(in);
        scene(second, in, contacts), second.step(in);
    }
    first.save(a), second.save(b);
    EXPECT_EQ(a, b);
    a[3] = std::nan("");
    EXPECT_FALSE(second.load(a));
    a.pop_back();
    EXPECT_FALSE(second.load(a));
}

} // namespace
} // namespace calot::rod_cosserat
