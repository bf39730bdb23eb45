// The model as a plugin: the contract's structs to the model's and back.
#include "direct_rod.hpp"

#include <calot/plugin.hpp>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace calot::rod_direct {

namespace {

constexpr Parameter parameter_table[] = {
    {"recovery-speed", "Fastest speed at which overlap is taken back", "m/s", 0.001, 2.0, 0.2, false},
};

constexpr std::size_t property_count = 9;
constexpr calot_reals calot_rod_segments::*contract_properties[property_count] = {
    &calot_rod_segments::mass_per_length, &calot_rod_segments::radius,  &calot_rod_segments::bending_x,
    &calot_rod_segments::bending_y,       &calot_rod_segments::torsion, &calot_rod_segments::bending_damping,
    &calot_rod_segments::torsion_damping, &calot_rod_segments::drag,    &calot_rod_segments::friction};

EndMode end_mode(std::uint32_t mode) {
    switch (mode) {
    case CALOT_END_CLAMPED:
        return EndMode::clamped;
    case CALOT_END_COUPLED:
        return EndMode::coupled;
    case CALOT_END_LOADED:
        return EndMode::loaded;
    default:
        return EndMode::free;
    }
}

Coupling coupling(const calot_coupling& c) {
    return {c.target, c.velocity, c.stiffness, c.damping, c.limit};
}

End end(const calot_rod_end& e) {
    End out;
    out.mode = end_mode(e.mode);
    if (out.mode == EndMode::clamped) {
        out.position = vec3(e.pose.position);
        out.orientation = normalized(quat(e.pose.quaternion));
    }
    out.force = vec3(e.wrench.force), out.torque = vec3(e.wrench.torque);
    out.axial = coupling(e.insertion), out.roll = coupling(e.rotation);
    return out;
}

Contact contact(const calot_contact& c, double dt, std::span<const double> radius) {
    Contact out;
    out.segment = static_cast<std::int32_t>(c.segment), out.along = c.t;
    out.normal = normalized(vec3(c.normal)), out.gap = c.gap, out.centre = vec3(c.axis_point);
    out.friction = c.friction, out.motion = vec3(c.free_position) - vec3(c.point), out.id = c.id;
    // The contract's compliance is per impulse; a force held over the tick is an impulse of dt times it.
    for (std::size_t i = 0; i < 9; ++i)
        out.compliance[i] = c.compliance[i] * dt;
    if ((c.flags & CALOT_CONTACT_SELF) != 0) {
        out.other_segment = static_cast<std::int32_t>(c.other_segment), out.other_along = c.other_t;
        // Both sides move: what the rod follows is the way from the other axis to this one.
        out.centre -= vec3(c.point) - radius[c.other_segment] * out.normal;
        out.motion = {};
    }
    return out;
}

// Twist-free along the nodes; the first frame's second axis as near to the world's -y as its direction
// allows.
std::vector<double> frames_along(std::span<const double> position) {
    std::vector<double> frames;
    Quat q;
    const std::size_t n = position.size() / 3;
    for (std::size_t j = 0; j + 1 < n; ++j) {
        const Vec3 t = normalized(vec3(&position[3 * j + 3]) - vec3(&position[3 * j]));
        q = normalized(between(third_axis(q), t) * q);
        if (j == 0) {
            Vec3 up = Vec3{0, -1, 0} + dot(t, {0, 1, 0}) * t;
            if (norm(up) < 1e-6) up = Vec3{0, 0, 1} - dot(t, {0, 0, 1}) * t;
            const Vec3 have = rotate(q, {0, 1, 0}), want = normalized(up);
            q = normalized(axis_angle(t, std::atan2(dot(cross(have, want), t), dot(have, want))) * q);
        }
        frames.insert(frames.end(), {q.w, q.x, q.y, q.z});
    }
    return frames;
}

} // namespace

class DirectRodPlugin final : public Rod, public Costed {
  public:
    std::span<const Parameter> parameters() const override { return parameter_table; }
    std::int64_t shortest_step() const override { return 1'000; }
    std::int64_t longest_step() const override { return 10'000'000; }

    void configure(const calot_rod_setup& setup) override {
        Setup next;
        const auto p = span(setup.position), f = span(setup.frame), l = span(setup.length),
                   u = span(setup.rest_darboux);
        next.position.assign(p.begin(), p.end());
        next.frame = f.empty() ? frames_along(p) : std::vector<double>(f.begin(), f.end());
        next.description.nodes = static_cast<int>(setup.node_count);
        next.description.length.assign(l.begin(), l.end());
        if (l.empty())
            for (std::size_t i = 0; i + 3 < p.size(); i += 3)
                next.description.length.push_back(norm(vec3(&p[i + 3]) - vec3(&p[i])));
        next.rest_darboux.assign(3 * (setup.node_count - 1), 0.0);
        std::copy(u.begin(), u.end(), next.rest_darboux.begin());
        for (std::size_t k = 0; k < property_count; ++k) {
            const auto values = span(setup.segments.*contract_properties[k]);
            next.properties[k].assign(values.begin(), values.end());
        }
        if (setup.guide.present != 0)
            next.guide = {true, vec3(setup.guide.exit), normalized(vec3(setup.guide.direction))};
        build(next, 0);
        setup_ = std::move(next);
    }

    void activate(const calot_activation& activation) override {
        dt_ = 1e-9 * static_cast<double>(activation.step_nanoseconds);
        rod_ = build(setup_, activation.max_contacts);
        properties_ = setup_.properties;
        contacts_.assign(activation.max_contacts, {});
        start_.assign(rod_->state_size(), 0.0);
        rod_->save(start_);
        rod_->measure_times(measures_);
        input_ = {};
        input_.guide = setup_.guide;
        warned_ = false;
    }
    void deactivate() override { rod_.reset(); }

    void reset(std::uint64_t) override {
        properties_ = setup_.properties;
        rod_->set_properties(view_of(properties_));
        rod_->load(start_);
        warned_ = false;
    }

    Result set_segments(const calot_rod_segments& segments) override {
        std::array<std::span<const double>, property_count> given;
        for (std::size_t k = 0; k < property_count; ++k)
            given[k] = span(segments.*contract_properties[k]);
        if (const auto wrong = rod_->set_properties(view_of(given)))
            return Result::discard(CALOT_CODE_OUT_OF_RANGE, wrong->field, wrong->message);
        for (std::size_t k = 0; k < property_count; ++k)
            std::copy(given[k].begin(), given[k].end(), properties_[k].begin());
        return Result::ok();
    }

    Result step(const calot_rod_input& in, calot_rod_output& out) override {
        input_.dt = in.duration > 0 ? in.duration : dt_, input_.farthest = in.farthest;
        input_.gravity = vec3(in.gravity);
        input_.base = end(in.base), input_.tip = end(in.tip);
        input_.rest_darboux = span(in.rest_darboux);
        const auto list = items<calot_contact>(in.contacts);
        for (std::size_t i = 0; i < list.size(); ++i)
            contacts_[i] = contact(list[i], input_.dt, properties_[1]);
        input_.contacts = {contacts_.data(), list.size()};
        if (input_.base.mode == EndMode::coupled && !input_.guide.present)
            return Result::discard(CALOT_CODE_INVALID_ARGUMENT, "input.base.mode",
                                   "a coupled base needs a guide: give one at configure");
        const StepResult result = rod_->step(input_);
        input_.rest_darboux = {};
        input_.contacts = {};
        if (result == StepResult::invalid_input)
            return Result::discard(CALOT_CODE_OUT_OF_RANGE, "input", "holds a value beyond 1e9 in SI units");
        if (result == StepResult::recovered && !warned_) {
            warned_ = true;
            host().log().realtime(CALOT_LOG_WARNING,
                                  "rod-direct: a step overflowed; the rod was stopped where it was");
        }
        out.elapsed = rod_->elapsed();
        return read(out);
    }

    Result read(calot_rod_output& out) override {
        const DirectRod& rod = *rod_;
        for (std::size_t i = 0; i < out.position.size / 3; ++i)
            store(rod.position(static_cast<int>(i)), &out.position.data[3 * i]);
        for (std::size_t i = 0; i < out.velocity.size / 3; ++i)
            store(rod.velocity(static_cast<int>(i)), &out.velocity.data[3 * i]);
        for (std::size_t j = 0; j < out.frame.size / 4; ++j)
            store(rod.frame(static_cast<int>(j)), &out.frame.data[4 * j]);
        for (std::size_t j = 0; j < out.angular_velocity.size / 3; ++j)
            store(rod.angular_velocity(static_cast<int>(j)), &out.angular_velocity.data[3 * j]);
        const auto impulses = rod.contact_impulses();
        for (std::size_t k = 0; k < out.contact_impulse.size / 3; ++k)
            store(k < impulses.size() ? impulses[k] : Vec3{}, &out.contact_impulse.data[3 * k]);
        store(rod.base_force(), out.base.force), store(rod.base_torque(), out.base.torque);
        store(rod.tip_force(), out.tip.force), store(rod.tip_torque(), out.tip.torque);
        const Vec3 d = setup_.guide.present ? setup_.guide.direction : Vec3{};
        out.insertion = dot(rod.position(0) - setup_.guide.origin, d);
        out.rotation = rod.base_roll();
        const bool coupled = input_.base.mode == EndMode::coupled;
        out.insertion_force = coupled ? dot(rod.base_force(), d) : 0.0;
        out.rotation_torque = coupled ? dot(rod.base_torque(), d) : 0.0;
        const Energies e = rod.energies();
        out.kinetic_energy = e.kinetic, out.bending_energy = e.bending;
        out.twist_energy = e.twist, out.gravity_energy = e.gravity;
        return Result::ok();
    }

    void save(StateWriter& to) const override {
        std::vector<double> state(rod_->state_size());
        rod_->save(state);
        to.values(state);
        for (const auto& p : properties_)
            to.values(p);
    }
    void load(StateReader& from) override {
        std::vector<double> state(rod_->state_size());
        from.values(state);
        auto properties = properties_;
        for (auto& p : properties)
            from.values(p);
        if (rod_->set_properties(view_of(properties))) StateReader::corrupt("holds an impossible property");
        if (!rod_->load(state)) StateReader::corrupt("holds an impossible value");
        properties_ = std::move(properties);
    }

    void enable_cost(bool is_on) override {
        measures_ = is_on;
        if (rod_) rod_->measure_times(is_on);
    }
    std::uint32_t cost_part_count() const override { return 3; }
    std::string_view cost_name(std::uint32_t index) const override {
        constexpr std::string_view names[] = {"assembly", "solve", "contacts"};
        return index < 3 ? names[index] : "";
    }
    double cost_seconds(std::uint32_t index) const override {
        if (!rod_) return 0.0;
        const StepTimes t = rod_->costs();
        return index == 0 ? t.assembly : index == 1 ? t.solve : t.contacts;
    }

  private:
    template<class Spans>
    static SegmentProperties view_of(const Spans& p) {
        return {p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]};
    }

    struct Setup {
        RodDescription description;
        std::vector<double> position, frame, rest_darboux;
        std::array<std::vector<double>, property_count> properties;
        Guide guide;
    };

    std::unique_ptr<DirectRod> build(Setup& setup, std::uint32_t max_contacts) const {
        setup.description.properties = view_of(setup.properties);
        setup.description.max_contacts = static_cast<int>(std::min<std::uint32_t>(max_contacts, 100000));
        setup.description.recovery_speed = parameter(0);
        try {
            auto rod = std::make_unique<DirectRod>(setup.description);
            rod->set_rest_darboux(setup.rest_darboux);
            rod->reset_to(setup.position, setup.frame);
            return rod;
        } catch (const std::invalid_argument& e) {
            const std::string what = e.what();
            const std::size_t colon = what.find(": ");
            throw Discard(CALOT_CODE_OUT_OF_RANGE, "setup." + what.substr(0, colon), what.substr(colon + 2));
        }
    }

    Setup setup_;
    std::array<std::vector<double>, property_count> properties_; // as set since
    std::unique_ptr<DirectRod> rod_;
    StepInput input_;
    std::vector<Contact> contacts_;
    std::vector<double> start_;
    double dt_ = 1e-3;
    bool measures_ = false, warned_ = false;
};

} // namespace calot::rod_direct

CALOT_PLUGIN(calot::export_rod<calot::rod_direct::DirectRodPlugin>("org.calot.rod-direct",
                                                                   "Direct implicit rod", "0.1.0"))
