#include "bench/references.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace calot::bench {

PlanarTip planar_tip(double alpha, double beta) {
    constexpr int steps = 8000;
    PlanarTip tip;
    const auto slope = [&](double s, const std::array<double, 4>& y) {
        return std::array{y[1], -(alpha + beta * (1.0 - s)) * std::cos(y[0]), std::cos(y[0]), std::sin(y[0])};
    };
    const auto clamp_angle = [&](double tip_angle) {
        std::array<double, 4> y{tip_angle, 0, 0, 0};
        const double h = -1.0 / steps;
        for (int i = 0; i < steps; ++i) {
            const double s = 1.0 + i * h;
            const auto step = [&](const std::array<double, 4>& k, double f) {
                return std::array{y[0] + f * k[0], y[1] + f * k[1], y[2] + f * k[2], y[3] + f * k[3]};
            };
            const auto k1 = slope(s, y), k2 = slope(s + h / 2, step(k1, h / 2));
            const auto k3 = slope(s + h / 2, step(k2, h / 2)), k4 = slope(s + h, step(k3, h));
            for (int c = 0; c < 4; ++c)
                y[c] += h / 6 * (k1[c] + 2 * k2[c] + 2 * k3[c] + k4[c]);
        }
        tip = {-y[3], 1.0 + y[2], tip_angle};
        return y[0];
    };
    double low = 0.0, high = std::numbers::pi / 2;
    for (int i = 0; i < 55; ++i) {
        const double middle = 0.5 * (low + high);
        (clamp_angle(middle) > 0.0 ? high : low) = middle;
    }
    return tip;
}

} // namespace calot::bench
