// From a rod's mechanics in plain C++ to a plugin: ModelledRod keeps the setup and the properties, refuses
// what no model can work with, and takes a step back that overflowed. rod.hpp remains the way for models that
// want to do all of that themselves.
#pragma once

#include <calot/plugin.hpp>
#include <calot/rod.hpp>
#include <calot/rod_math.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace calot {

/// Properties of each of the N-1 segments, SI units; abi/rod.h says what they mean.
struct RodProperties {
    std::vector<double> mass_per_length, radius, bending_x, bending_y, torsion, bending_damping,
        torsion_damping, drag, friction;
};

/// Everything that a rod model is made of. Complete: what the contract lets be empty is filled in.
struct RodDescription {
    int nodes = 0;                    ///< N, from 3
    std::vector<double> position;     ///< 3N, m
    std::vector<double> frame;        ///< 4(N-1), unit quaternions
    std::vector<double> length;       ///< N-1, m, at rest
    std::vector<double> rest_darboux; ///< 3(N-1), 1/m
    RodProperties properties;
    calot_guide guide{};
    double dt = 1e-3; ///< s, a step
    int max_contacts = 0;
};

/// J, at a step's end.
struct RodEnergies {
    double kinetic = 0, bending = 0, twist = 0, gravity = 0;
};

/// What ModelledRod asks of a model.
template<class M>
concept RodModel = requires(M model, const M& seen, const RodDescription& description,
                            std::span<const double> parameters, const RodProperties& properties,
                            const calot_rod_input& input, std::span<double> to) {
    M(description, parameters); // may throw Discard
    model.set_properties(properties);
    // One step. Real-time rules hold as the manifest says. The input is checked: finite, of the right sizes.
    model.step(input);
    { seen.is_finite() } -> std::convertible_to<bool>;
    model.stop(); // takes all speed away and forgets contacts, impulses and wrenches
    { seen.position(0) } -> std::convertible_to<Vec3>;
    { seen.velocity(0) } -> std::convertible_to<Vec3>;
    { seen.frame(0) } -> std::convertible_to<Quat>;
    { seen.angular_velocity(0) } -> std::convertible_to<Vec3>;
    { seen.contact_impulses() } -> std::convertible_to<std::span<const Vec3>>; // of the last step's contacts
    // On the rod, means over the step.
    { seen.base_force() } -> std::convertible_to<Vec3>;
    { seen.base_torque() } -> std::convertible_to<Vec3>;
    { seen.tip_force() } -> std::convertible_to<Vec3>;
    { seen.tip_torque() } -> std::convertible_to<Vec3>;
    { seen.insertion() } -> std::convertible_to<double>;
    { seen.base_roll() } -> std::convertible_to<double>;
    { seen.energies() } -> std::convertible_to<RodEnergies>;
    // Everything that steers the future.
    { seen.state_size() } -> std::convertible_to<std::size_t>;
    seen.save(to);
    { model.load(std::span<const double>(to)) } -> std::convertible_to<bool>; // false: nothing has changed
};

namespace detail {

inline constexpr std::size_t rod_property_count = 9;
inline constexpr calot_reals calot_rod_segments::*contract_rod_properties[rod_property_count] = {
    &calot_rod_segments::mass_per_length, &calot_rod_segments::radius,  &calot_rod_segments::bending_x,
    &calot_rod_segments::bending_y,       &calot_rod_segments::torsion, &calot_rod_segments::bending_damping,
    &calot_rod_segments::torsion_damping, &calot_rod_segments::drag,    &calot_rod_segments::friction};
inline constexpr std::vector<double> RodProperties::*rod_properties[rod_property_count] = {
    &RodProperties::mass_per_length, &RodProperties::radius,  &RodProperties::bending_x,
    &RodProperties::bending_y,       &RodProperties::torsion, &RodProperties::bending_damping,
    &RodProperties::torsion_damping, &RodProperties::drag,    &RodProperties::friction};
inline constexpr const char* rod_property_names[rod_property_count] = {
    "segments.mass_per_length", "segments.radius",  "segments.bending_x",
    "segments.bending_y",       "segments.torsion", "segments.bending_damping",
    "segments.torsion_damping", "segments.drag",    "segments.friction"};
// The first five divide something.
inline constexpr std::size_t positive_rod_properties = 5;

// Twist-free along the nodes; the first frame's second axis as near to the world's -y as its direction
// allows.
inline std::vector<double> frames_along(std::span<const double> position) {
    std::vector<double> frames;
    Quat q;
    for (std::size_t i = 3; i + 2 < position.size(); i += 3) {
        const Vec3 t = normalized(vec3(&position[i]) - vec3(&position[i - 3]));
        q = normalized(between(third_axis(q), t) * q);
        if (i == 3) {
            Vec3 up = Vec3{0, -1, 0} + t.y * t;
            if (norm(up) < 1e-6) up = Vec3{0, 0, 1} - t.z * t;
            const Vec3 have = rotate(q, {0, 1, 0}), want = normalized(up);
            q = normalized(axis_angle(t, std::atan2(dot(cross(have, want), t), dot(have, want))) * q);
        }
        frames.insert(frames.end(), {q.w, q.x, q.y, q.z});
    }
    return frames;
}

inline RodDescription complete(const calot_rod_setup& s) {
    RodDescription d;
    const auto p = span(s.position), f = span(s.frame), l = span(s.length), u = span(s.rest_darboux);
    if (s.node_count > 100'000)
        throw Discard(CALOT_CODE_OUT_OF_RANGE, "setup.node_count", "is beyond 100000");
    d.nodes = static_cast<int>(s.node_count);
    d.position.assign(p.begin(), p.end());
    for (std::size_t i = 0; i < p.size(); ++i)
        if (std::abs(p[i]) > 1e6) throw Discard(CALOT_CODE_OUT_OF_RANGE, "setup.position", "is beyond 1e6 m");
    for (std::size_t i = 3; i < p.size(); i += 3)
        if (!(norm(vec3(&p[i]) - vec3(&p[i - 3])) > 0))
            throw Discard(CALOT_CODE_OUT_OF_RANGE, "setup.position", "neighbouring nodes coincide");
    d.frame = f.empty() ? frames_along(p) : std::vector<double>(f.begin(), f.end());
    for (std::size_t j = 0; j < d.frame.size(); j += 4) {
        const Quat given = quat(&d.frame[j]);
        if (std::abs(norm(given) - 1) > 1e-3)
            throw Discard(CALOT_CODE_OUT_OF_RANGE, "setup.frame", "must be unit quaternions");
        // The third axis is the segment's direction.
        const Vec3 t = normalized(vec3(&p[3 * (j / 4) + 3]) - vec3(&p[3 * (j / 4)]));
        const Quat unit = normalized(given);
        store(normalized(between(third_axis(unit), t) * unit), &d.frame[j]);
    }
    d.length.assign(l.begin(), l.end());
    if (l.empty())
        for (std::size_t i = 3; i < p.size(); i += 3)
            d.length.push_back(norm(vec3(&p[i]) - vec3(&p[i - 3])));
    d.rest_darboux.assign(3 * (p.size() / 3 - 1), 0.0);
    std::copy(u.begin(), u.end(), d.rest_darboux.begin());
    d.guide = s.guide;
    if (d.guide.present != 0) store(normalized(vec3(d.guide.direction)), d.guide.direction);
    return d;
}

// Beyond these bounds squares and quotients leave the range of doubles.
inline bool is_usable(std::size_t property, double v) {
    return v < 1e12 && (property < positive_rod_properties ? v > 1e-15 : v >= 0.0);
}
inline Result usable(const calot_rod_segments& segments) {
    for (std::size_t k = 0; k < rod_property_count; ++k)
        for (const double v : span(segments.*contract_rod_properties[k]))
            if (!is_usable(k, v))
                return Result::discard(CALOT_CODE_OUT_OF_RANGE, rod_property_names[k],
                                       "must lie between 1e-15 and 1e12, or be 0 where that is allowed");
    return Result::ok();
}
inline void assign(RodProperties& to, const calot_rod_segments& from) {
    for (std::size_t k = 0; k < rod_property_count; ++k) {
        const auto values = span(from.*contract_rod_properties[k]);
        if (!values.empty()) (to.*rod_properties[k]).assign(values.begin(), values.end());
    }
}

// Far outside any endoscope; larger but finite numbers overflow within a step.
inline bool is_moderate(const calot_rod_input& in) {
    const auto all = [](const double* v, std::size_t n) {
        for (std::size_t i = 0; i < n; ++i)
            if (!(std::abs(v[i]) < 1e9)) return false;
        return true;
    };
    bool good = all(in.gravity, 3) && all(in.rest_darboux.data, in.rest_darboux.size);
    for (const calot_rod_end* e : {&in.base, &in.tip}) {
        good = good && all(e->pose.position, 3) && all(e->wrench.force, 3) && all(e->wrench.torque, 3);
        for (const calot_coupling* c : {&e->insertion, &e->rotation}) {
            const double values[5] = {c->target, c->velocity, c->stiffness, c->damping, c->limit};
            good = good && all(values, 5);
        }
    }
    for (const calot_contact& c : items<calot_contact>(in.contacts))
        good = good && all(c.axis_point, 3) && all(c.point, 3) && all(c.free_position, 3) && all(&c.gap, 1) &&
               all(&c.friction, 1) && all(c.compliance, 9);
    return good;
}

} // namespace detail

/// A rod plugin made of a model. Derive from it to name the parameters; the model is given their values, in
/// the table's order, when the rod is activated.
template<RodModel Model>
class ModelledRod : public Rod {
  public:
    std::int64_t shortest_step() const override { return 1'000; }
    std::int64_t longest_step() const override { return 10'000'000; }

    void configure(const calot_rod_setup& setup) override {
        RodDescription next = detail::complete(setup);
        if (const Result r = detail::usable(setup.segments); r.status != CALOT_OK)
            throw Discard(r.code, std::string("setup.") + r.field, r.message);
        detail::assign(next.properties, setup.segments);
        make(next);
        description_ = std::move(next);
    }

    void activate(const calot_activation& a) override {
        description_.dt = 1e-9 * static_cast<double>(a.step_nanoseconds);
        description_.max_contacts = static_cast<int>(std::min<std::uint32_t>(a.max_contacts, 100'000));
        properties_ = description_.properties;
        model_ = make(description_);
        start_.assign(model_->state_size(), 0.0);
        model_->save(start_);
        saved_ = start_;
        is_coupled_ = warned_ = false;
    }
    void deactivate() override { model_.reset(); }

    void reset(std::uint64_t) override {
        properties_ = description_.properties;
        model_->set_properties(properties_);
        model_->stop();
        model_->load(start_);
        is_coupled_ = warned_ = false;
    }

    Result set_segments(const calot_rod_segments& segments) override {
        if (const Result r = detail::usable(segments); r.status != CALOT_OK) return r;
        detail::assign(properties_, segments); // as long as before: allocates nothing
        model_->set_properties(properties_);
        return Result::ok();
    }

    Result step(const calot_rod_input& in, calot_rod_output& out) override {
        if (in.base.mode == CALOT_END_COUPLED && description_.guide.present == 0)
            return Result::discard(CALOT_CODE_INVALID_ARGUMENT, "input.base.mode",
                                   "a coupled base needs a guide: give one at configure");
        if (!detail::is_moderate(in))
            return Result::discard(CALOT_CODE_OUT_OF_RANGE, "input", "holds a value beyond 1e9 in SI units");
        model_->save(saved_);
        model_->step(in);
        is_coupled_ = in.base.mode == CALOT_END_COUPLED;
        if (!model_->is_finite()) {
            model_->load(saved_);
            model_->stop();
            if (!warned_)
                host().log().realtime(CALOT_LOG_WARNING,
                                      "a rod's step overflowed; it was stopped where it was");
            warned_ = true;
        }
        return read(out);
    }

    Result read(calot_rod_output& out) override {
        const Model& rod = *model_;
        for (std::size_t i = 0; i < out.position.size / 3; ++i)
            store(rod.position(static_cast<int>(i)), &out.position.data[3 * i]);
        for (std::size_t i = 0; i < out.velocity.size / 3; ++i)
            store(rod.velocity(static_cast<int>(i)), &out.velocity.data[3 * i]);
        for (std::size_t j = 0; j < out.frame.size / 4; ++j)
            store(rod.frame(static_cast<int>(j)), &out.frame.data[4 * j]);
        for (std::size_t j = 0; j < out.angular_velocity.size / 3; ++j)
            store(rod.angular_velocity(static_cast<int>(j)), &out.angular_velocity.data[3 * j]);
        const std::span<const Vec3> impulses = rod.contact_impulses();
        for (std::size_t k = 0; k < out.contact_impulse.size / 3; ++k)
            store(k < impulses.size() ? impulses[k] : Vec3{}, &out.contact_impulse.data[3 * k]);
        const Vec3 force = rod.base_force(), torque = rod.base_torque();
        store(force, out.base.force), store(torque, out.base.torque);
        store(rod.tip_force(), out.tip.force), store(rod.tip_torque(), out.tip.torque);
        const Vec3 d = description_.guide.present != 0 ? vec3(description_.guide.direction) : Vec3{};
        out.insertion = rod.insertion(), out.rotation = rod.base_roll();
        out.insertion_force = is_coupled_ ? dot(force, d) : 0.0;
        out.rotation_torque = is_coupled_ ? dot(torque, d) : 0.0;
        const RodEnergies e = rod.energies();
        out.kinetic_energy = e.kinetic, out.bending_energy = e.bending;
        out.twist_energy = e.twist, out.gravity_energy = e.gravity;
        return Result::ok();
    }

    void save(StateWriter& to) const override {
        std::vector<double> state(model_->state_size());
        model_->save(state);
        to.values(state);
        for (const auto property : detail::rod_properties)
            to.values(properties_.*property);
    }
    void load(StateReader& from) override {
        std::vector<double> state(model_->state_size());
        from.values(state);
        for (const double v : state)
            if (!(std::abs(v) < 1e300)) StateReader::corrupt("holds an impossible value");
        RodProperties next = properties_;
        for (std::size_t k = 0; k < detail::rod_property_count; ++k) {
            from.values(next.*detail::rod_properties[k]);
            for (const double v : next.*detail::rod_properties[k])
                if (!detail::is_usable(k, v)) StateReader::corrupt("holds an impossible property");
        }
        model_->set_properties(next);
        if (!model_->load(state)) {
            model_->set_properties(properties_);
            StateReader::corrupt("holds an impossible value");
        }
        properties_ = std::move(next);
    }

  private:
    std::unique_ptr<Model> make(const RodDescription& description) const {
        std::vector<double> values;
        for (std::size_t k = 0; k < parameters().size(); ++k)
            values.push_back(parameter(k));
        return std::make_unique<Model>(description, values);
    }

    RodDescription description_;
    RodProperties properties_; // as set since
    std::unique_ptr<Model> model_;
    std::vector<double> start_, saved_;
    bool is_coupled_ = false, warned_ = false;
};

} // namespace calot
