#include "bench/references.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace calot::bench {

// In delta = pi/2 - theta, which is what is left to the load's direction: delta'' = (alpha + beta (1 - s))
// sin delta grows like an exponential from the tip back to the clamp, so its value at the tip is sought on a
// logarithmic scale. That holds for any load.
PlanarTip planar_tip(double alpha, double beta) {
    if (!(alpha + beta > 0)) return {};
    // So steep that the tip's delta underflows: all of the bend is close to the clamp, and the rest hangs
    // straight. delta'^2 / 2 = (alpha + beta) (1 - cos delta) from pi/2 to 0.
    if (const double steep = std::sqrt(alpha + beta); steep > 600)
        return {1 - 2 / steep * (1 - std::cos(std::numbers::pi / 4)),
                1 - 2 / steep * std::sin(std::numbers::pi / 4), std::numbers::pi / 2};
    const int steps = static_cast<int>(std::clamp(80 * std::sqrt(alpha + beta), 8000.0, 400000.0));
    PlanarTip tip;
    const auto slope = [&](double s, const std::array<double, 4>& y) {
        return std::array{y[1], (alpha + beta * (1.0 - s)) * std::sin(y[0]), std::sin(y[0]), std::cos(y[0])};
    };
    // By how much the clamp's delta is short of pi/2.
    const auto miss = [&](double tip_delta) {
        std::array<double, 4> y{tip_delta, 0, 0, 0};
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
            if (y[0] > std::numbers::pi) return -1.0;
        }
        tip = {-y[3], 1.0 + y[2], std::numbers::pi / 2 - tip_delta};
        return std::numbers::pi / 2 - y[0];
    };
    double low = -700, high = std::log(std::numbers::pi / 2);
    for (int i = 0; i < 64; ++i) {
        const double middle = 0.5 * (low + high);
        (miss(std::exp(middle)) < 0.0 ? high : low) = middle;
    }
    miss(std::exp(low)); // the last that did not run away
    return tip;
}

StiffCapstan stiff_capstan(double mu, double angle, double stiffness) {
    const auto leaves = [&](double tension) {
        return std::acos(std::clamp(1 - 0.5 * stiffness / tension, -1.0, 1.0));
    };
    StiffCapstan c;
    c.slack = leaves(1);
    const double held = std::cos(c.slack) + mu * std::sin(c.slack);
    c.ratio = std::exp(mu * angle);
    // The angle lost on the taut side hardly depends on the tension there.
    for (int k = 0; k < 200; ++k) {
        c.taut = leaves(c.ratio);
        const double drawn = std::cos(c.taut) - mu * std::sin(c.taut);
        if (!(drawn > 0)) return c;
        c.ratio = 0.5 * (c.ratio + held / drawn * std::exp(mu * (angle - c.slack - c.taut)));
    }
    c.holds = stiffness < 2 && c.slack + c.taut < angle;
    return c;
}

} // namespace calot::bench
