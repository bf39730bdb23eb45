#include "bench/press_body.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::bench {

namespace {
constexpr int substeps = 10; // of the body in a tick
}

double PressScene::target(double t) const {
    const auto smooth = [](double s) {
        s = std::clamp(s, 0.0, 1.0);
        return s * s * (3 - 2 * s);
    };
    const double in = gap + depth;
    if (t < 0.8) return in * smooth(t / 0.3);
    if (t < 1.4) return in * 0.5 * (1 + std::cos(2 * std::numbers::pi * 5 * (t - 0.8)));
    return in * (1 - smooth((t - 1.9) / 0.3));
}

double PressScene::target_velocity(double t) const {
    constexpr double h = 1e-6;
    return (target(t + h) - target(t - h)) / (2 * h);
}

PressReference press_reference(const PressScene& p, double rate) {
    PressReference out;
    const int inner = static_cast<int>(std::ceil(1 / rate / 2e-6));
    const double h = 1 / rate / inner;
    double x = 0, v = 0, y = p.gap, u = 0; // tool and body's surface
    out.tool.push_back(x), out.force.push_back(0);
    for (int k = 0; k < static_cast<int>(PressScene::length * rate); ++k) {
        double impulse = 0;
        for (int i = 0; i < inner; ++i) {
            const double t = k / rate + i * h;
            const double drive =
                p.drive_stiffness * (p.target(t) - x) + p.drive_damping * (p.target_velocity(t) - v);
            v += h * std::clamp(drive, -p.drive_limit, p.drive_limit) / p.tool_mass;
            u += h * (-p.body_stiffness * (y - p.gap) - p.body_damping * u) / p.body_mass;
            const double closing = v - u - std::max(0.0, y - x) / h;
            if (closing > 0) {
                const double j = closing / (1 / p.tool_mass + 1 / p.body_mass);
                v -= j / p.tool_mass, u += j / p.body_mass;
                impulse += j;
            }
            x += h * v, y += h * u;
        }
        out.tool.push_back(x), out.force.push_back(impulse * rate);
    }
    return out;
}

PressBody::PressBody(const PressScene& scene, double tick) : scene_(scene), tick_(tick) {}

// Implicit Euler.
PressBody::State PressBody::stepped(State s, double dt, double impulse) const {
    const double v = (scene_.body_mass * s.v - dt * scene_.body_stiffness * s.x + impulse) /
                     (scene_.body_mass + dt * scene_.body_damping + dt * dt * scene_.body_stiffness);
    return {s.x + dt * v, v};
}

double PressBody::free_surface() const {
    return stepped(now_, tick_, 0).x;
}

double PressBody::compliance() const {
    return stepped({}, tick_, 1).x;
}

void PressBody::end_tick(double impulse) {
    since_.push_back(impulse);
    now_ = stepped(now_, tick_, impulse);
    if (since_.size() < 6) return;
    // The step of the three ticks before these three, seen from now on; on from there.
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < substeps; ++i)
            seen_ = stepped(seen_, tick_ / substeps, since_[static_cast<std::size_t>(k)] / substeps);
    since_.erase(since_.begin(), since_.begin() + 3);
    now_ = seen_;
    for (const double j : since_)
        now_ = stepped(now_, tick_, j);
}

} // namespace calot::bench
