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
      position_(3 * nodes), velocity_(3 * nodes), frame_(4 * (nodes - 1)), angular_velocity_(3 * (nodes - 1)),
      impulse_(3 * most_contacts) {
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
    collision_.begin(position_, velocity_, first_segment());
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

void Shaft::advance(std::int64_t tick, const std::array<double, 2>& target,
                    const std::array<double, 3>& gravity) {
    contacts_ = &collision_.finish();
    collision_.begin(position_, velocity_, first_segment());

    calot_rod_input in{};
    in.struct_size = sizeof in;
    in.tick = tick;
    std::copy(gravity.begin(), gravity.end(), in.gravity);
    in.base.mode = CALOT_END_COUPLED;
    in.tip.mode = CALOT_END_FREE;
    const auto coupling = [&](std::size_t axis) {
        return calot_coupling{.target = target_[axis],
                              .velocity = (target[axis] - target_[axis]) / dt,
                              .stiffness = gains_.stiffness[axis],
                              .damping = gains_.damping[axis],
                              .limit = gains_.limit[axis]};
    };
    in.base.insertion = coupling(0);
    in.base.rotation = coupling(1);
    in.rest_darboux = reals(endoscope_.rest_darboux());
    in.contacts = {contacts_->contact.data(), contacts_->count, sizeof(calot_contact)};
    out_.contact_impulse = {impulse_.data(), 3 * contacts_->count};

    const auto begin = std::chrono::steady_clock::now();
    call(plugin_, "rod.step", rod_.step, &in, &out_);
    rod_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (cost_ != nullptr) {
        constraint_seconds_ = 0;
        const std::uint32_t parts = cost_->part_count(plugin_.instance->self);
        for (std::uint32_t i = 0; i < parts; ++i) {
            calot_string name{};
            double seconds = 0;
            cost_->part(plugin_.instance->self, i, &name, &seconds);
            if (view(name) == "constraints") constraint_seconds_ += seconds;
        }
    }
    require_finite(plugin_, "rod.step", "output.position", position_);
    require_finite(plugin_, "rod.step", "output.velocity", velocity_);
    require_finite(plugin_, "rod.step", "output.frame", frame_);
    require_finite(plugin_, "rod.step", "output.angular_velocity", angular_velocity_);
    require_finite(plugin_, "rod.step", "output.contact_impulse", {impulse_.data(), 3 * contacts_->count});
    const double scalars[] = {out_.insertion, out_.rotation, out_.insertion_force, out_.rotation_torque};
    require_finite(plugin_, "rod.step", "output.insertion", scalars);

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
    for (std::size_t i = 0; i < contacts_->count; ++i) {
        contact_hash_.add(contacts_->contact[i].id);
        contact_hash_.add(std::span(&impulse_[3 * i], 3));
    }
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
    s.contact_count = std::min(contacts_->count, s.contact.size());
    s.contacts_left_out = contacts_->left_out;
    s.tissue_force = s.self_force = 0;
    for (std::size_t i = 0; i < s.contact_count; ++i) {
        const calot_contact& c = contacts_->contact[i];
        calot_contact_report& r = s.contact[i];
        r = {};
        r.id = c.id;
        r.organ = contacts_->owner[i].organ;
        r.region = contacts_->owner[i].region;
        r.segment = c.segment;
        std::copy_n(c.point, 3, r.point);
        std::copy_n(c.normal, 3, r.normal);
        for (std::size_t k = 0; k < 3; ++k)
            r.force[k] = -impulse_[3 * i + k] / dt;
        r.gap = c.gap;
        (r.organ == ContactOwner::shaft ? s.self_force : s.tissue_force) += norm(vec3(r.force));
    }
    s.penetration.now = contacts_->deepest;
    s.penetration.deepest = std::max(s.penetration.deepest, contacts_->deepest);
    s.penetration.ticks_over_1mm += contacts_->deepest > 1e-3;
    s.cost.rod = rod_seconds_;
    s.cost.constraints = constraint_seconds_;
    s.cost.collision = contacts_->seconds;
    s.cost.self_contact = contacts_->self_seconds;
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
    s.feedback.insertion_force = out_.insertion_force; // the hand is pushed back as hard as it pushes in
    s.feedback.rotation_torque = out_.rotation_torque;
    const auto torque = endoscope_.wheel_torque();
    s.feedback.wheel_torque[0] = torque[0];
    s.feedback.wheel_torque[1] = torque[1];
}

} // namespace calot::simulation
