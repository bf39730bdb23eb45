// The tick pipeline: one procedure on one scene with one endoscope, 1 ms at a time.
//
//   auto world = load_world(parse_scene(text, name), options);
//   Simulation simulation({.world = world, .rod = {...}, .device = {...}, .procedure = {...}});
//   simulation.add_observer(recorder); // journal, metrics, video
//   const Outcome outcome = simulation.run({.speed = Speed::realtime});
//
// A window runs `run` on a thread of its own, reads `latest()` at its own rate, pushes events into `input()`,
// and may call the functions marked [any thread].
#pragma once

#include "simulation/input_queue.hpp"
#include "simulation/plugin.hpp"
#include "simulation/snapshot.hpp"
#include "simulation/world.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace calot::simulation {

/// Controls from somewhere else than a device plugin: a replayed case. Steps on the simulation thread.
class ControlSource {
  public:
    virtual ~ControlSource() = default;
    /// The controls of this tick; false: no more, the case ends. Real-time.
    virtual bool next(std::int64_t tick, calot_controls& out) = 0;
};

/// A command of the procedure, copied, as it acts.
struct Command {
    std::uint32_t kind = 0; // CALOT_COMMAND_...
    Text<64> id;
    Text<256> text;
    double value = 0;
    std::array<double, 3> vector{};
    calot_pose pose{};
    Marker marker; // of MARKER_SET
};

/// Hash of the state after a tick, by part: equal parts, equal bits.
struct Digest {
    std::int64_t tick = 0;
    std::uint64_t rod = 0;       // positions, velocities, frames
    std::uint64_t contacts = 0;  // identities and impulses of all ticks so far
    std::uint64_t controls = 0;  // of all ticks so far
    std::uint64_t procedure = 0; // commands so far, tasks, markers, metrics
    friend bool operator==(const Digest&, const Digest&) = default;
};

struct TaskState {
    std::string id, title, goal;
    bool is_required = false;
    bool is_begun = false, is_completed = false;
    std::int64_t begin_tick = -1, end_tick = -1;
    double seconds() const {
        return end_tick < 0 || begin_tick < 0 ? 0 : static_cast<double>(end_tick - begin_tick) / 1000;
    }
};

/// Sees the case as it happens. All calls come on the simulation thread, in tick order; ticked and commanded
/// are part of the tick: they neither allocate nor block, unless the case runs at Speed::max, where a video
/// may take its time.
class Observer {
  public:
    virtual ~Observer() = default;
    virtual void began(const Snapshot&) {}
    virtual void ticked(const Snapshot&) {}
    virtual void commanded(std::int64_t tick, const Command&) { (void)tick; }
    virtual void digested(const Digest&) {} // each 1000 ticks, and at the end
    /// A 32-bit hash of the shaft after each tick, so that a difference can be placed to the tick.
    virtual void marked(std::int64_t tick, std::uint32_t mark) { (void)tick, (void)mark; }
    virtual void ended(const Snapshot&) {}
};

struct Setup {
    std::shared_ptr<const World> world{};
    std::string start = "default"; // of the scene's start poses
    Plugin rod{};
    Plugin device{};                 // or
    ControlSource* replay = nullptr; // controls from elsewhere
    Plugin procedure{};              // may be absent: nothing but the shaft
    std::uint64_t seed = 0;
    unsigned threads = 2; // 1: collision runs on the simulation thread; the bits are the same
    std::uint32_t nodes = 100;
    std::vector<InstrumentDatasheet> instruments{}; // by channel; an empty id: nothing lies in it
    std::string until{};                            // ends when this task is completed
    bool measure = false;                           // fill Snapshot::cost
    std::uint32_t max_contacts = 512;
    double max_force = 50, max_torque = 1; // N, N m: of the virtual coupling
};

enum class Speed { realtime, max };

struct RunOptions {
    Speed speed = Speed::max;
    std::int64_t max_ticks = INT64_MAX;
};

enum class End { finished, until, stopped, time_limit, replay_ended };

struct Outcome {
    End end = End::stopped;
    std::int64_t ticks = 0;
    double wall_seconds = 0;     // without pauses
    double real_time_factor = 0; // simulated over wall time
    LateTicks late;
    Penetration penetration;
    std::vector<TaskState> tasks;
    /// Every required task (or, with `until`, that task) is completed.
    bool is_completed = false;
};

class Simulation {
  public:
    /// Places the shaft, lets it settle, configures and activates the plugins. Throws
    /// host::PluginError, host::UserError for a start that the scene or the endoscope does not allow. [main]
    explicit Simulation(Setup setup);
    /// Deactivates the plugins. [main]
    ~Simulation();
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    /// Before run. Observers are called in the order in which they were added; they must outlive the run.
    void add_observer(Observer& observer);

    /// Steps until the procedure is over, stop() or a limit. Throws
    /// host::PluginError; the observers' ended() has
    /// been called then. Called once.
    Outcome run(const RunOptions& options);

    /// One tick, for tests and benchmarks; false when the case is over.
    bool step();

    /// The newest snapshot. [any thread]
    SnapshotRing::View latest() const;
    /// Where the window puts its input events. [one thread]
    InputQueue& input();
    /// Time stands still, the device is still polled. [any thread]
    void pause(bool on);
    /// Ends the run after the present tick. [any thread]
    void stop();

    const World& world() const;
    const std::vector<TaskState>& tasks() const; // not while another thread runs it
    /// What the help overlay shows, from the device's events extension: input, effect.
    std::vector<std::pair<std::string, std::string>> device_help() const;
    Digest digest() const; // not while another thread runs it

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace calot::simulation
