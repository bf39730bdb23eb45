// Velocity and acceleration from positions a millisecond apart, without the noise of differences.
#pragma once

#include <numbers>

namespace calot::cases {

/// Second-order low-pass with critical damping at 10 Hz, x'' = w2 (u - x) - 2 w x', stepped exactly for an
/// input that is constant over the tick. Human hands move below 10 Hz; contact makes the shaft ring above it.
/// A steady velocity passes unchanged; a sine of f Hz is smaller by 1 / (1 + (f / 10)^2).
class MotionFilter {
  public:
    static constexpr double frequency = 10; // Hz

    void start(double at) { position_ = at, rate_ = velocity_ = acceleration_ = 0; }
    void step(double input) {
        constexpr double w = 2 * std::numbers::pi * frequency, dt = 1e-3;
        const double off = position_ - input, slope = rate_ + w * off;
        const double decay = decay_per_tick();
        const double before = position_, velocity = velocity_;
        position_ = input + (off + slope * dt) * decay;
        rate_ = (rate_ - w * slope * dt) * decay;
        // Means over the tick: the state itself swings within it, for the input comes in steps.
        velocity_ = (position_ - before) / dt;
        acceleration_ = (velocity_ - velocity) / dt;
    }
    double position() const { return position_; }
    double velocity() const { return velocity_; }
    double acceleration() const { return acceleration_; }

  private:
    static double decay_per_tick(); // exp(-w dt)
    double position_ = 0, rate_ = 0, velocity_ = 0, acceleration_ = 0;
};

} // namespace calot::cases
