#include "virtual_operator.hpp"

#include <algorithm>
#include <cmath>

namespace calot::virtual_operator {
namespace {

constexpr double degree = 3.14159265358979323846 / 180;

// A hand's limits: well under what a device must bear (0.3 m/s, 360 and 180 degrees a second).
constexpr double fastest_push = 0.08;         // m/s
constexpr double fastest_turn = 90 * degree;  // rad/s
constexpr double fastest_wheel = 90 * degree; // rad/s
constexpr double hand_lag = 0.08;             // s, until a hand has its speed
constexpr double tremor_period = 0.05;        // s between knots: about 10 Hz, as physiological tremor has
constexpr double wander_period = 0.8;         // s: the eye moves on

} // namespace

// Speeds are estimates, so that a novice takes about half as long again as an expert: NOViSE's operators
// needed 68 and 44 s for their navigation (2016), which began earlier.
Manner manner_of(std::string_view skill) {
    if (skill == "expert") return {};
    if (skill == "novice") {
        Manner m;
        m.skill.push_speed = 0.02;
        m.skill.approach_speed = 0.007;
        m.skill.steer_gain = 0.8;
        m.skill.patience = 3;
        m.skill.gentle_force = 12;
        m.skill.most_force = 22;
        m.reaction = 0.3;
        m.tremor_insertion = 0.0004;
        m.tremor_rotation = m.tremor_wheel = 0.01;
        m.aim_wander = 0.06;
        return m;
    }
    throw Error(CALOT_CODE_INVALID_ARGUMENT, "operator.skill",
                "\"" + std::string(skill) + "\" is not a skill: use expert or novice");
}

void VirtualOperator::init() {
    random_ = host().random();
    manner_ = manner_of(host().settings().text("operator.skill").value_or("expert"));
    pilot_.configure(manner_.skill);
}

void VirtualOperator::sheet(calot_device_sheet& out) {
    const auto size = out.struct_size;
    out = {};
    out.struct_size = size;
    out.title = string("Virtual operator");
    out.in_lockstep = 1;
    out.rate = 1000;
}

void VirtualOperator::configure(const calot_controls& start) {
    start_ = start;
}

void VirtualOperator::activate(const calot_activation& activation) {
    step_ = 1e-9 * static_cast<double>(activation.step_nanoseconds);
    moments_.assign(static_cast<std::size_t>(std::ceil(manner_.reaction / step_)) + 1, {});
    path_.reserve(most_points);
    reset(activation.seed);
}

void VirtualOperator::reset(std::uint64_t seed) {
    seed_ = seed;
    pilot_.reset();
    seen_ = 0;
    path_.clear();
    has_ring_ = has_task_ = is_stopped_ = false;
    insertion_ = start_.insertion, rotation_ = start_.rotation;
    wheel_ = {start_.wheel[0], start_.wheel[1]};
    rates_ = {};
}

Result VirtualOperator::observe(const calot_observation& o) {
    has_task_ = o.task.size > 0;
    is_stopped_ = o.felt.stopped != 0;
    has_ring_ = false;
    path_.clear();
    for (const calot_marker& m : items<calot_marker>(o.markers)) {
        if (m.is_done != 0) continue;
        if (m.kind == CALOT_MARKER_PATH) {
            path_.clear();
            for (std::size_t i = 0; i + 2 < m.polyline.size && path_.size() < most_points; i += 3)
                path_.push_back(vec3(m.polyline.data + i));
        } else if (m.kind == CALOT_MARKER_RING) {
            has_ring_ = true;
            ring_centre_ = vec3(m.position);
            ring_normal_ = normalized(vec3(m.normal));
            ring_radius_ = m.radius;
        }
    }
    moments_[seen_++ % moments_.size()] = {o.view, o.felt.insertion_force};
    return Result::ok();
}

Result VirtualOperator::poll(std::int64_t tick, calot_controls& out) {
    Rates wish;
    // The oldest moment in the buffer is one reaction time old.
    if (has_task_ && !is_stopped_ && seen_ >= moments_.size()) {
        const Moment& then = moments_[seen_ % moments_.size()];
        Sight sight{then.view,    then.insertion_force, path_,       has_ring_,
                    ring_centre_, ring_normal_,         ring_radius_};
        // Looks a little beside what it means to look at.
        const double up = manner_.aim_wander * noise(stream_aim, tick, wander_period);
        const double left = manner_.aim_wander * noise(stream_aim + 1, tick, wander_period);
        const Quat glance = axis_angle({1, 0, 0}, up) * axis_angle({0, 1, 0}, left);
        store(quat(then.view.quaternion) * glance, sight.view.quaternion);
        wish = pilot_.step(sight, {insertion_, wheel_}, step_);
    }
    const double gain = 1 - std::exp(-step_ / hand_lag);
    const auto follow = [&](double& rate, double wished, double fastest) {
        rate += gain * (clamp(wished, -fastest, fastest) - rate);
    };
    follow(rates_.insertion, wish.insertion, fastest_push);
    follow(rates_.rotation, wish.rotation, fastest_turn);
    for (std::size_t i = 0; i < 2; ++i)
        follow(rates_.wheel[i], wish.wheel[i], fastest_wheel);
    if (is_stopped_) rates_ = {};

    insertion_ += step_ * rates_.insertion;
    rotation_ += step_ * rates_.rotation;
    out.insertion = insertion_ + manner_.tremor_insertion * noise(stream_insertion, tick, tremor_period);
    out.rotation = rotation_ + manner_.tremor_rotation * noise(stream_rotation, tick, tremor_period);
    for (std::size_t i = 0; i < 2; ++i) {
        wheel_[i] += step_ * rates_.wheel[i];
        out.wheel[i] = wheel_[i] + manner_.tremor_wheel * noise(stream_wheels + i, tick, tremor_period);
    }
    return Result::ok();
}

Result VirtualOperator::send(const calot_feedback& feedback) {
    is_stopped_ = feedback.stopped != 0;
    return Result::ok();
}

// Smooth noise of about unit deviation, 0 at the case's begin: normal numbers `period` seconds apart,
// blended.
double VirtualOperator::noise(std::uint64_t stream, std::int64_t tick, double period) const {
    const double knots = static_cast<double>(tick < 0 ? 0 : tick) * step_ / period;
    const auto knot = static_cast<std::uint64_t>(knots);
    const double t = knots - static_cast<double>(knot);
    const double before = knot == 0 ? 0 : random_.normal(seed_, stream, knot);
    const double after = random_.normal(seed_, stream, knot + 1);
    return before + t * t * (3 - 2 * t) * (after - before);
}

void VirtualOperator::save(StateWriter& to) const {
    pilot_.save(to);
    to.value(seed_), to.value(seen_);
    for (const Moment& m : moments_) {
        to.values<double>(m.view.position), to.values<double>(m.view.quaternion);
        to.value(m.insertion_force);
    }
    to.value<std::uint64_t>(path_.size());
    for (const Vec3& p : path_)
        to.value(p);
    to.value(has_ring_), to.value(has_task_), to.value(is_stopped_);
    to.value(ring_centre_), to.value(ring_normal_), to.value(ring_radius_);
    to.value(insertion_), to.value(rotation_), to.values<double>(wheel_);
    to.value(rates_.insertion), to.value(rates_.rotation), to.values<double>(rates_.wheel);
}

void VirtualOperator::load(StateReader& from) {
    pilot_.load(from);
    from.value(seed_), from.value(seen_);
    for (Moment& m : moments_) {
        from.values<double>(m.view.position), from.values<double>(m.view.quaternion);
        from.value(m.insertion_force);
    }
    const auto points = from.value<std::uint64_t>();
    if (points > most_points) StateReader::corrupt("holds a path that is too long");
    path_.resize(points);
    for (Vec3& p : path_)
        from.value(p);
    for (bool* flag : {&has_ring_, &has_task_, &is_stopped_})
        *flag = from.value<std::uint8_t>() != 0;
    from.value(ring_centre_), from.value(ring_normal_), from.value(ring_radius_);
    from.value(insertion_), from.value(rotation_), from.values<double>(wheel_);
    from.value(rates_.insertion), from.value(rates_.rotation), from.values<double>(rates_.wheel);
}

} // namespace calot::virtual_operator
