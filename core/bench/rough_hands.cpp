#include "bench/rough_hands.hpp"

#include <algorithm>
#include <cmath>

namespace calot::bench {

namespace {

constexpr double tick_seconds = 1e-3;
enum Mode { smooth, abrupt, shaken, still, mode_count };

} // namespace

RoughHands::RoughHands(std::uint64_t seed, const Limits& l)
    : controls_{Control{Random(4 * seed + 0x1001), l.insertion, 1e9, true},
                Control{Random(4 * seed + 0x1002), l.rotation, l.rotation_angle, false},
                Control{Random(4 * seed + 0x1003), l.wheels, l.wheel_angle, false},
                Control{Random(4 * seed + 0x1004), l.wheels, l.wheel_angle, false}},
      brakes_(seed ^ 0x6272616b65) {}

void RoughHands::Control::begin_stretch(int tick) {
    mode = static_cast<int>(random.uniform(0, 1) * mode_count);
    begin = tick;
    end = tick + static_cast<int>(random.uniform(50, 1500));
    half_period = static_cast<int>(random.uniform(5, 150));
    from = speed;
    if (is_travelling && tick >= turn) {
        forwards = forwards > 0.5 ? 0.25 : 0.85;
        turn = tick + static_cast<int>(random.uniform(3000, 12'000));
    }
    const double way = random.uniform(0, 1) < forwards ? 1 : -1;
    // Half of the time as fast as it goes.
    to = way * fastest * std::min(1.0, random.uniform(0, 2));
}

double RoughHands::Control::advance(int tick) {
    if (tick >= end) begin_stretch(tick);
    switch (mode) {
    case smooth: {
        const double x = static_cast<double>(tick - begin) / (end - begin);
        speed = from + (to - from) * x * x * (3 - 2 * x);
        break;
    }
    case abrupt:
        speed = to;
        break;
    case shaken:
        speed = (tick - begin) / half_period % 2 == 0 ? to : -to;
        break;
    default:
        speed = 0;
    }
    const double moved = value + speed * tick_seconds;
    if (std::abs(moved) > farthest) {
        end = tick; // at the stop: another stretch
        speed = 0;
    } else {
        value = moved;
    }
    return value;
}

bool RoughHands::next(std::int64_t tick, calot_controls& out) {
    if (!is_begun_) {
        is_begun_ = true;
        start_ = {out.insertion, out.rotation, out.wheel[0], out.wheel[1]};
    }
    double* const to[] = {&out.insertion, &out.rotation, &out.wheel[0], &out.wheel[1]};
    for (std::size_t k = 0; k < 4; ++k)
        *to[k] = start_[k] + controls_[k].advance(static_cast<int>(tick));
    if (tick % 250 == 0)
        for (std::uint32_t& brake : brake_)
            brake = brakes_.uniform(0, 1) < 0.15;
    out.brake[0] = brake_[0], out.brake[1] = brake_[1];
    return true;
}

} // namespace calot::bench
