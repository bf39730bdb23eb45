// The operator's side of a tick: a device plugin, or recorded controls in its place.
#pragma once

#include "simulation/input_queue.hpp"
#include "simulation/plugin.hpp"
#include "simulation/simulation.hpp"

#include <calot/abi/plugin.h>

#include <string>
#include <utility>
#include <vector>

namespace calot::simulation {

class OperatorLink {
  public:
    /// `start`: the controls as the case begins. Throws host::PluginError.
    OperatorLink(const Plugin& device, ControlSource* replay, const calot_controls& start,
                 double field_of_view, std::uint64_t seed);
    ~OperatorLink();

    double stiffness_limit(int axis) const { return sheet_.stiffness_limit[axis]; } // 0: any
    double max_force() const { return sheet_.max_force; }                           // N, 0: feels nothing
    double max_torque() const { return sheet_.max_torque; }                         // N m

    /// What the screen showed and the hands felt one tick ago, for the next poll.
    void remember(const Snapshot& snapshot);

    enum class Polled { ok, unplugged, over };
    /// Hands over input events, then what was remembered, and takes the controls of this tick. Throws
    /// host::PluginError.
    Polled poll(std::int64_t tick, InputQueue& input, calot_controls& out);
    void send(const calot_feedback& feedback);

    std::vector<std::pair<std::string, std::string>> help() const;

  private:
    void observe();

    const Plugin& device_;
    ControlSource* replay_;
    const calot_device* functions_ = nullptr;
    const calot_device_events* events_ = nullptr;
    const calot_device_observation* observation_ = nullptr;
    calot_device_sheet sheet_{};
    double field_of_view_;
    // One tick back.
    std::int64_t seen_tick_ = 0;
    calot_pose seen_view_{};
    calot_feedback felt_{};
    double seen_fade_ = 0;
    Text<64> seen_task_;
    std::vector<calot_marker> markers_;
    MarkerSet seen_markers_;
};

} // namespace calot::simulation
