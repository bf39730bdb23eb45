#include "simulation/shaft.hpp"

#include "simulation/plugin_call.hpp"

#include <calot/math.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace calot::simulation {

namespace {

constexpr double dt = 1e-3; // s, one tick

// Ticks without device and procedure before the first. The slowest motion is a bending section that falls on
// the wall: EI (1/l)^4 against drag, about 0.1 s.
constexpr std::int64_t settling_ticks = 500;

// m that a node may have gone since contacts were found before they are found anew, and of that at the tick's
// begin. At 0.3 m/s, the fastest insertion, contacts of a tick ago still do; what snaps through a narrow
// place goes at 1 to 2 m/s, a buckled shaft let go at 10 m/s.
constexpr double holds_for = 1e-3, old_at_begin = 0.5e-3;
// In so many parts; the last takes what is left of the tick.
constexpr int most_parts = 16;

// m that contacts are known ahead: somewhat farther than they hold for. A rod that can't end a step early may
// go farther than that: where it is fast it is told of what it comes to in the two ticks that contacts are
// old.
constexpr double known_ahead = 1.2e-3, far_ahead = 0.004, farthest_ahead = 0.03;
constexpr double fast = 0.4;          // m/s
constexpr double look_ahead = 2.5e-3; // s

// Ticks between two looks at what warmth, twist and instruments make of the shaft.
constexpr std::int64_t conditioning_period = 50;

calot_reals reals(std::span<const double> values) {
    return {values.data(), values.size()};
}
calot_reals_out out_reals(std::vector<double>& values) {
    return {values.data(), values.size()};
}

} // namespace

Shaft::Shaft(const Plugin& plugin, const World& world, std::uint32_t nodes, std::uint32_t most_contacts,
             bool threaded, bool measure, std::uint64_t seed, const Start& start, const CouplingGains& gains)
    : plugin_(plugin), rod_(functions<calot_rod>(plugin)), world_(world), endoscope_(world.endoscope, nodes),
      gains_(gains), collision_(world.surfaces, endoscope_.radii(), most_contacts, threaded),
      position_(std::size_t{3} * nodes), velocity_(position_.size()), frame_(std::size_t{4} * (nodes - 1)),
      angular_velocity_(std::size_t{3} * (nodes - 1)), impulse_(std::size_t{3} * most_contacts),
      contacts_(most_contacts) {
    const calot_pose& exit = *world.anatomy.find(world.scene.guide)->pose;
    guide_.present = 1;
    std::copy_n(exit.position, 3, guide_.exit);
    store(rotate(quat(exit.quaternion), {0, 0, 1}), guide_.direction);
    out_.struct_size = sizeof out_;
    out_.position = out_reals(position_);
    out_.velocity = out_reals(velocity_);
    out_.frame = out_reals(frame_);
    out_.angular_velocity = out_reals(angular_velocity_);

    configure(start, seed, most_contacts);
    if (measure) {
        cost_ = extension<calot_cost>(plugin_, CALOT_EXTENSION_COST);
        if (cost_ != nullptr) cost_->enable(plugin_.instance->self, 1);
    }
    look_up();
    for (std::int64_t tick = -settling_ticks; tick < 0; ++tick)
        advance(tick, origin_, world.scene.gravity);
    slip_ = {};
}

Shaft::~Shaft() {
    try {
        call(plugin_, "rod.deactivate", plugin_.instance->deactivate);
    } catch (const host::PluginError&) { // the case is over; there is nobody left to tell
    }
}

void Shaft::configure(const Start& start, std::uint64_t seed, std::uint32_t most_contacts) {
    std::vector<double> nodes;
    try {
        nodes = endoscope_.laid_along(guide_, world_.anatomy.find(start.path)->points, start.insertion);
    } catch (const std::invalid_argument& error) {
        throw host::UserError(world_.scene.file, "start",
                              std::string(error.what()) + "; start with less inside");
    }
    const std::vector<double> frames = endoscope_.frames_along(nodes, start.rotation);
    position_ = nodes;
    for (std::size_t k = 0; k < start.instruments.size(); ++k)
        if (const InstrumentDatasheet& i = start.instruments[k]; !i.id.empty())
            endoscope_.set_channel(k, {.flexural_rigidity = i.flexural_rigidity,
                                       .mass_per_length = i.mass_per_length,
                                       .reach = endoscope_.length()});
    endoscope_.start_warm(first_segment()); // what lies in the patient has been there for a while
    endoscope_.set_bending(start.wheels.data());
    calot_rod_setup setup{};
    setup.struct_size = sizeof setup;
    setup.node_count = endoscope_.nodes();
    setup.position = reals(nodes);
    setup.frame = reals(frames);
    setup.length = reals(endoscope_.lengths());
    setup.rest_darboux = reals(endoscope_.rest_darboux());
    setup.segments = endoscope_.segments();
    setup.guide = guide_;
    call(plugin_, "rod.configure", rod_.configure, &setup);
    calot_activation activation{};
    activation.struct_size = sizeof activation;
    activation.step_nanoseconds = 1'000'000;
    activation.seed = seed;
    activation.max_contacts = most_contacts;
    call(plugin_, "rod.activate", plugin_.instance->activate, &activation);
    call(plugin_, "rod.read", rod_.read, &out_);
    const Vec3 base = vec3(nodes.data()) - vec3(guide_.exit);
    origin_ = {dot(base, vec3(guide_.direction)), 0};
    start_rotation_ = start.rotation;
    target_ = origin_;
}

// Segments that lie in the guide as a whole touch nothing.
std::size_t Shaft::first_segment() const {
    const Vec3 exit = vec3(guide_.exit), inwards = vec3(guide_.direction);
    std::size_t first = 0;
    while (first + 2 < endoscope_.nodes() && dot(vec3(&position_[3 * (first + 1)]) - exit, inwards) < 0)
        ++first;
    return first;
}

double Shaft::reach() const {
    if (ends_early_) return known_ahead;
    double fastest2 = 0;
    for (std::size_t i = 0; i < velocity_.size(); i += 3) {
        const double* v = &velocity_[i];
        fastest2 = std::max(fastest2, v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
    if (fastest2 <= fast * fast) return known_ahead;
    return std::clamp(look_ahead * std::sqrt(fastest2), far_ahead, farthest_ahead);
}

void Shaft::look_up() {
    collision_.begin(position_, reach(), first_segment());
}

void Shaft::advance(std::int64_t tick, const std::array<double, 2>& target,
                    const std::array<double, 3>& gravity) {
    contacts_.begin_tick();
    coupling_force_ = coupling_torque_ = rod_seconds_ = constraint_seconds_ = 0;
    const ContactList* contacts = &collision_.finish();
    double gone = collision_.farthest_since(position_);
    look_up();
    if (gone > old_at_begin) {
        contacts = &collision_.finish();
        gone = 0;
    }
    double left = dt;
    for (int part = 1;; ++part) {
        const double elapsed =
            step_rod(tick, target, gravity, *contacts, left, part < most_parts ? holds_for - gone : 0);
        contacts_.add(*contacts, impulse_);
        coupling_force_ += elapsed / dt * out_.insertion_force;
        coupling_torque_ += elapsed / dt * out_.rotation_torque;
        left -= elapsed;
        if (left <= 1e-9 * dt) break;
        collision_.finish();
        look_up();
        contacts = &collision_.finish();
        gone = 0;
    }

    // Beyond the coupling's limit the hand slides over the shaft, so that it grips anew at once when it turns
    // back.
    const double at[2] = {out_.insertion, out_.rotation};
    for (std::size_t k = 0; k < 2; ++k) {
        target_[k] = target[k];
        const double most = 1.05 * gains_.limit[k] / gains_.stiffness[k];
        const double excess = target_[k] - std::clamp(target_[k], at[k] - most, at[k] + most);
        slip_[k] += excess;
        target_[k] -= excess;
    }
}

double Shaft::step_rod(std::int64_t tick, const std::array<double, 2>& target,
                       const std::array<double, 3>& gravity, const ContactList& contacts, double left,
                       double farthest) {
    calot_rod_input in{};
    in.struct_size = sizeof in;
    in.tick = tick;
    std::copy(gravity.begin(), gravity.end(), in.gravity);
    in.base.mode = CALOT_END_COUPLED;
    in.tip.mode = CALOT_END_FREE;
    const auto coupling = [&](std::size_t axis) {
        const double velocity = (target[axis] - target_[axis]) / dt;
        return calot_coupling{.target = target_[axis] + (dt - left) * velocity,
                              .velocity = velocity,
                              .stiffness = gains_.stiffness[axis],
                              .damping = gains_.damping[axis],
                              .limit = gains_.limit[axis]};
    };
    in.base.insertion = coupling(0);
    in.base.rotation = coupling(1);
    in.rest_darboux = reals(endoscope_.rest_darboux());
    in.contacts = {contacts.contact.data(), contacts.count, sizeof(calot_contact)};
    in.duration = left, in.farthest = farthest;
    out_.contact_impulse = {impulse_.data(), 3 * contacts.count};
    out_.elapsed = 0;

    const auto begin = std::chrono::steady_clock::now();
    call(plugin_, "rod.step", rod_.step, &in, &out_);
    rod_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (cost_ != nullptr) {
        const std::uint32_t parts = cost_->part_count(plugin_.instance->self);
        for (std::uint32_t i = 0; i < parts; ++i) {
            calot_string name{};
            double seconds = 0;
            cost_->part(plugin_.instance->self, i, &name, &seconds);
            if (view(name) == "constraints") constraint_seconds_ += seconds;
        }
    }
    const std::span<const double> impulses(impulse_.data(), 3 * contacts.count);
    require_finite(plugin_, "rod.step", "output.position", position_);
    require_finite(plugin_, "rod.step", "output.velocity", velocity_);
    require_finite(plugin_, "rod.step", "output.frame", frame_);
    require_finite(plugin_, "rod.step", "output.angular_velocity", angular_velocity_);
    require_finite(plugin_, "rod.step", "output.contact_impulse", impulses);
    const double scalars[] = {out_.insertion, out_.rotation, out_.insertion_force, out_.rotation_torque};
    require_finite(plugin_, "rod.step", "output.insertion", scalars);
    if (!(out_.elapsed >= 0 && out_.elapsed <= left * (1 + 1e-9)))
        fail(plugin_, "rod.step", CALOT_OK, CALOT_CODE_OUT_OF_RANGE, "output.elapsed",
             "must lie between 0 and the step's duration; the plugin is broken");
    for (std::size_t i = 0; i < contacts.count; ++i) {
        contact_hash_.add(contacts.contact[i].id);
        contact_hash_.add(impulses.subspan(3 * i, 3));
    }
    ends_early_ = out_.elapsed > 0;
    return ends_early_ ? out_.elapsed : left;
}

std::array<double, 2> Shaft::take_slip() {
    return std::exchange(slip_, {});
}

void Shaft::step(std::int64_t tick, const std::array<double, 2>& hand, const double wheel[2],
                 const std::uint32_t brake[2], Snapshot& s) {
    endoscope_.steer(wheel, brake, frame_, dt);
    if (tick % conditioning_period == 0 &&
        endoscope_.condition(first_segment(), frame_, conditioning_period * dt)) {
        const calot_rod_segments segments = endoscope_.segments();
        call(plugin_, "rod.set_segments", rod_.set_segments, &segments);
    }
    // The handle stays outside, and the tip does not leave the patient.
    const double length = endoscope_.length();
    const double asked = std::clamp(origin_[0] + hand[0], -length + 0.01, -0.01);
    slip_[0] += origin_[0] + hand[0] - asked;
    advance(tick, {asked, origin_[1] + hand[1]}, s.gravity);
    report(s);
    show(s);
}

void Shaft::report(Snapshot& s) const {
    s.contact_count = std::min(contacts_.count(), s.contact.size());
    s.contacts_left_out = contacts_.left_out();
    contacts_.write(dt, {s.contact.data(), s.contact_count});
    s.tissue_force = s.self_force = 0;
    for (std::size_t i = 0; i < s.contact_count; ++i) {
        const calot_contact_report& r = s.contact[i];
        (r.organ == ContactOwner::shaft ? s.self_force : s.tissue_force) += norm(vec3(r.force));
    }
    s.penetration.now = contacts_.deepest();
    s.penetration.deepest = std::max(s.penetration.deepest, contacts_.deepest());
    s.penetration.ticks_over_1mm += contacts_.deepest() > 1e-3;
    s.cost.rod = rod_seconds_;
    s.cost.constraints = constraint_seconds_;
    s.cost.collision = contacts_.seconds();
    s.cost.self_contact = contacts_.self_seconds();
}

void Shaft::show(Snapshot& s) const {
    s.position = position_;
    s.velocity = velocity_;
    s.frame = frame_;
    s.angular_velocity = angular_velocity_;
    s.insertion = endoscope_.length() + out_.insertion;
    s.rotation = start_rotation_ + out_.rotation;
    const auto bent = endoscope_.angulation(frame_);
    s.bending[0] = bent[0];
    s.bending[1] = bent[1];
    s.bending_energy = out_.bending_energy;
    s.twist_energy = out_.twist_energy;
    s.kinetic_energy = out_.kinetic_energy;
    s.camera = endoscope_.camera(position_, frame_);
    s.camera_twist = endoscope_.camera_twist(velocity_, angular_velocity_);
    s.feedback.insertion_force = coupling_force_; // the hand is pushed back as hard as it pushes in
    s.feedback.rotation_torque = coupling_torque_;
    const auto torque = endoscope_.wheel_torque();
    s.feedback.wheel_torque[0] = torque[0];
    s.feedback.wheel_torque[1] = torque[1];
}

} // namespace calot::simulation
