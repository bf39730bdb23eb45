// Task 1: from the oesophagus through the incision in the stomach's wall.
#pragma once

#include <calot/math.hpp>
#include <calot/procedure.hpp>
#include <calot/state.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace calot::transgastric {

/// A flat ring in the world; the normal points the way to go through. m.
struct Ring {
    Vec3 centre;
    Vec3 normal{0, 0, 1};
    double radius = 0;
};

/// How the shaft passes through a ring.
struct Passage {
    double beyond = 0; // m of shaft between the ring and the tip, along the shaft
    double offset = 0; // m from the ring's centre to the shaft's axis, in the ring's plane
};

/// Where the shaft leaves the ring's plane for the last time before its tip, if the tip is on the far side
/// and that place is inside the ring: a shaft that got there beside the ring has not passed it. Real-time.
std::optional<Passage> passage(const SnapshotView& shaft, const Ring& ring);

/// Distance of a point from a polyline, m; 0 for an empty one. Real-time.
double distance(const Vec3& point, const std::vector<Vec3>& polyline);

/// Follows the tip, and knows when the task is done.
class Navigation {
  public:
    // How much of the shaft must be through, and for how long: the bending section's half, so that the tip
    // can look around in the abdomen and does not slip back.
    static constexpr double needed_beyond = 0.045; // m
    static constexpr double needed_time = 0.5;     // s

    /// Throws Error if the scene lacks the incision.
    void configure(const SnapshotView& scene);
    void reset() { state_ = {}; }
    /// Real-time.
    void update(std::int64_t tick, const SnapshotView& shaft);

    bool is_in_stomach() const { return state_.stomach_tick >= 0; }
    bool is_tip_through() const { return state_.ring_tick >= 0; }
    bool is_done() const { return state_.is_done; }
    /// s since the case began until the tip entered the stomach; only once it has.
    double stomach_seconds() const { return seconds(state_.stomach_tick); }
    /// s from there until the tip first passed the ring; only once it has.
    double search_seconds() const {
        return seconds(state_.ring_tick - std::max<std::int64_t>(state_.stomach_tick, 0));
    }
    /// m, mean distance of the tip from the marked path until then.
    double path_deviation() const {
        return state_.samples > 0 ? state_.deviation / static_cast<double>(state_.samples) : 0;
    }
    /// m, between the ring's centre and the shaft's axis when the task was done.
    double ring_offset() const { return state_.offset; }

    void save(StateWriter& to) const;
    void load(StateReader& from);

  private:
    // A tick is 1 ms, whatever the interval of the updates.
    static double seconds(std::int64_t ticks) { return static_cast<double>(ticks) * 1e-3; }

    struct State {
        std::int64_t stomach_tick = -1;
        std::int64_t ring_tick = -1;
        std::int64_t through_since = -1; // far enough through, without a break
        std::int64_t samples = 0;
        double deviation = 0; // m, summed over samples
        double offset = 0;
        bool is_done = false;
    };

    Ring ring_;
    std::vector<Vec3> path_;
    Vec3 junction_, junction_direction_; // where the oesophagus ends, and its direction there
    bool has_junction_ = false;
    State state_;
};

} // namespace calot::transgastric
