#include "bench/bench_rod.hpp"

#include <cmath>

namespace calot::bench {

UniformRod UniformRod::of(const RodOptions& o, UniformRod d) {
    return {o.nodes.value_or(d.nodes),
            o.dt.value_or(d.dt),
            o.bending.value_or(d.bending),
            o.torsion.value_or(d.torsion),
            o.length.value_or(d.length),
            o.radius.value_or(d.radius),
            o.mass_per_length.value_or(d.mass_per_length)};
}

UniformRod UniformRod::at_rest(const RodOptions& o, UniformRod d) {
    UniformRod rod = of(o, d);
    const double w = rod.lowest_frequency(), sensible = std::clamp(w, 1.0, std::max(1.0, 3 / rod.length));
    if (!o.mass_per_length)
        rod.mass_per_length = std::max(1e-6, rod.mass_per_length * std::pow(w / sensible, 2));
    if (!o.dt) {
        const double time = 1 / rod.lowest_frequency();
        rod.dt = std::round(1e9 * std::clamp(0.1 * time, 1e-5, std::clamp(1e-4 * time, 1e-3, 1e-2))) * 1e-9;
    }
    return rod;
}

double UniformRod::lowest_frequency() const {
    return 3.516 * std::sqrt(bending / mass_per_length) / (length * length);
}

std::vector<double> straight_line(const UniformRod& rod, const Vec3& base, const Quat& orientation) {
    std::vector<double> p;
    for (int i = 0; i < rod.nodes; ++i) {
        const Vec3 x = base + rotate(orientation, {0, 0, rod.length * i / (rod.nodes - 1)});
        p.insert(p.end(), {x.x, x.y, x.z});
    }
    return p;
}

std::vector<double> same_frames(const UniformRod& rod, const Quat& q) {
    std::vector<double> f;
    for (int j = 0; j + 1 < rod.nodes; ++j)
        f.insert(f.end(), {q.w, q.x, q.y, q.z});
    return f;
}

BenchRod::BenchRod(const MakeInstance& make, Setup setup) : instance_(make()), setup_(std::move(setup)) {
    const UniformRod& rod = setup_.rod;
    const auto n = static_cast<std::size_t>(rod.nodes), m = n - 1;
    error_.struct_size = sizeof error_;
    const auto each = [&](double v) { return std::vector<double>(m, v); };
    const auto view = [](const std::vector<double>& v) { return calot_reals{v.data(), v.size()}; };
    const auto mass = each(rod.mass_per_length), radius = each(rod.radius), bending = each(rod.bending);
    const auto torsion = each(rod.torsion), damping = each(setup_.bending_damping),
               twist_damping = each(setup_.torsion_damping), friction = each(setup_.friction);
    const auto length = each(rod.length / static_cast<double>(m));
    drag_ = each(setup_.drag * rod.mass_per_length);

    calot_rod_setup s{};
    s.struct_size = sizeof s;
    s.node_count = static_cast<std::uint32_t>(n);
    s.position = view(setup_.position), s.frame = view(setup_.frame),
    s.rest_darboux = view(setup_.rest_darboux);
    s.length = view(length);
    s.segments = {sizeof s.segments, view(mass),    view(radius),        view(bending), view(bending),
                  view(torsion),     view(damping), view(twist_damping), view(drag_),   view(friction)};
    if (setup_.guide) s.guide = *setup_.guide;
    check(functions().configure(self(), &s, &error_), "rod.configure");

    calot_activation a{};
    a.struct_size = sizeof a;
    a.step_nanoseconds = std::llround(rod.dt * 1e9);
    a.seed = 1;
    a.max_contacts = setup_.max_contacts;
    check(instance_.abi()->activate(self(), &a, &error_), "rod.activate");

    position_.resize(3 * n), velocity_.resize(3 * n), frame_.resize(4 * m), angular_velocity_.resize(3 * m);
    impulse_.resize(std::size_t{3} * setup_.max_contacts);
    input.struct_size = sizeof input;
    input.base.pose.quaternion[0] = input.tip.pose.quaternion[0] = 1;
    output_.struct_size = sizeof output_;
    output_.position = {position_.data(), position_.size()};
    output_.velocity = {velocity_.data(), velocity_.size()};
    output_.frame = {frame_.data(), frame_.size()};
    output_.angular_velocity = {angular_velocity_.data(), angular_velocity_.size()};
    refresh();
}

void BenchRod::refresh() {
    output_.contact_impulse = {};
    check(functions().read(self(), &output_, &error_), "rod.read");
}

void BenchRod::check(calot_status status, const char* function) const {
    if (status == CALOT_OK) return;
    throw host::PluginError(instance_.id(), function, status, error_.code, error_.field, error_.message);
}

void BenchRod::clamp_base(const Vec3& position, const Quat& orientation) {
    input.base.mode = CALOT_END_CLAMPED;
    input.base.pose = pose(position, orientation);
}
void BenchRod::clamp_tip(const Vec3& position, const Quat& orientation) {
    input.tip.mode = CALOT_END_CLAMPED;
    input.tip.pose = pose(position, orientation);
}
void BenchRod::load_base(const Vec3& force, const Vec3& torque) {
    input.base.mode = CALOT_END_LOADED;
    store(force, input.base.wrench.force), store(torque, input.base.wrench.torque);
}
void BenchRod::load_tip(const Vec3& force, const Vec3& torque) {
    input.tip.mode = CALOT_END_LOADED;
    store(force, input.tip.wrench.force), store(torque, input.tip.wrench.torque);
}

void BenchRod::set_drag(double drag) {
    drag_.assign(drag_.size(), drag * setup_.rod.mass_per_length);
    calot_rod_segments s{};
    s.struct_size = sizeof s;
    s.drag = {drag_.data(), drag_.size()};
    check(functions().set_segments(self(), &s, &error_), "rod.set_segments");
}

void BenchRod::take_part(std::span<const calot_contact> contacts) {
    input.contacts = {contacts.data(), contacts.size(), sizeof(calot_contact)};
    output_.contact_impulse = {impulse_.data(), 3 * contacts.size()};
    check(functions().step(self(), &input, &output_, &error_), "rod.step");
}

void BenchRod::step(std::span<const calot_contact> contacts) {
    take_part(contacts);
    ++input.tick;
}

void BenchRod::step_in_parts(const std::function<std::span<const calot_contact>()>& find, double farthest) {
    constexpr int most_parts = 32;
    const calot_rod_end base = input.base;
    double left = setup_.rod.dt;
    for (int part = 1; left > 1e-9 * setup_.rod.dt; ++part) {
        input.duration = left, input.farthest = part < most_parts ? farthest : 0;
        take_part(find());
        const double elapsed = output_.elapsed > 0 ? output_.elapsed : left;
        left -= elapsed;
        for (calot_coupling* c : {&input.base.insertion, &input.base.rotation})
            c->target += elapsed * c->velocity;
    }
    input.base = base;
    input.duration = input.farthest = 0;
    ++input.tick;
}

bool BenchRod::settle(double speed, double longest) {
    const double dt = setup_.rod.dt, quiet = std::max(20 * dt, 0.3 / setup_.rod.lowest_frequency());
    const double end = seconds() + std::max(longest, 100 * dt);
    double still = 0;
    while (still < quiet && seconds() < end) {
        step();
        still = top_speed() < speed ? still + dt : 0;
    }
    return still >= quiet;
}

std::vector<Vec3> BenchRod::positions() const {
    std::vector<Vec3> all(static_cast<std::size_t>(nodes()));
    for (int i = 0; i < nodes(); ++i)
        all[static_cast<std::size_t>(i)] = position(i);
    return all;
}

double BenchRod::top_speed() const {
    double top = 0;
    for (int i = 0; i < nodes(); ++i)
        top = std::max(top, norm(velocity(i)));
    return top;
}

double BenchRod::arc_length() const {
    double sum = 0;
    for (int i = 0; i + 1 < nodes(); ++i)
        sum += norm(position(i + 1) - position(i));
    return sum;
}

double BenchRod::energy() const {
    return output_.kinetic_energy + output_.bending_energy + output_.twist_energy + output_.gravity_energy;
}

const calot_cost* BenchRod::cost() const {
    static constexpr std::string_view id = CALOT_EXTENSION_COST;
    return static_cast<const calot_cost*>(instance_.abi()->extension(self(), {id.data(), id.size()}));
}

double end_twist(const BenchRod& rod, const Quat& clamp) {
    const auto turn = [](const Quat& a, const Quat& b) {
        const Quat p = conjugate(a) * b;
        return 2 * std::atan2(p.w < 0 ? -p.z : p.z, std::abs(p.w));
    };
    double angle = turn(clamp, rod.frame(0)), last = 0;
    for (int j = 0; j + 2 < rod.nodes(); ++j)
        angle += last = turn(rod.frame(j), rod.frame(j + 1));
    return angle + 0.5 * last;
}

} // namespace calot::bench
