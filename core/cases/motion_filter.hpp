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

    void start(double at) { position_ = at, velocity_ = acceleration_ = 0; }
    void step(double input) {
        constexpr double w = 2 * std::numbers::pi * frequency, dt = 1e-3;
        const double off = position_ - input, slope = velocity_ + w * off;
        const double decay = decay_per_tick();
        position_ = input + (off + slope * dt) * decay;
        velocity_ = (velocity_ - w * slope * dt) * decay;
        acceleration_ = w * w * (input - position_) - 2 * w * velocity_;
    }
    double position() const { return position_; }
    double velocity() const { return velocity_; }
    double acceleration() const { return acceleration_; }

  private:
    static double decay_per_tick(); // exp(-w dt)
    double position_ = 0, velocity_ = 0, acceleration_ = 0;
};

} // namespace calot::cases
