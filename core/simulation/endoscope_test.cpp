#include "simulation/endoscope.hpp"
#include "simulation/toml_reader.hpp"

#include <calot/math.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <numeric>

namespace calot::simulation {

namespace {

constexpr double degrees = std::numbers::pi / 180;
constexpr std::uint32_t no_brake[2] = {0, 0}, held[2] = {1, 1};

const std::filesystem::path assets = std::filesystem::path(CALOT_SOURCE_DIR) / "assets";

EndoscopeDatasheet shipped(const std::string& name) {
    return read_endoscope(assets / "endoscopes" / (name + ".toml"));
}

// Frames of a shaft that bends as its rest curvature says, joint by joint, half of each neighbour: the free
// section, at rest.
std::vector<double> free_frames(const Endoscope& scope) {
    const auto rest = scope.rest_darboux();
    const auto lengths = scope.lengths();
    std::vector<double> frames{1, 0, 0, 0};
    Quat q;
    for (std::size_t i = 1; i < lengths.size(); ++i) {
        const Vec3 turn = 0.5 * (lengths[i - 1] * vec3(&rest[3 * (i - 1)]) + lengths[i] * vec3(&rest[3 * i]));
        if (norm(turn) > 0) q = q * axis_angle(normalized(turn), norm(turn));
        frames.insert(frames.end(), {q.w, q.x, q.y, q.z});
    }
    return frames;
}

// Angulation after the wheels have been left there for as long as it takes.
std::array<double, 2> settled(Endoscope& scope, double up, double left, const std::uint32_t brake[2]) {
    const double wheel[2] = {up, left};
    for (int tick = 0; tick < 5000; ++tick)
        scope.steer(wheel, brake, free_frames(scope), 1e-3);
    return scope.angulation(free_frames(scope));
}

} // namespace

TEST(ShaftChain, has_the_length_mass_and_compliance_of_the_datasheet_at_any_node_count) {
    for (const char* name : {"gif-2t160", "gif-hq190", "colonoscope"}) {
        const EndoscopeDatasheet sheet = shipped(name);
        double mass = 0, bending = 0;
        for (const ShaftSegment& s : sheet.segments) {
            mass += s.length * s.mass_per_length;
            const double steps = 20000;
            for (double k = 0; k < steps; ++k)
                bending += s.length / steps / s.flexural_rigidity.at((k + 0.5) / steps);
        }
        for (const std::uint32_t nodes : {20u, 57u, usual_nodes(sheet), 1000u, 2000u}) {
            const ShaftChain chain = divide(sheet, nodes);
            ASSERT_EQ(chain.length.size(), nodes - 1);
            double length = 0, m = 0, b = 0, shaft = 0;
            for (std::size_t i = 0; i < chain.length.size(); ++i) {
                length += chain.length[i], m += chain.length[i] * chain.mass[i];
                b += chain.length[i] / chain.bending[i];
                if (i < chain.first_bending) shaft += chain.length[i];
            }
            EXPECT_NEAR(length, sheet.working_length, 1e-12) << name << ", " << nodes << " nodes";
            EXPECT_NEAR(m, mass, 1e-12) << name << ", " << nodes << " nodes";
            EXPECT_NEAR(b / bending, 1, 1e-8) << name << ", " << nodes << " nodes";
            EXPECT_NEAR(shaft, sheet.working_length - sheet.bending_length(), 1e-12)
                << "a node lies where the bending section begins";
        }
        EXPECT_THROW(divide(sheet, 19), std::invalid_argument);
        EXPECT_THROW(divide(sheet, 2001), std::invalid_argument);
    }
}

TEST(ShaftChain, of_the_colonoscope_softens_from_handle_to_tip) {
    const EndoscopeDatasheet sheet = shipped("colonoscope");
    const ShaftChain chain = divide(sheet, usual_nodes(sheet));
    EXPECT_NEAR(chain.bending.front(), 0.040, 1e-12);
    EXPECT_NEAR(chain.bending[chain.first_bending - 1], 0.026, 1e-12);
    for (std::size_t i = 1; i < chain.first_bending; ++i)
        EXPECT_LE(chain.bending[i], chain.bending[i - 1] + 1e-12) << "at segment " << i;
    EXPECT_NEAR(static_cast<double>(usual_nodes(shipped("gif-2t160"))), 100, 0);
}

TEST(Endoscope, wheels_bend_the_tip_up_and_left_by_the_balance_of_wires_and_section) {
    Endoscope scope(shipped("gif-2t160"), 100);
    EXPECT_NEAR(scope.length(), 1.03, 1e-12);
    const double wheel[2] = {1.2, -0.5};
    scope.set_bending(wheel);
    // Moments by hand: K e / (K + e) (angle - slack/2), e = EI / length.
    const double e = 0.005 / 0.09, k = 0.70, slack = 4 * degrees, g = k / (k + e);
    const auto frames = free_frames(scope);
    const auto bent = scope.angulation(frames);
    EXPECT_NEAR(bent[0], g * (1.2 - slack), 1e-6);
    EXPECT_NEAR(bent[1], -g * (0.5 - slack), 1e-6);
    const Vec3 tip = rotate(quat(&frames[frames.size() - 4]), {0, 0, 1});
    EXPECT_NEAR(std::acos(tip.z), std::hypot(bent[0], bent[1]), 1e-6);
    EXPECT_GT(tip.y, 0) << "the up wheel bends towards +y";
    EXPECT_LT(tip.x, 0) << "a wheel to the right bends away from +x, which is left";
    EXPECT_NEAR(scope.wire_moment()[0], e * bent[0], 1e-9);
}

TEST(Endoscope, angulation_lags_whichever_way_the_wheel_turns_and_holds_while_it_is_braked) {
    Endoscope scope(shipped("gif-2t160"), 100);
    const double e = 0.005 / 0.09, k = 0.70, f = 0.01, slack = 4 * degrees;
    const double out = settled(scope, 1.0, 0, no_brake)[0];
    EXPECT_NEAR(out, (k * (1.0 - slack) - f) / (k + e), 1e-3) << "friction holds it back";
    const double still = settled(scope, 1.0 - f / k, 0, no_brake)[0];
    EXPECT_NEAR(still, out, 1e-3) << "within the friction nothing moves";
    EXPECT_NEAR(settled(scope, -1.0, 0, held)[0], out, 1e-3) << "a braked wheel stays";
    const double back = settled(scope, 0.8, 0, no_brake)[0];
    EXPECT_NEAR(back, (k * (0.8 - slack) + f) / (k + e), 1e-3) << "friction holds it up";
    const double released = settled(scope, 0, 0, no_brake)[0];
    EXPECT_NEAR(released, (k * slack + f) / (k + e), 1e-3)
        << "the section springs back until friction and the other wire hold it";
    EXPECT_GT(released, 4 * degrees);
}

TEST(Endoscope, the_wheels_pull_no_more_than_their_limit_so_that_an_instrument_costs_angle) {
    Endoscope scope(shipped("gif-hq190"), 100);
    const double bare = settled(scope, 100, 0, no_brake)[0];
    EXPECT_NEAR(bare / degrees, 164, 2) << "not the 210 degrees of the wheel's stop";
    scope.set_channel(0, {.flexural_rigidity = 0.004, .mass_per_length = 0.01, .reach = scope.length()});
    ASSERT_TRUE(scope.condition(scope.nodes(), free_frames(scope), 0.05));
    EXPECT_NEAR(settled(scope, 100, 0, no_brake)[0], 0.5 * bare, 1 * degrees)
        << "twice the rigidity, half the angle";
    EXPECT_NEAR(scope.wheel_torque()[0], 0.1427, 1e-4) << "which the thumb feels";
    scope.set_channel(0, {});
    ASSERT_TRUE(scope.condition(scope.nodes(), free_frames(scope), 0.05));
    EXPECT_NEAR(settled(scope, 100, 0, no_brake)[0], bare, 1 * degrees);
    EXPECT_THROW(scope.set_channel(1, {}), std::out_of_range) << "it has one channel";
}

TEST(Endoscope, an_instrument_stiffens_as_far_as_it_reaches) {
    Endoscope scope(shipped("gif-2t160"), 100);
    const std::vector<double> before(scope.segments().bending_x.data, scope.segments().bending_x.data + 99);
    scope.set_channel(1, {.flexural_rigidity = 0.002, .mass_per_length = 0.02, .reach = 0.5});
    ASSERT_TRUE(scope.condition(scope.nodes(), {}, 0.05));
    const calot_rod_segments s = scope.segments();
    double at = 0;
    for (std::size_t i = 0; i < 99; ++i) {
        const double filled = std::clamp((0.5 - at) / scope.lengths()[i], 0.0, 1.0);
        EXPECT_NEAR(s.bending_x.data[i], before[i] + 0.002 * filled, 1e-12) << "segment " << i;
        EXPECT_NEAR(s.mass_per_length.data[i], 0.20 + 0.02 * filled, 1e-12) << "segment " << i;
        at += scope.lengths()[i];
    }
}

TEST(Endoscope, what_lies_in_the_patient_softens_with_time_and_hardens_outside) {
    Endoscope scope(shipped("gif-2t160"), 100);
    const auto bending = [&](std::size_t i) { return scope.segments().bending_x.data[i]; };
    const auto torsion = [&](std::size_t i) { return scope.segments().torsion.data[i]; };
    const double gj = torsion(60);
    EXPECT_NEAR(gj, 0.95 * 0.44, 1e-9) << "not twisted: between the two ways round";
    for (int k = 0; k < 20 * 60; ++k)
        scope.condition(50, {}, 0.05);
    EXPECT_NEAR(bending(60) / 0.033, 1 - 0.17 * (1 - std::exp(-1)), 3e-3) << "after the time constant";
    EXPECT_NEAR(bending(40), 0.033, 1e-12) << "outside";
    for (int k = 0; k < 20 * 600; ++k)
        scope.condition(50, {}, 0.05);
    EXPECT_NEAR(bending(60) / 0.033, 0.83, 3e-3);
    EXPECT_NEAR(torsion(60) / gj, 0.93, 3e-3);
    EXPECT_NEAR(bending(95), 0.005, 1e-5) << "the bending section's rings do not soften";
    for (int k = 0; k < 20 * 600; ++k)
        scope.condition(scope.nodes(), {}, 0.05);
    EXPECT_NEAR(bending(60) / 0.033, 1, 3e-3);
    scope.start_warm(50);
    EXPECT_NEAR(bending(60) / 0.033, 0.83, 1e-9);
}

TEST(Endoscope, resists_twist_less_the_other_way_round) {
    for (const double side : {1.0, -1.0}) {
        Endoscope scope(shipped("gif-2t160"), 100);
        std::vector<double> frames;
        for (std::size_t i = 0; i < 99; ++i) {
            const Quat q = axis_angle({0, 0, 1}, side * 0.01 * static_cast<double>(i)); // 1 rad/m
            frames.insert(frames.end(), {q.w, q.x, q.y, q.z});
        }
        scope.condition(scope.nodes(), frames, 0.05);
        EXPECT_NEAR(scope.segments().torsion.data[30], side > 0 ? 0.44 : 0.9 * 0.44, 1e-6);
    }
}

TEST(Endoscope, laid_along_a_path_keeps_every_length_and_ends_at_the_insertion) {
    const Endoscope scope(shipped("gif-2t160"), 100);
    calot_guide guide{};
    guide.present = 1;
    guide.direction[2] = -1;
    const geometry::Vec3 path[] = {{0, 0, 0}, {0, 0, -0.1}, {0.02, 0, -0.2}, {0.02, -0.05, -1.3}};
    const auto nodes = scope.laid_along(guide, path, 0.25);
    const auto frames = scope.frames_along(nodes, 0.3);
    for (std::size_t i = 0; i + 1 < scope.nodes(); ++i) {
        const Vec3 piece = vec3(&nodes[3 * i + 3]) - vec3(&nodes[3 * i]);
        EXPECT_NEAR(norm(piece), scope.lengths()[i], 1e-12);
        EXPECT_NEAR(norm(rotate(quat(&frames[4 * i]), {0, 0, 1}) - normalized(piece)), 0, 1e-9);
    }
    EXPECT_DOUBLE_EQ(nodes[0], 0.0) << "the base lies in the guide";
    EXPECT_GT(nodes[2], 0.7);
    const Vec3 up = rotate(quat(frames.data()), {0, 1, 0});
    EXPECT_NEAR(up.y, -std::cos(0.3), 1e-9) << "turned from anterior by the rotation";
    EXPECT_THROW(scope.laid_along(guide, {path, 3}, 0.5), std::invalid_argument) << "the path is shorter";
    EXPECT_THROW(scope.laid_along(guide, path, 1.03), std::invalid_argument) << "the endoscope is shorter";
}

} // namespace calot::simulation
