#include "pilot.hpp"

#include <algorithm>
#include <cmath>

namespace calot::virtual_operator {
namespace {

constexpr double degree = 3.14159265358979323846 / 180;

// How far ahead on the path a person looks: farther in a lumen, where the walls guide, than near the ring.
constexpr double far_ahead = 0.035, near_ahead = 0.025; // m
// From here on the ring itself is aimed at, not the path.
constexpr double ring_in_reach = 0.035; // m
// The part of the shaft that the wheels bend: about this long on any gastroscope (75 to 100 mm).
constexpr double bending_length = 0.09; // m
// Wheels: no more than the angulation of gastroscopes allows.
constexpr double wheel_up = 200 * degree, wheel_down = -85 * degree, wheel_side = 95 * degree;
constexpr double withdraw_by = 0.02, withdraw_speed = 0.025; // m, m/s
// A bend of this size is worth turning the shaft for, so that the large wheel makes it.
constexpr double bend_worth_turning = 35 * degree;
constexpr double turn_speed = 15 * degree; // rad/s

double smooth_step(double from, double to, double x) {
    const double t = clamp((x - from) / (to - from), 0, 1);
    return t * t * (3 - 2 * t);
}

Vec3 direction_at(std::span<const Vec3> line, double along) {
    return normalized(point_at(line, along + 0.004) - point_at(line, along - 0.004));
}

} // namespace

Vec3 point_at(std::span<const Vec3> line, double along) {
    if (line.empty()) return {};
    if (line.size() == 1) return line[0];
    for (std::size_t i = 1; i < line.size(); ++i) {
        const Vec3 piece = line[i] - line[i - 1];
        const double size = norm(piece);
        if (along <= size || i + 1 == line.size()) return line[i - 1] + (size > 0 ? along / size : 0) * piece;
        along -= size;
    }
    return line.back();
}

double length(std::span<const Vec3> line) {
    double sum = 0;
    for (std::size_t i = 1; i < line.size(); ++i)
        sum += norm(line[i] - line[i - 1]);
    return sum;
}

std::array<double, 2> bearing(const calot_pose& view, const Vec3& point) {
    const Vec3 p = to_body(view, point);
    const double aside = std::hypot(p.x, p.y);
    if (aside == 0) return {0, 0};
    const double angle = std::atan2(aside, p.z);
    return {angle * p.y / aside, angle * p.x / aside};
}

// Arc length of the path's point nearest to the tip; once known, only its neighbourhood is looked at, so that
// a path that comes back near itself is not cut short.
double Pilot::find_progress(const Sight& sight) const {
    const Vec3 tip = vec3(sight.view.position);
    double best = 1e300, found = 0, along = 0;
    for (std::size_t i = 1; i < sight.path.size(); ++i) {
        const Vec3 piece = sight.path[i] - sight.path[i - 1];
        const double size = norm(piece);
        if (size == 0) continue;
        const double t = clamp(dot(tip - sight.path[i - 1], piece) / (size * size), 0, 1);
        const double here = along + t * size;
        const double away = norm(tip - sight.path[i - 1] - t * piece);
        const bool is_near = state_.progress < 0 || std::abs(here - state_.progress) < 0.05;
        if (is_near && away < best) best = away, found = here;
        along += size;
    }
    return best < 1e300 ? found : std::max(state_.progress, 0.0);
}

// Where to look: along the path; near the ring at its centre; in the ring straight on. height: of the tip
// above the ring's plane, m.
Vec3 Pilot::aim(const Sight& sight, double height) const {
    const Vec3 tip = vec3(sight.view.position);
    if (sight.has_ring) {
        if (state_.mode == Mode::through)
            return sight.ring_centre + (std::max(height, 0.0) + 0.04) * sight.ring_normal;
        const double away = norm(tip - sight.ring_centre);
        // Never at what is right before the lens: a little beyond the ring, the more the nearer it is.
        if (away < ring_in_reach || sight.path.empty())
            return sight.ring_centre + std::max(0.004, 0.03 - away) * sight.ring_normal;
        if (away < 2 * ring_in_reach) return point_at(sight.path, state_.progress + near_ahead);
    }
    return point_at(sight.path, state_.progress + far_ahead);
}

// How much the bending section has to bend between where it begins and the aim, rad: what a person expects,
// and the reason not to turn the wheels on and on when a wall holds the tip.
double Pilot::needed_bend(const Sight& sight, const Vec3& target) const {
    if (sight.path.size() < 2) return wheel_side;
    const Vec3 before = direction_at(sight.path, std::max(state_.progress - bending_length, 0.0));
    const Vec3 after = normalized(target - vec3(sight.view.position));
    return std::acos(clamp(dot(before, after), -1, 1));
}

Rates Pilot::step(const Sight& sight, const Hands& hands, double dt) {
    State& s = state_;
    if (sight.path.size() < 2 && !sight.has_ring) return {};
    if (s.mode == Mode::withdraw) return withdraw(hands);

    const Vec3 tip = vec3(sight.view.position);
    const double height = sight.has_ring ? dot(tip - sight.ring_centre, sight.ring_normal) : -1;
    const Vec3 aside = tip - sight.ring_centre - height * sight.ring_normal;
    s.progress = find_progress(sight);
    if (s.mode == Mode::follow && sight.has_ring && height > -0.004 && norm(aside) < sight.ring_radius)
        s.mode = Mode::through;
    else if (s.mode == Mode::through && height < -0.01)
        s.mode = Mode::follow;

    const Vec3 target = aim(sight, height);
    const auto error = bearing(sight.view, target);
    const double off = std::hypot(error[0], error[1]);

    Rates rates;
    // Wheels: turn the view's axis onto the aim.
    const double most_bend = 1.3 * needed_bend(sight, target) + 25 * degree;
    const double low[2] = {wheel_down, -wheel_side}, high[2] = {wheel_up, wheel_side};
    const double bend = std::hypot(hands.wheel[0], hands.wheel[1]);
    for (std::size_t i = 0; i < 2; ++i) {
        rates.wheel[i] = skill_.steer_gain * error[i];
        const bool is_outwards = rates.wheel[i] * hands.wheel[i] > 0;
        if (is_outwards && bend > most_bend) rates.wheel[i] = 0;
        if ((hands.wheel[i] >= high[i] && rates.wheel[i] > 0) ||
            (hands.wheel[i] <= low[i] && rates.wheel[i] < 0))
            rates.wheel[i] = 0;
    }

    // Shaft: bring a large bend onto the large wheel, which is the stronger. Turning the shaft right-handed
    // by an angle takes the body's left to its up, so a direction fixed in the world falls back by as much.
    if (bend > bend_worth_turning && s.mode == Mode::follow) {
        const double from_up = std::atan2(-hands.wheel[1], hands.wheel[0]);
        rates.rotation = clamp(0.5 * from_up, -turn_speed, turn_speed);
        rates.wheel[0] -= rates.rotation * hands.wheel[1];
        rates.wheel[1] += rates.rotation * hands.wheel[0];
    }

    // Push: only where one looks the right way, and no harder than is good for the patient.
    const bool is_near_ring = sight.has_ring && norm(tip - sight.ring_centre) < 2 * ring_in_reach;
    const double full = is_near_ring ? skill_.approach_speed : skill_.push_speed;
    const double aligned = 1 - smooth_step(12 * degree, 40 * degree, off);
    const double gentle = 1 - smooth_step(skill_.gentle_force, skill_.most_force, sight.insertion_force);
    rates.insertion = full * std::max(aligned, is_near_ring ? 0.0 : 0.15) * gentle;

    // No way on for a while: draw back and try again.
    const double reached = s.mode == Mode::through ? length(sight.path) + height : s.progress;
    if (reached > s.best + 0.002)
        s.best = reached, s.idle_seconds = 0;
    else
        s.idle_seconds += dt;
    if (s.idle_seconds > skill_.patience) {
        s.mode = Mode::withdraw;
        s.withdraw_to = hands.insertion - withdraw_by * (1 + 0.5 * (s.tries % 4));
        ++s.tries;
    }
    return rates;
}

Rates Pilot::withdraw(const Hands& hands) {
    State& s = state_;
    if (hands.insertion <= s.withdraw_to) {
        s.mode = Mode::follow;
        s.best = -1, s.idle_seconds = 0;
        return {};
    }
    Rates rates;
    rates.insertion = -withdraw_speed;
    // Loosens the bend a little, and turns the shaft to and fro: what stuck should not stick in the same way.
    for (std::size_t i = 0; i < 2; ++i)
        rates.wheel[i] = -0.4 * hands.wheel[i];
    rates.rotation = (s.tries % 2 == 0 ? 1 : -1) * turn_speed;
    return rates;
}

void Pilot::save(StateWriter& to) const {
    const State& s = state_;
    to.value(s.mode), to.value(s.progress), to.value(s.best), to.value(s.idle_seconds);
    to.value(s.withdraw_to), to.value(s.tries);
}

void Pilot::load(StateReader& from) {
    State s;
    from.value(s.mode), from.value(s.progress), from.value(s.best), from.value(s.idle_seconds);
    from.value(s.withdraw_to), from.value(s.tries);
    if (s.mode > Mode::withdraw) StateReader::corrupt("has an unknown mode");
    state_ = s;
}

} // namespace calot::virtual_operator
