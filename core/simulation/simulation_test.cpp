#include "geometry/triangle_scene.hpp"
#include "simulation/pacer.hpp"
#include "simulation/simulation.hpp"
#include "simulation/test_parts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>
#include <vector>

namespace calot::simulation {

namespace {

struct Digests : Observer {
    std::vector<std::uint32_t> marks;
    std::vector<Digest> digests;
    void marked(std::int64_t, std::uint32_t mark) override { marks.push_back(mark); }
    void digested(const Digest& d) override { digests.push_back(d); }
};

struct Played {
    Digests seen;
    Outcome outcome;
};

Played play(unsigned threads, std::int64_t ticks, std::uint64_t seed,
            std::function<void(std::int64_t, calot_controls&)> script, Observer* more = nullptr,
            double max_force = 50) {
    test::Parts parts;
    const host::Instance rod = parts.rod();
    test::ScriptedHands hands(std::move(script));
    Simulation simulation({.world = test::Parts::world(),
                           .rod = {rod.id(), rod.abi()},
                           .device = {},
                           .replay = &hands,
                           .procedure = {},
                           .seed = seed,
                           .threads = threads,
                           .max_force = max_force});
    Played result;
    simulation.add_observer(result.seen);
    if (more != nullptr) simulation.add_observer(*more);
    result.outcome = simulation.run({.speed = Speed::max, .max_ticks = ticks});
    return result;
}

} // namespace

TEST(Simulation, one_two_and_four_threads_give_the_same_bits) {
    const Played one = play(1, 1200, 3, test::push_and_steer);
    ASSERT_EQ(one.seen.marks.size(), 1200u);
    ASSERT_EQ(one.seen.digests.size(), 2u) << "one at 1000 ticks, one at the end";
    for (const unsigned threads : {2u, 4u}) {
        const Played more = play(threads, 1200, 3, test::push_and_steer);
        EXPECT_EQ(one.seen.marks, more.seen.marks) << threads << " threads";
        EXPECT_EQ(one.seen.digests, more.seen.digests) << threads << " threads";
    }
}

TEST(Simulation, another_seed_starts_elsewhere) {
    const Played one = play(1, 20, 3, test::push_and_steer), other = play(1, 20, 4, test::push_and_steer);
    EXPECT_NE(one.seen.marks, other.seen.marks);
}

TEST(Simulation, a_shaft_pushed_into_the_stomach_stays_in_the_lumen) {
    struct Watch : Observer {
        const World& world = *test::Parts::world();
        std::int64_t outside = 0;
        double lowest = 1e9, deepest_contact = 0, first_force = -1;
        void ticked(const Snapshot& s) override {
            lowest = std::min(lowest, s.camera.position[2]);
            if (s.tick % 50 != 0) return;
            for (std::size_t i = 0; i < s.position.size(); i += 3)
                outside += geometry::organ_containing(
                               world.surfaces, {s.position[i], s.position[i + 1], s.position[i + 2]}) !=
                           geometry::TriangleScene::none;
        }
    } watch;
    // 0.3 m/s is the fastest that a device may push; straight on, the tip ends against the stomach's wall.
    const Played fast = play(
        2, 1500, 1,
        [](std::int64_t tick, calot_controls& c) {
            c.insertion = std::min(0.3e-3 * static_cast<double>(tick), 0.3);
        },
        &watch);
    EXPECT_EQ(watch.outside, 0) << "nodes inside a wall";
    EXPECT_LT(watch.lowest, 0.05) << "the tip did not reach the stomach";
    EXPECT_LE(fast.outcome.penetration.ticks_over_1mm, 10)
        << "deepest " << fast.outcome.penetration.deepest << " m";
    EXPECT_LT(fast.outcome.penetration.deepest, 0.00315) << "half a radius";
}

TEST(Simulation, the_hand_feels_no_more_than_the_coupling_allows_and_grips_anew_when_it_turns_back) {
    struct Watch : Observer {
        double most = 0, at_turn = 0, after_turn = 0;
        void ticked(const Snapshot& s) override {
            most = std::max(most, std::fabs(s.feedback.insertion_force));
            if (s.tick == 1200) at_turn = s.feedback.insertion_force;
            if (s.tick == 1400) after_turn = s.feedback.insertion_force;
        }
    } watch;
    // Far more than there is shaft, then 30 mm back.
    play(
        1, 1400, 1,
        [](std::int64_t tick, calot_controls& c) {
            c.insertion = tick < 1200 ? 1e-3 * static_cast<double>(tick)
                                      : 1.2 - 0.15e-3 * static_cast<double>(tick - 1200);
        },
        &watch, 2);
    EXPECT_LE(watch.most, 2 * (1 + 1e-9));
    EXPECT_GT(watch.at_turn, 1.9);
    // Without sliding, the hand would be 0.5 m ahead of the shaft, and 30 mm would change nothing.
    EXPECT_LT(watch.after_turn, 0.5 * watch.at_turn)
        << "pulling is felt at once, however far the hand had slid";
}

TEST(Simulation, re_setting_the_hose_moves_nothing) {
    struct Watch : Observer {
        double insertion = 0, offset = 0;
        void ticked(const Snapshot& s) override { insertion = s.insertion, offset = s.hose_offset[0]; }
    } still, moved;
    play(
        1, 300, 1, [](std::int64_t, calot_controls&) {}, &still);
    play(
        1, 300, 1,
        [](std::int64_t tick, calot_controls& c) {
            c.insertion = -0.2e-3 * static_cast<double>(tick);
            c.buttons = CALOT_BUTTON_RESET;
        },
        &moved);
    EXPECT_NEAR(moved.insertion, still.insertion, 1e-9);
    EXPECT_NEAR(moved.offset, -0.2e-3 * 299, 1e-12);
}

TEST(Simulation, readers_on_other_threads_see_whole_snapshots) {
    test::Parts parts;
    const host::Instance rod = parts.rod();
    test::ScriptedHands hands(test::push_and_steer);
    Simulation simulation({.world = test::Parts::world(),
                           .rod = {rod.id(), rod.abi()},
                           .device = {},
                           .replay = &hands,
                           .procedure = {}});
    std::atomic<bool> is_over{false};
    std::atomic<int> torn{0}, seen{0};
    // Readers that got no processor on a busy machine would have read nothing: the case waits for them.
    struct Wait : Observer {
        explicit Wait(const std::atomic<int>& views) : seen(views) {}
        const std::atomic<int>& seen;
        void ticked(const Snapshot& s) override {
            while (seen.load() <= s.tick)
                std::this_thread::yield();
        }
    } wait(seen);
    simulation.add_observer(wait);
    std::vector<std::thread> readers;
    readers.reserve(3);
    for (int i = 0; i < 3; ++i)
        readers.emplace_back([&] {
            std::int64_t last = -1;
            while (!is_over.load()) {
                const auto view = simulation.latest();
                // What the last tick wrote belongs together: the camera is the last node.
                for (int k = 0; k < 3; ++k)
                    torn += view->position[view->position.size() - 3 + k] != view->camera.position[k];
                torn += view->tick < last;
                torn += view->markers.count != 1 || view->markers.marker[0].points.size() < 6;
                last = view->tick;
                ++seen;
                std::this_thread::yield();
            }
        });
    const Outcome outcome = simulation.run({.speed = Speed::max, .max_ticks = 400});
    is_over = true;
    for (std::thread& reader : readers)
        reader.join();
    EXPECT_EQ(outcome.ticks, 400);
    EXPECT_EQ(torn.load(), 0) << "of " << seen.load();
    EXPECT_GE(seen.load(), 400);
}

TEST(SnapshotRing, keeps_what_is_pinned_and_the_newest) {
    SnapshotRing ring(20, 4);
    std::vector<SnapshotRing::View> pinned;
    for (std::int64_t tick = 1; tick < 40; ++tick) {
        Snapshot* slot = ring.begin();
        if (slot == nullptr) break;
        slot->tick = tick;
        ring.publish();
        pinned.push_back(ring.latest());
    }
    ASSERT_EQ(pinned.size(), SnapshotRing::slots) << "every slot is pinned once, and none is written again";
    for (std::size_t i = 0; i < pinned.size(); ++i)
        EXPECT_EQ(pinned[i]->tick, static_cast<std::int64_t>(i) + 1);
}

TEST(Pacer, catches_five_late_ticks_up_and_lets_the_rest_slip) {
    using namespace std::chrono_literals;
    LateTicks late;
    Pacer pacer(true);
    const auto start = Pacer::Clock::now();
    pacer.restart();
    pacer.ended(start + 1ms, late);
    EXPECT_EQ(late.late, 0);
    pacer.ended(start + 6ms, late); // due at 2 ms
    EXPECT_EQ(late.late, 1);
    EXPECT_EQ(late.slipped, 0) << "four ticks behind are caught up";
    pacer.ended(start + 103ms, late); // due at 3 ms
    EXPECT_EQ(late.late, 2);
    EXPECT_NEAR(static_cast<double>(late.slipped), 100, 1);
    pacer.ended(start + 104ms, late);
    EXPECT_EQ(late.late, 2) << "time has slipped: the next tick is not late";
    EXPECT_GE(late.worst_us, 99'000);
}

} // namespace calot::simulation
