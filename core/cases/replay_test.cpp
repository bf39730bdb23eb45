#include "cases/recorder.hpp"
#include "cases/replay.hpp"
#include "simulation/test_parts.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <unistd.h>

namespace calot::cases {

namespace {

using simulation::test::Parts;

simulation::Outcome play(simulation::ControlSource& hands, unsigned threads, std::int64_t ticks,
                         simulation::Observer& observer) {
    Parts parts;
    const host::Instance rod = parts.rod();
    simulation::Simulation simulation({.world = Parts::world(),
                                       .rod = {rod.id(), rod.abi()},
                                       .replay = &hands,
                                       .seed = 5,
                                       .threads = threads});
    simulation.add_observer(observer);
    return simulation.run({.speed = simulation::Speed::max, .max_ticks = ticks});
}

// Replays with another push at one tick.
class Meddler : public simulation::ControlSource {
  public:
    Meddler(const Journal& journal, std::int64_t at) : controls_(journal), at_(at) {}
    bool next(std::int64_t tick, calot_controls& out) override {
        const bool is_more = controls_.next(tick, out);
        if (tick == at_) out.insertion += 0.002;
        return is_more;
    }

  private:
    JournalControls controls_;
    std::int64_t at_;
};

} // namespace

TEST(Replay, gives_the_same_bits_and_notices_a_changed_input_at_its_tick) {
    const auto folder =
        std::filesystem::temp_directory_path() / ("calot-replay-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder);
    {
        JournalWriter writer(folder, {});
        CaseRecorder recorder(writer);
        simulation::test::ScriptedHands hands(simulation::test::push_and_steer);
        play(hands, 2, 1100, recorder);
    }
    const Journal journal = read_journal(folder);
    std::filesystem::remove_all(folder);
    ASSERT_TRUE(journal.is_complete) << journal.damage;
    ASSERT_EQ(journal.ticks, 1100);

    JournalControls controls(journal);
    Verifier same(journal);
    const simulation::Outcome outcome = play(controls, 1, INT64_MAX, same);
    EXPECT_EQ(outcome.end, simulation::End::replay_ended);
    EXPECT_EQ(same.compared_ticks(), 1100);
    EXPECT_FALSE(same.difference()) << same.difference()->part << " differs at tick "
                                    << same.difference()->tick;

    Meddler meddler(journal, 700);
    Verifier other(journal);
    play(meddler, 1, INT64_MAX, other);
    ASSERT_TRUE(other.difference());
    EXPECT_EQ(other.difference()->tick, 701) << "the state after the tick that was changed";
    EXPECT_EQ(other.difference()->part, "rod");
}

} // namespace calot::cases
