// From a rod's mechanics in plain C++ to a plugin: ModelledRod keeps the setup and the properties, refuses
// what no model can work with, and takes a step back that overflowed; CostedRod also says what a step's parts
// cost. rod.hpp remains the way for models that want to do all of that themselves.
#pragma once

#include <calot/plugin.hpp>
#include <calot/rod.hpp>
#include <calot/rod_math.hpp>
#include <calot/rod_step.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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
    std::vector<double> frame;        ///< 4(N-1), unit quaternions as they were given; aligned_frames()
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
    double total() const { return kinetic + bending + twist + gravity; }
};

/// One step. Real-time rules hold as the manifest says. The input is checked: finite, of the right sizes.
/// This one takes the input in C++ types. False: it overflowed, and the rod stays where it was, without
/// speed. A model that may end a step early has elapsed(), s that the last one took.
template<class M>
concept StepsByRodStep = requires(M model, const RodStep& step) {
    { model.step(step) } -> std::convertible_to<bool>;
};
/// This one takes the contract's input, whose duration and farthest it may ignore; what to do about an
/// overflow is left to ModelledRod.
template<class M>
concept StepsByInput = requires(M model, const M& seen, const calot_rod_input& input) {
    model.step(input);
    { seen.is_finite() } -> std::convertible_to<bool>;
    model.stop(); // takes all speed away and forgets contacts, impulses and wrenches
};

/// What ModelledRod asks of a model.
template<class M>
concept RodModel = (StepsByRodStep<M> ||
                    StepsByInput<M>)&&requires(M model, const M& seen, const RodDescription& description,
                                               std::span<const double> parameters,
                                               const RodProperties& properties, std::span<double> to) {
    M(description, parameters);       // may throw Discard
    model.set_properties(properties); // of the right sizes and usable; allocates nothing
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
    { seen.base_roll() } -> std::convertible_to<double>;
    { seen.energies() } -> std::convertible_to<RodEnergies>;
    // Everything that steers the future.
    { seen.state_size() } -> std::convertible_to<std::size_t>;
    seen.save(to);
    { model.load(std::span<const double>(to)) } -> std::convertible_to<bool>; // false: nothing has changed
};

/// A model that can say what the parts of its last step cost, s, in the order of their names.
template<class M>
concept CostedRodModel = RodModel<M> && requires(M model, const M& seen) {
    {std::span<const std::string_view>(M::cost_names)};
    model.measure_costs(true);
    { seen.cost(std::size_t{0}) } -> std::convertible_to<double>;
};

/// The description's frames, each turned the least so that its third axis is its segment's direction.
inline std::vector<double> aligned_frames(const RodDescription& d) {
    std::vector<double> frames(d.frame.size());
    for (std::size_t j = 0; j < d.frame.size(); j += 4) {
        const Vec3 t = normalized(vec3(&d.position[3 * (j / 4) + 3]) - vec3(&d.position[3 * (j / 4)]));
        const Quat unit = normalized(quat(&d.frame[j]));
        store(normalized(between(third_axis(unit), t) * unit), &frames[j]);
    }
    return frames;
}

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
    for (std::size_t j = 0; j < d.frame.size(); j += 4)
        if (!(std::abs(norm(quat(&d.frame[j])) - 1) < 1e-3))
            throw Discard(CALOT_CODE_OUT_OF_RANGE, "setup.frame", "must be unit quaternions");
    d.length.assign(l.begin(), l.end());
    if (l.empty())
        for (std::size_t i = 3; i < p.size(); i += 3)
            d.length.push_back(norm(vec3(&p[i]) - vec3(&p[i - 3])));
    for (const double length : d.length)
        if (!(length > 1e-9 && length < 1e6))
            throw Discard(CALOT_CODE_OUT_OF_RANGE, "setup.length", "must lie between 1e-9 and 1e6 m");
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
struct RodComplaint {
    std::size_t property, index;
    const char* field() const { return rod_property_names[property]; }
    const char* message() const {
        return property < positive_rod_properties ? "must lie between 1e-15 and 1e12"
                                                  : "must lie between 0 and 1e12";
    }
};
inline std::optional<RodComplaint> complaint(const calot_rod_segments& segments) {
    for (std::size_t k = 0; k < rod_property_count; ++k) {
        const auto values = span(segments.*contract_rod_properties[k]);
        for (std::size_t j = 0; j < values.size(); ++j)
            if (!is_usable(k, values[j])) return RodComplaint{k, j};
    }
    return std::nullopt;
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
        if (const auto wrong = detail::complaint(setup.segments))
            throw Discard(CALOT_CODE_OUT_OF_RANGE,
                          "setup." + std::string(wrong->field()) + "[" + std::to_string(wrong->index) + "]",
                          wrong->message());
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
        const auto contacts = static_cast<std::size_t>(description_.max_contacts);
        reader_ = detail::RodStepReader(description_.dt, description_.guide, contacts);
        is_coupled_ = warned_ = false;
    }
    void deactivate() override { model_.reset(); }

    void reset(std::uint64_t) override {
        properties_ = description_.properties;
        model_->set_properties(properties_);
        if constexpr (StepsByInput<Model>) model_->stop();
        model_->load(start_);
        is_coupled_ = warned_ = false;
    }

    Result set_segments(const calot_rod_segments& segments) override {
        if (const auto wrong = detail::complaint(segments))
            return Result::discard(CALOT_CODE_OUT_OF_RANGE, wrong->field(), wrong->message());
        detail::assign(properties_, segments); // as long as before: allocates nothing
        model_->set_properties(properties_);
        return Result::ok();
    }

    Result step(const calot_rod_input& in, calot_rod_output& out) override {
        if (in.base.mode == CALOT_END_COUPLED && description_.guide.present == 0)
            return Result::discard(CALOT_CODE_INVALID_ARGUMENT, "input.base.mode",
                                   "a coupled base needs a guide: give one at configure");
        if (in.duration > 0 && in.duration < 1e-9 * static_cast<double>(shortest_step()))
            return Result::discard(CALOT_CODE_OUT_OF_RANGE, "input.duration",
                                   "is shorter than this model can step");
        if (!detail::is_moderate(in))
            return Result::discard(CALOT_CODE_OUT_OF_RANGE, "input", "holds a value beyond 1e9 in SI units");
        is_coupled_ = in.base.mode == CALOT_END_COUPLED;
        if (!advance(in)) {
            if (!warned_)
                host().log().realtime(CALOT_LOG_WARNING,
                                      "a rod's step overflowed; it was stopped where it was");
            warned_ = true;
        }
        if constexpr (requires(const Model& rod) { rod.elapsed(); }) out.elapsed = model_->elapsed();
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
        out.insertion = dot(rod.position(0) - vec3(description_.guide.exit), d);
        out.rotation = rod.base_roll();
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

  protected:
    Model* model() { return model_.get(); } ///< null while inactive
    const Model* model() const { return model_.get(); }

  private:
    // False: the step overflowed, and the rod was stopped where it was.
    bool advance(const calot_rod_input& in) {
        if constexpr (StepsByRodStep<Model>) {
            return model_->step(reader_.read(in, properties_.radius));
        } else {
            model_->save(saved_);
            model_->step(in);
            if (model_->is_finite()) return true;
            model_->load(saved_);
            model_->stop();
            return false;
        }
    }
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
    detail::RodStepReader reader_;
    bool is_coupled_ = false, warned_ = false;
};

/// Likewise of a model that can say what the parts of its last step cost.
template<CostedRodModel Model>
class CostedRod : public ModelledRod<Model>, public Costed {
  public:
    void activate(const calot_activation& activation) override {
        ModelledRod<Model>::activate(activation);
        this->model()->measure_costs(is_measured_);
    }
    void enable_cost(bool is_on) override {
        is_measured_ = is_on;
        if (this->model() != nullptr) this->model()->measure_costs(is_on);
    }
    std::uint32_t cost_part_count() const override {
        return static_cast<std::uint32_t>(std::size(Model::cost_names));
    }
    std::string_view cost_name(std::uint32_t index) const override {
        return index < cost_part_count() ? Model::cost_names[index] : std::string_view{};
    }
    double cost_seconds(std::uint32_t index) const override {
        return this->model() != nullptr ? this->model()->cost(index) : 0.0;
    }

  private:
    bool is_measured_ = false;
};

} // namespace calot
