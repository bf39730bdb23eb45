#include "plot/ticks.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace calot::plot {

namespace {

std::string text(double value) {
    std::array<char, 40> buffer;
    const auto end =
        std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, 6).ptr;
    return {buffer.data(), end};
}

double round_step(double rough) {
    const double power = std::pow(10.0, std::floor(std::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= rough * (1 - 1e-9)) return factor * power;
    return 10 * power;
}

} // namespace

Axis make_axis(double low, double high, bool is_log, int count) {
    Axis axis;
    axis.is_log = is_log;
    if (!(high > low)) {
        const double half = low == 0 ? 1 : 0.5 * std::abs(low);
        low -= half, high += half;
    }
    const double margin = 0.04 * (high - low);
    axis.low = low - margin, axis.high = high + margin;
    double step = round_step((axis.high - axis.low) / std::max(count, 2));
    if (is_log) step = std::max(1.0, std::ceil(step));
    if (is_log && axis.high - axis.low < 2) { // so that a decade has more than its ends
        for (int power = static_cast<int>(std::floor(axis.low)); power <= axis.high; ++power)
            for (const double factor : {1.0, 2.0, 5.0})
                if (const double tick = power + std::log10(factor); tick >= axis.low && tick <= axis.high) {
                    axis.ticks.push_back(tick);
                    axis.labels.push_back(text(factor * std::pow(10.0, power)));
                }
        return axis;
    }
    const double first = std::ceil(axis.low / step - 1e-9);
    for (double k = first; k * step <= axis.high * (1 + 1e-12) + 1e-300 && axis.ticks.size() < 100; ++k) {
        const double tick = k * step;
        axis.ticks.push_back(tick);
        axis.labels.push_back(
            text(is_log ? std::pow(10.0, tick) : (std::abs(tick) < 1e-9 * step ? 0 : tick)));
    }
    return axis;
}

} // namespace calot::plot
