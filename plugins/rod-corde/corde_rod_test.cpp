// The model against closed forms.
#include "corde_rod.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace calot::rod_corde {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double L = 0.5, EI = 0.03, GJ = 0.1, rhoA = 0.2, R = 6e-3;
const Quat along_x{std::sqrt(0.5), 0, std::sqrt(0.5), 0};

RodDescription straight(int nodes, double drag = 0) {
    RodDescription d;
    d.nodes = nodes;
    const auto m = static_cast<std::size_t>(nodes - 1);
    const double l = L / static_cast<double>(m);
    for (int i = 0; i < nodes; ++i)
        d.position.insert(d.position.end(), {i * l, 0, 0});
    for (std::size_t j = 0; j < m; ++j)
        d.frame.insert(d.frame.end(), {along_x.w, along_x.x, along_x.y, along_x.z});
    const auto each = [&](double v) { return std::vector<double>(m, v); };
    d.length = each(l);
    d.rest_darboux.assign(3 * m, 0.0);
    d.properties = {each(rhoA), each(R), each(EI),          each(EI), each(GJ),
                    each(0),    each(0), each(drag * rhoA), each(1)};
    d.max_contacts = nodes;
    return d;
}

calot_rod_input quiet() {
    calot_rod_input in{};
    in.struct_size = sizeof in;
    in.base.pose.quaternion[0] = in.tip.pose.quaternion[0] = 1;
    return in;
}
calot_rod_input clamped() {
    calot_rod_input in = quiet();
    in.base.mode = CALOT_END_CLAMPED;
    in.base.pose = pose({}, along_x);
    return in;
}
calot_rod_input loaded(const Vec3& force, const Vec3& torque) {
    calot_rod_input in = clamped();
    in.tip.mode = CALOT_END_LOADED;
    store(force, in.tip.wrench.force), store(torque, in.tip.wrench.torque);
    return in;
}
void run(CordeRod& rod, const calot_rod_input& in, double seconds) {
    for (int k = 0; k < seconds * 1e3; ++k)
        rod.step(in);
}
// 1/s, critical for the lowest mode of the clamped rod.
double settling() {
    return 2 * 3.516 * std::sqrt(EI / rhoA) / (L * L);
}
rod_corde::Settings stretchy(double modulus) {
    rod_corde::Settings s;
    s.stretch_modulus = modulus;
    return s;
}

TEST(CordeRod, stays_where_it_is_without_load) {
    CordeRod rod(straight(40), rod_corde::Settings{});
    run(rod, quiet(), 1);
    for (int i = 0; i < rod.nodes(); ++i)
        EXPECT_LT(norm(rod.position(i) - Vec3{L * i / (rod.nodes() - 1), 0, 0}), 1e-10 * L) << "node " << i;
}

TEST(CordeRod, stretches_by_the_load_over_the_stretch_stiffness) {
    // E_s = 20 MPa, of CoRdE's order.
    CordeRod rod(straight(20, 100), stretchy(20e6));
    const double stiffness = 20e6 * pi * R * R, load = 10;
    EXPECT_NEAR(rod.stretch_stiffness(3), stiffness, 1e-9 * stiffness);
    run(rod, loaded({load, 0, 0}, {}), 2);
    const double expected = L * load / stiffness, got = rod.position(19).x - L;
    EXPECT_NEAR(got, expected, 1e-3 * expected) << "error " << got / expected - 1;
}

TEST(CordeRod, shortens_as_much_under_a_push) {
    // Below Euler's load, pi^2 EI / (4 L^2) = 0.3 N.
    CordeRod rod(straight(20, 100), stretchy(1e6));
    run(rod, loaded({-0.1, 0, 0}, {}), 2);
    const double expected = -L * 0.1 / (1e6 * pi * R * R), got = rod.position(19).x - L;
    EXPECT_NEAR(got, expected, 2e-3 * std::abs(expected)) << "error " << got / expected - 1;
}

TEST(CordeRod, a_higher_modulus_needs_more_substeps_and_stays_stable) {
    CordeRod soft(straight(40), rod_corde::Settings{}), hard(straight(40), stretchy(5e9));
    EXPECT_GT(hard.substeps(), 2 * soft.substeps());
    run(hard, loaded({0, 0.02, 0}, {0.01, 0, 0}), 0.3);
    ASSERT_TRUE(hard.is_finite());
    EXPECT_NEAR(hard.arc_length(), L, 1e-6 * L);
}

TEST(CordeRod, bends_as_a_beam_under_a_small_load) {
    CordeRod rod(straight(60, settling()), rod_corde::Settings{});
    const double load = 0.01 * EI / (L * L);
    run(rod, loaded({0, load, 0}, {}), 6);
    const double expected = load * L * L * L / (3 * EI), got = rod.position(59).y;
    EXPECT_NEAR(got, expected, 2e-3 * expected) << "error " << got / expected - 1;
    const Vec3 held = rod.base_force(), moment = rod.base_torque();
    EXPECT_NEAR(held.y, -load, 1e-4 * load);
    EXPECT_NEAR(moment.z, -load * L, 1e-3 * load * L);
}

TEST(CordeRod, an_end_torque_twists_it_by_TL_over_GJ) {
    const double torque = 0.3 * GJ / L;
    CordeRod rod(straight(20, 500), rod_corde::Settings{});
    run(rod, loaded({}, {torque, 0, 0}), 1);
    // From the clamp to the last segment's middle.
    const Quat p = short_turn(along_x, rod.frame(18));
    const double expected = torque / GJ * (L - 0.5 * L / 19), got = 2 * std::atan2(p.z, p.w);
    EXPECT_NEAR(got, expected, 1e-3 * expected) << "error " << got / expected - 1;
}

TEST(CordeRod, swings_at_the_beams_lowest_frequency) {
    CordeRod rod(straight(40, settling()), rod_corde::Settings{});
    // Let go from rest in a small bend; the period is the time between two downward passages.
    run(rod, loaded({0, 0.02 * EI / (L * L), 0}, {}), 6);
    rod.set_properties(straight(40).properties);
    calot_rod_input in = clamped();
    double first = 0, last = 0, before = rod.position(39).y;
    int count = 0;
    for (int k = 1; k < 6000; ++k) {
        rod.step(in);
        const double now = rod.position(39).y;
        if (before > 0 && now <= 0) {
            last = 1e-3 * (k - now / (now - before));
            if (count++ == 0) first = last;
        }
        before = now;
    }
    ASSERT_GT(count, 3);
    const double expected = 2 * pi * L * L / 3.516 / std::sqrt(EI / rhoA), got = (last - first) / (count - 1);
    EXPECT_NEAR(got, expected, 0.02 * expected) << "error " << got / expected - 1;
}

TEST(CordeRod, keeps_momentum_and_loses_no_energy_to_its_penalties) {
    CordeRod rod(straight(30), rod_corde::Settings{0, 0, 0, 0.2});
    // A kick at one end, then nothing acts.
    calot_rod_input in = quiet();
    in.tip.mode = CALOT_END_LOADED;
    store(Vec3{0.02, 0.1, 0.05}, in.tip.wrench.force);
    run(rod, in, 0.02);
    const auto momentum = [&] {
        Vec3 p;
        for (int i = 0; i < rod.nodes(); ++i)
            p += (rhoA * L / (rod.nodes() - 1) * (i == 0 || i == rod.nodes() - 1 ? 0.5 : 1.0)) *
                 rod.velocity(i);
        return p;
    };
    const Vec3 expected = 0.02 * Vec3{0.02, 0.1, 0.05};
    EXPECT_LT(norm(momentum() - expected), 1e-12);
    const auto total = [](const RodEnergies& e) { return e.kinetic + e.bending + e.twist; };
    const double start = total(rod.energies());
    run(rod, quiet(), 0.5);
    EXPECT_LT(norm(momentum() - expected), 1e-12);
    const double end = total(rod.energies());
    EXPECT_LT(end, start * (1 + 1e-3));
    EXPECT_GT(end, 0.9 * start);
}

// A rod lying on a floor across its whole length, pressed by its weight.
struct OnFloor {
    CordeRod rod;
    double friction;
    std::vector<calot_contact> list;

    explicit OnFloor(double friction) : rod(straight(10), rod_corde::Settings{}), friction(friction) {}
    void step(const Vec3& gravity) {
        list.clear();
        for (int i = 1; i < rod.nodes(); ++i) {
            calot_contact c{};
            c.id = static_cast<std::uint64_t>(i), c.segment = static_cast<std::uint32_t>(i - 1), c.t = 1;
            const Vec3 p = rod.position(i);
            store(p, c.axis_point), store(Vec3{p.x, p.y, -R}, c.point),
                store(Vec3{p.x, p.y, -R}, c.free_position);
            store(Vec3{0, 0, 1}, c.normal);
            c.gap = p.z, c.friction = friction;
            list.push_back(c);
        }
        calot_rod_input in = quiet();
        store(gravity, in.gravity);
        in.contacts = {list.data(), list.size(), sizeof(calot_contact)};
        // The base has no contact of its own: held up by a force.
        in.base.mode = CALOT_END_LOADED;
        store(-(0.5 * rhoA * L / 9) * gravity, in.base.wrench.force);
        rod.step(in);
    }
};

TEST(CordeRod, rests_on_a_slope_below_the_angle_of_friction_and_slides_above) {
    for (const double slope : {0.25, 0.35}) {
        OnFloor scene(0.3);
        const Vec3 gravity{9.81 * std::sin(slope), 0, -9.81 * std::cos(slope)};
        for (int k = 0; k < 500; ++k)
            scene.step(gravity);
        const double moved = scene.rod.position(5).x - 5 * L / 9, speed = scene.rod.velocity(5).x;
        if (std::tan(slope) < 0.3) {
            EXPECT_LT(moved, 1e-4) << "slope " << slope;
            EXPECT_LT(std::abs(speed), 1e-3) << "slope " << slope;
        } else {
            // Eight and a half of nine parts of the weight slide against friction; the base's half part is
            // carried.
            const double expected = 0.5 * 9.81 * (std::sin(slope) - 0.3 * std::cos(slope)) * 8.5 / 9;
            EXPECT_NEAR(speed, expected, 0.1 * expected) << "slope " << slope;
        }
        EXPECT_NEAR(scene.rod.position(5).z, 0, 1e-4);
        double carried = 0;
        for (const Vec3& i : scene.rod.contact_impulses())
            carried += i.z / 1e-3;
        const double weight = rhoA * L * 8.5 / 9 * 9.81 * std::cos(slope);
        EXPECT_NEAR(carried, weight, 0.02 * weight) << "slope " << slope;
    }
}

TEST(CordeRod, gives_in_with_the_other_sides_compliance) {
    CordeRod rod(straight(10, settling()), rod_corde::Settings{});
    // One contact in the middle of a clamped rod, pressed by gravity against a surface of 1 mm/N.
    calot_rod_input in = clamped();
    in.gravity[2] = -9.81;
    std::vector<calot_contact> list(1);
    double force = 0, depth = 0;
    for (int k = 0; k < 3000; ++k) {
        calot_contact& c = list[0];
        c = {};
        c.id = 7, c.segment = 8, c.t = 1;
        const Vec3 p = rod.position(9);
        store(p, c.axis_point), store(Vec3{p.x, p.y, -R}, c.point),
            store(Vec3{p.x, p.y, -R}, c.free_position);
        store(Vec3{0, 0, 1}, c.normal);
        c.gap = p.z;
        for (const int i : {0, 4, 8})
            c.compliance[i] = 1e-3 / 1e-3; // m/(N s), over a step of 1 ms
        in.contacts = {list.data(), 1, sizeof(calot_contact)};
        rod.step(in);
        force = rod.contact_impulses()[0].z / 1e-3, depth = -rod.position(9).z;
    }
    EXPECT_GT(force, 0.1);
    EXPECT_NEAR(depth, 1e-3 * force, 0.03e-3 * force + 1e-6);
}

TEST(CordeRod, resumes_to_the_same_bits) {
    CordeRod first(straight(30), rod_corde::Settings{}), second(straight(30), rod_corde::Settings{});
    const calot_rod_input in = loaded({0, 0.1, 0.02}, {0.01, 0, 0});
    run(first, in, 0.05);
    std::vector<double> state(first.state_size()), after(first.state_size());
    first.save(state);
    ASSERT_TRUE(second.load(state));
    run(first, in, 0.05), run(second, in, 0.05);
    first.save(state), second.save(after);
    EXPECT_EQ(state, after);
    state.back() = 0, state[state.size() - 7] = 0.5; // half a contact's id
    EXPECT_FALSE(second.load(state));
}

} // namespace
} // namespace calot::rod_corde
