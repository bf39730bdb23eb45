// The chain and the rod made of it against closed forms.
#include "multibody_rod.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace calot::rod_multibody {
namespace {

constexpr double L = 0.5, EI = 0.03, GJ = 0.1, rhoA = 0.2, R = 6e-3;
const Quat along_x{std::sqrt(0.5), 0, std::sqrt(0.5), 0};

TEST(Chain, solves_with_its_own_mass_matrix) {
    constexpr int n = 30;
    const std::vector<Chain::Body> bodies(n, {0.02, 0.004, 0.006});
    Chain chain(n, bodies.data());
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<double> turns;
    for (int k = 0; k < n; ++k) {
        const Quat q = normalized(Quat{1, 0.2 * normal(random), 0.2 * normal(random), 0.2 * normal(random)});
        turns.insert(turns.end(), {q.w, q.x, q.y, q.z});
    }
    const auto motions = static_cast<std::size_t>(chain.motions());
    const std::vector<double> still(motions, 0.0), nothing(6 * n, 0.0), no_joint(9 * n, 0.0),
        no_body(36 * n, 0.0);
    const double origin[3] = {0.1, 0.2, 0.3};
    chain.place(origin, turns.data(), still.data());
    // A force at the last body's origin: power is force times velocity, for any motion, by two ways.
    std::vector<double> wrench = nothing, right(motions), x(motions);
    wrench[6 * (n - 1) + 4] = 1;
    chain.residual(still.data(), wrench.data(), right.data());
    for (double& r : right)
        r = -r;
    chain.solve(no_joint.data(), no_body.data(), right.data(), x.data());
    double power = 0;
    for (std::size_t i = 0; i < motions; ++i)
        power += right[i] * x[i];
    EXPECT_NEAR(power, chain.body_change(n - 1)[4], 1e-9 * std::abs(power));
    // x^T M x = 2 T at motion x.
    chain.place(origin, turns.data(), x.data());
    EXPECT_NEAR(2 * chain.kinetic_energy(), power, 1e-6 * std::abs(power));
    EXPECT_NEAR(chain.body(n - 1).velocity[1], power, 1e-6 * std::abs(power));
}

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

calot_rod_input clamped() {
    calot_rod_input in{};
    in.struct_size = sizeof in;
    in.base.mode = CALOT_END_CLAMPED;
    in.base.pose = pose({}, along_x);
    in.tip.pose.quaternion[0] = 1;
    return in;
}
calot_rod_input loaded(const Vec3& force, const Vec3& torque) {
    calot_rod_input in = clamped();
    in.tip.mode = CALOT_END_LOADED;
    store(force, in.tip.wrench.force), store(torque, in.tip.wrench.torque);
    return in;
}
void run(MultibodyRod& rod, const calot_rod_input& in, double seconds) {
    for (int k = 0; k < seconds * 1e3; ++k)
        rod.step(in);
}
constexpr double as_the_model_likes[] = {0, 0.2};
double settling() {
    return 2 * 3.516 * std::sqrt(EI / rhoA) / (L * L);
}

TEST(MultibodyRod, bends_as_a_beam_under_a_small_load) {
    MultibodyRod rod(straight(40, settling()), as_the_model_likes);
    const double load = 0.01 * EI / (L * L);
    run(rod, loaded({0, load, 0}, {}), 4);
    const double expected = load * L * L * L / (3 * EI), got = rod.position(39).y;
    EXPECT_NEAR(got, expected, 3e-3 * expected) << "error " << got / expected - 1;
    EXPECT_NEAR(rod.base_force().y, -load, 1e-3 * load);
    EXPECT_NEAR(rod.base_torque().z, -load * L, 2e-3 * load * L);
}

TEST(MultibodyRod, an_end_torque_twists_it_by_TL_over_GJ) {
    const double torque = 0.3 * GJ / L;
    MultibodyRod rod(straight(20, 500), as_the_model_likes);
    run(rod, loaded({}, {torque, 0, 0}), 0.5);
    // From the clamp to the last segment's middle.
    const Quat p = short_turn(along_x, rod.frame(18));
    const double expected = torque / GJ * (L - 0.5 * L / 19), got = 2 * std::atan2(p.z, p.w);
    EXPECT_NEAR(got, expected, 1e-3 * expected) << "error " << got / expected - 1;
}

TEST(MultibodyRod, never_changes_its_length) {
    MultibodyRod rod(straight(30), as_the_model_likes);
    run(rod, loaded({-3, 1, 0.5}, {0.1, 0, 0.1}), 0.3);
    for (int j = 0; j < 29; ++j)
        EXPECT_NEAR(norm(rod.position(j + 1) - rod.position(j)), L / 29, 1e-12) << "segment " << j;
}

TEST(MultibodyRod, falls_freely_with_g) {
    MultibodyRod rod(straight(30), as_the_model_likes);
    calot_rod_input in = clamped();
    in.base.mode = CALOT_END_FREE;
    in.gravity[2] = -9.81;
    run(rod, in, 0.2);
    for (const int i : {0, 15, 29})
        EXPECT_NEAR(rod.velocity(i).z, -9.81 * 0.2, 1e-6) << "node " << i;
}

TEST(MultibodyRod, free_vibration_only_loses_energy) {
    MultibodyRod rod(straight(30, settling()), as_the_model_likes);
    run(rod, loaded({0, 0.5 * EI / (L * L), 0}, {}), 3);
    rod.set_properties(straight(30).properties);
    const auto total = [&] {
        const RodEnergies e = rod.energies();
        return e.kinetic + e.bending + e.twist;
    };
    const double start = total();
    double before = start, left = start;
    for (int k = 0; k < 1000; ++k) {
        rod.step(clamped());
        left = total();
        EXPECT_LT(left, before * (1 + 1e-6)) << "step " << k;
        before = left;
    }
    EXPECT_GT(left, 0.7 * start);
}

TEST(MultibodyRod, rests_on_a_slope_below_the_angle_of_friction_and_slides_above) {
    for (const double slope : {0.25, 0.35}) {
        MultibodyRod rod(straight(10), as_the_model_likes);
        std::vector<calot_contact> list;
        const Vec3 gravity{9.81 * std::sin(slope), 0, -9.81 * std::cos(slope)};
        for (int k = 0; k < 300; ++k) {
            list.clear();
            for (int j = 0; j < 9; ++j) {
                calot_contact c{};
                c.id = static_cast<std::uint64_t>(j + 1), c.segment = static_cast<std::uint32_t>(j),
                c.t = 0.5;
                const Vec3 p = 0.5 * (rod.position(j) + rod.position(j + 1));
                store(p, c.axis_point), store(Vec3{p.x, p.y, -R}, c.point),
                    store(Vec3{p.x, p.y, -R}, c.free_position);
                store(Vec3{0, 0, 1}, c.normal);
                c.gap = p.z, c.friction = 0.3;
                list.push_back(c);
            }
            calot_rod_input in = clamped();
            in.base.mode = CALOT_END_FREE;
            store(gravity, in.gravity);
            in.contacts = {list.data(), list.size(), sizeof(calot_contact)};
            rod.step(in);
        }
        const double speed = rod.velocity(5).x;
        if (std::tan(slope) < 0.3) {
            EXPECT_LT(std::abs(speed), 2e-3) << "slope " << slope;
        } else {
            const double expected = 0.3 * 9.81 * (std::sin(slope) - 0.3 * std::cos(slope));
            EXPECT_NEAR(speed, expected, 0.1 * expected) << "slope " << slope;
        }
        double carried = 0;
        for (const Vec3& i : rod.contact_impulses())
            carried += i.z / 1e-3;
        EXPECT_NEAR(carried, rhoA * L * 9.81 * std::cos(slope), 0.03) << "slope " << slope;
    }
}

TEST(MultibodyRod, resumes_to_the_same_bits) {
    MultibodyRod first(straight(20), as_the_model_likes), second(straight(20), as_the_model_likes);
    const calot_rod_input in = loaded({0, 0.1, 0.02}, {0.01, 0, 0});
    run(first, in, 0.05);
    std::vector<double> state(first.state_size()), after(first.state_size());
    first.save(state);
    ASSERT_TRUE(second.load(state));
    run(first, in, 0.05), run(second, in, 0.05);
    first.save(state), second.save(after);
    EXPECT_EQ(state, after);
    state.pop_back();
    EXPECT_FALSE(second.load(state));
}

} // namespace
} // namespace calot::rod_multibody
