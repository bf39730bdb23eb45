// Rough hands, the judge of a soak, and a short soak of each rod that claims push-soak.
#include "bench/rod_problems.hpp"
#include "bench/rod_soak.hpp"
#include "bench/rough_hands.hpp"
#include "bench/soak_judge.hpp"
#include "bench/test_plugins.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <iostream>
#include <thread>
#include <unistd.h>

namespace calot::bench {
namespace {

std::vector<calot_controls> motion(std::uint64_t seed, int ticks) {
    RoughHands hands(seed);
    std::vector<calot_controls> all;
    calot_controls c{};
    for (int tick = 0; tick < ticks; ++tick) {
        hands.next(tick, c);
        all.push_back(c);
    }
    return all;
}

TEST(RoughHands, move_at_the_devices_limits_and_no_faster) {
    const auto all = motion(3, 60'000);
    double push = 0, pull = 0, turn = 0, wheel = 0, wheel_angle = 0;
    bool has_jumped = false;
    double last = 0;
    for (std::size_t i = 1; i < all.size(); ++i) {
        const double v = (all[i].insertion - all[i - 1].insertion) / 1e-3;
        push = std::max(push, v), pull = std::max(pull, -v);
        turn = std::max(turn, std::abs(all[i].rotation - all[i - 1].rotation) / 1e-3);
        wheel = std::max(wheel, std::abs(all[i].wheel[0] - all[i - 1].wheel[0]) / 1e-3);
        wheel_angle = std::max(wheel_angle, std::abs(all[i].wheel[0]));
        has_jumped = has_jumped || std::abs(v - last) > 0.5;
        last = v;
    }
    EXPECT_NEAR(push, 0.3, 1e-9) << "m/s";
    EXPECT_NEAR(pull, 0.3, 1e-9) << "m/s";
    EXPECT_NEAR(turn, 2 * std::numbers::pi, 1e-9) << "rad/s";
    EXPECT_NEAR(wheel, std::numbers::pi, 1e-9) << "rad/s";
    EXPECT_LE(wheel_angle, 4);
    EXPECT_GE(wheel_angle, 3) << "the stops are reached";
    EXPECT_TRUE(has_jumped) << "from full speed forwards to full speed backwards within a tick";
}

TEST(RoughHands, do_the_same_for_the_same_seed_alone) {
    const auto a = motion(5, 5000), b = motion(5, 5000), c = motion(6, 5000);
    for (std::size_t i = 0; i < a.size(); ++i)
        ASSERT_EQ(a[i].insertion, b[i].insertion) << "tick " << i;
    EXPECT_NE(a.back().insertion, c.back().insertion);
}

/// Two triangles that make a square of 0.1 m in the plane z = 0.
geometry::TriangleScene square() {
    static const double vertices[] = {-0.05, -0.05, 0, 0.05, -0.05, 0, 0.05, 0.05, 0, -0.05, 0.05, 0};
    static const std::uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    const geometry::OrganSurface surface{
        .name = "square", .vertices = vertices, .triangles = triangles, .regions = {}, .friction = {}};
    return geometry::TriangleScene(std::span(&surface, 1));
}

TEST(SoakJudge, sees_a_crossing_through_faces_edges_and_corners) {
    const geometry::TriangleScene scene = square();
    const auto through = [&](double x, double y) { return crosses(scene, {x, y, -0.01}, {x, y, 0.02}); };
    EXPECT_TRUE(through(0.02, -0.01)) << "a face";
    EXPECT_TRUE(through(0.01, 0.01)) << "the edge between the two";
    EXPECT_TRUE(through(0.05, 0.05)) << "a corner";
    EXPECT_FALSE(through(0.051, 0.01)) << "beside it";
    EXPECT_FALSE(crosses(scene, {0.01, 0.02, 0.001}, {0.02, 0.01, 0.02})) << "above it";
}

TEST(SoakJudge, counts_the_nodes_past_a_wall) {
    const geometry::TriangleScene scene = square();
    std::vector<double> straight, beside;
    for (int i = 0; i < 10; ++i) {
        for (const double v : {0.01, 0.0, 0.01 * i - 0.0351})
            straight.push_back(v);
        for (const double v : {0.06, 0.0, 0.01 * i - 0.0351})
            beside.push_back(v);
    }
    EXPECT_EQ(nodes_outside(scene, straight), 6u) << "4 of 10 nodes lie before the wall";
    EXPECT_EQ(nodes_outside(scene, beside), 0u);
}

TEST(SoakJudge, fails_a_shaft_that_sinks_in_for_too_long) {
    const auto world = load_soak_world("reference", "");
    SoakJudge judge(*world, 10);
    simulation::Snapshot s;
    s.position.assign(6, 0.0), s.position[5] = 0.31, s.position[2] = 0.315; // in the guide and the oesophagus
    s.velocity.assign(6, 0.0);
    const auto met = [&](const char* quantity) {
        for (const Row& row : judge.rows({}, static_cast<double>(judge.ticks()) * 1e-3))
            if (row.quantity == quantity) return row.met();
        ADD_FAILURE() << "no row " << quantity;
        return false;
    };
    for (s.tick = 1; s.tick <= 10; ++s.tick) {
        s.penetration.now = 1.1e-3;
        judge.ticked(s);
    }
    EXPECT_TRUE(met("over_1mm")) << "10 ms are allowed";
    EXPECT_TRUE(met("penetration"));
    judge.ticked(s);
    EXPECT_FALSE(met("over_1mm")) << "11 ms are not";
    s.penetration.now = 3.2e-3;
    judge.ticked(s);
    EXPECT_FALSE(met("penetration")) << "more than half a radius";
}

TEST(PushSoak, honours_what_it_is_given) {
    RodOptions options;
    options.model = "org.calot.rod-cosserat";
    options.duration = 0.2;
    options.nodes = 60;
    options.bending = 0.05, options.length = 0.9, options.radius = 0.005, options.mass_per_length = 0.1;
    options.friction = 0.3, options.load = 20;
    const MakeInstance make = [&] { return plugins().make(host::Kind::rod, options.model); };
    const auto rows = run_push_soak(make, options);
    options.bending = 0.02;
    const auto softer = run_push_soak(make, options);
    for (const Row& row : rows) {
        EXPECT_EQ(row.nodes, 60);
        if (row.quantity == "penetration") {
            EXPECT_DOUBLE_EQ(row.bound, 0.0025);
        }
        if (row.quantity == "duration") {
            EXPECT_NEAR(row.measured, 0.2, 1e-9);
        }
    }
    ASSERT_EQ(rows.size(), softer.size());
    for (std::size_t i = 0; i < rows.size(); ++i)
        if (rows[i].quantity == "energy") {
            EXPECT_NE(rows[i].measured, softer[i].measured);
        }
}

TEST(PushSoak, tells_what_there_is_when_it_is_interrupted) {
    RodOptions options;
    options.model = "org.calot.rod-direct";
    options.duration = 1000;
    const MakeInstance make = [&] { return plugins().make(host::Kind::rod, options.model); };
    // Until it is heard: before the case begins a SIGINT would end the process, as it should, and is ignored
    // here.
    const auto before = std::signal(SIGINT, SIG_IGN);
    std::atomic<bool> is_over{false};
    std::thread hand([&] {
        while (!is_over) {
            std::this_thread::sleep_for(std::chrono::milliseconds(500));
            kill(getpid(), SIGINT);
        }
    });
    const auto rows = run_push_soak(make, options);
    is_over = true;
    hand.join();
    std::signal(SIGINT, before);
    ASSERT_FALSE(rows.empty());
    EXPECT_EQ(rows.front().quantity, "duration");
    EXPECT_LT(rows.front().measured, 1000);
    EXPECT_FALSE(rows.front().met());
    EXPECT_NE(rows.front().setting.find("interrupted"), std::string::npos) << rows.front().setting;
}

// Every rod there is; a miss fails those that claim the problem, and is printed for the others.
TEST(PushSoak, keeps_the_shaft_in_the_lumen) {
    for (const host::Found& found : plugins().models(host::Kind::rod)) {
        const auto& claims = found.model->claims;
        const bool is_claimed = std::find(claims.begin(), claims.end(), "push-soak") != claims.end();
        for (const char* anatomy : {"reference", "colon"}) {
            RodOptions options;
            options.model = found.model->id;
            options.anatomy = anatomy;
            options.duration = found.model->is_realtime ? 3 : 0.3;
            if (!found.model->is_realtime) options.nodes = 60;
            const auto rows =
                run_push_soak([&] { return plugins().make(host::Kind::rod, options.model); }, options);
            for (const Row& row : rows) {
                if (row.met()) continue;
                const std::string what = options.model + " in " + row.setting + ": " + row.quantity + " " +
                                         std::to_string(row.measured) + ", bound " +
                                         std::to_string(row.bound);
                if (is_claimed)
                    ADD_FAILURE() << what;
                else
                    std::cout << what << " (not claimed)\n";
            }
        }
    }
}

} // namespace
} // namespace calot::bench
