// An endoscope's end on the bench: the bending section hangs free out of a straight sleeve, without gravity.
#pragma once

#include "bench/bench_rod.hpp"
#include "simulation/endoscope.hpp"

#include <array>
#include <optional>
#include <vector>

namespace calot::bench {

/// `sheet` with all but the last `shaft` metres of its shaft cut off: what lies in the sleeve beyond that
/// does not move.
simulation::EndoscopeDatasheet shortened(const simulation::EndoscopeDatasheet& sheet, double shaft);

/// A rod model with the bending section's wires on it, driven by the wheels. Throws host::PluginError where a
/// call fails.
class EndoscopeJig {
  public:
    /// `nodes` on `sheet`; an instrument, if there is one, lies in `channel` up to the tip.
    EndoscopeJig(const MakeInstance& make, const simulation::EndoscopeDatasheet& sheet, std::uint32_t nodes,
                 const std::optional<simulation::InstrumentDatasheet>& instrument, std::size_t channel);

    /// One tick of 1 ms with the wheels (rad; up, left) there. With a stop, the tip lies against a rigid
    /// plane beside it that keeps it from bending up.
    void step(const std::array<double, 2>& wheel);
    void set_stop(bool on) { is_stopped_ = on; }

    std::array<double, 2> angulation() const { return scope_.angulation(frame_); } // rad
    /// N, mean over the last tick, of the tip on the stop.
    double tip_force() const { return -impulse_[1] / step_seconds; }
    /// m: the least over the joints between the bending section's segments.
    double smallest_bend_radius() const;
    std::array<double, 2> wheel_torque() const { return scope_.wheel_torque(); }
    /// The centreline from the sleeve on: m along it, m up.
    std::vector<std::array<double, 2>> shape() const;
    const simulation::Endoscope& endoscope() const { return scope_; }

    static constexpr double step_seconds = 1e-3;

  private:
    void check(calot_status status, const char* function) const;
    const calot_rod& functions() const { return *static_cast<const calot_rod*>(instance_.abi()->kind); }
    void* self() const { return instance_.abi()->self; }

    host::Instance instance_;
    simulation::Endoscope scope_;
    calot_guide guide_{};
    calot_rod_input input_{};
    calot_rod_output output_{};
    std::vector<double> position_, frame_;
    std::array<double, 3> impulse_{};
    mutable calot_error error_{};
    bool is_stopped_ = false;
};

} // namespace calot::bench
