#pragma once

#include "bench/random.hpp"
#include "simulation/simulation.hpp"

#include <array>
#include <cstdint>

namespace calot::bench {

/// Hands at the limits of the devices: 0.3 m/s insertion, 360 degrees/s rotation, 180 degrees/s wheels. Each
/// control goes its own random way, stretch by stretch: smoothly to another speed, at another speed at once,
/// to and fro as fast as it goes, or still. The same seed gives the same motion everywhere.
class RoughHands : public simulation::ControlSource {
  public:
    struct Limits {
        double insertion = 0.3;              ///< m/s
        double rotation = 6.283185307179586; ///< rad/s
        double wheels = 3.141592653589793;   ///< rad/s
        double wheel_angle = 4.0;            ///< rad to either side: past every endoscope's stops
        double rotation_angle = 1e9;         ///< rad to either side
    };
    explicit RoughHands(std::uint64_t seed) : RoughHands(seed, Limits{}) {}
    RoughHands(std::uint64_t seed, const Limits& limits);
    bool next(std::int64_t tick, calot_controls& out) override;

  private:
    struct Control {
        Random random;
        double fastest, farthest; ///< per s; from 0
        bool is_travelling;       ///< goes mostly forwards for some seconds, then mostly back
        double value = 0, speed = 0, from = 0, to = 0;
        int mode = 0, begin = 0, end = 0, half_period = 1, turn = 0; // ticks
        double forwards = 0.5;                                       ///< how likely a stretch goes that way
        double advance(int tick);
        void begin_stretch(int tick);
    };
    std::array<Control, 4> controls_; ///< insertion, rotation, wheels
    Random brakes_;
    std::array<std::uint32_t, 2> brake_{};
    bool is_begun_ = false;
    std::array<double, 4> start_{};
};

} // namespace calot::bench
