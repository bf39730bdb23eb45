// What the procedure steers: tasks, markers, messages, fade; and the queue of its commands.
#pragma once

#include "simulation/digest.hpp"
#include "simulation/plugin.hpp"
#include "simulation/simulation.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace calot::simulation {

class CaseState {
  public:
    static constexpr std::size_t most_commands = 64; // in one update

    /// Markers that are shown from the start go into `snapshot`.
    CaseState(const World& world, const Plugin& procedure, Snapshot& snapshot);

    /// For procedure.update: commands are copied into the queue.
    const calot_commands& commands() const { return abi_; }
    /// Performs what was queued, in order, on the snapshot of this tick; `perform` sees each. Throws
    /// host::PluginError for a command that names what does not exist.
    template<class Perform>
    void act(std::int64_t tick, Snapshot& snapshot, Perform&& perform) {
        for (std::size_t i = 0; i < count_; ++i) {
            apply(queue_[i], tick, snapshot);
            perform(queue_[i]);
        }
        count_ = 0;
        if (!snapshot.message.empty() && tick >= message_end_) snapshot.message = "";
    }

    std::vector<TaskState>& tasks() { return tasks_; }
    const std::vector<TaskState>& tasks() const { return tasks_; }
    bool is_completed(std::string_view task) const;
    bool are_required_completed() const;
    std::uint64_t hash() const { return hash_.value(); }

  private:
    static calot_status push(void* self, const calot_command* command);
    void apply(const Command& command, std::int64_t tick, Snapshot& snapshot);
    void set_marker(const Marker& marker, MarkerSet& markers);
    void show(const SceneMarker& scene, Marker& marker) const;
    TaskState& task(const Command& command);

    const World& world_;
    const Plugin& procedure_;
    std::vector<TaskState> tasks_;
    std::vector<Command> queue_;
    std::size_t count_ = 0;
    std::int64_t message_end_ = 0;
    Hash hash_;
    calot_commands abi_{};
};

} // namespace calot::simulation
