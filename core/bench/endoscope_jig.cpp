#include "bench/endoscope_jig.hpp"

#include <calot/math.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace calot::bench {

namespace {

constexpr double shaft_outside = 0.03; // m behind the bending section, so that its first joint is free

calot_reals view(std::span<const double> v) {
    return {v.data(), v.size()};
}
calot_reals_out out(std::vector<double>& v) {
    return {v.data(), v.size()};
}

} // namespace

simulation::EndoscopeDatasheet shortened(const simulation::EndoscopeDatasheet& sheet, double shaft) {
    simulation::EndoscopeDatasheet end = sheet;
    double surplus = sheet.working_length - sheet.bending_length() - shaft;
    while (surplus > 0 && !end.segments.front().bends) {
        simulation::ShaftSegment& s = end.segments.front();
        if (s.length <= surplus) {
            surplus -= s.length;
            end.working_length -= s.length;
            end.segments.erase(end.segments.begin());
            continue;
        }
        const double cut = surplus / s.length;
        for (simulation::Gradient* g : {&s.flexural_rigidity, &s.torsional_rigidity})
            g->from = g->at(cut);
        s.length -= surplus, end.working_length -= surplus;
        surplus = 0;
    }
    return end;
}

EndoscopeJig::EndoscopeJig(const MakeInstance& make, const simulation::EndoscopeDatasheet& sheet,
                           std::uint32_t nodes,
                           const std::optional<simulation::InstrumentDatasheet>& instrument,
                           std::size_t channel)
    : instance_(make()), scope_(sheet, nodes) {
    error_.struct_size = sizeof error_;
    if (instrument) {
        scope_.set_channel(channel, {.flexural_rigidity = instrument->flexural_rigidity,
                                     .mass_per_length = instrument->mass_per_length,
                                     .reach = scope_.length()});
        scope_.condition(scope_.nodes(), {}, 0);
    }
    // Along +x, up is +y: the rod leaves the sleeve at the origin.
    const std::size_t n = scope_.nodes(), m = n - 1;
    position_.assign(3 * n, 0.0);
    double x = sheet.bending_length() + shaft_outside - scope_.length();
    for (std::size_t i = 0; i < n; ++i) {
        position_[3 * i] = x;
        if (i < m) x += scope_.lengths()[i];
    }
    for (std::size_t i = 0; i < m; ++i)
        frame_.insert(frame_.end(), {along_x.w, along_x.x, along_x.y, along_x.z});
    guide_.present = 1;
    guide_.direction[0] = 1;

    calot_rod_setup setup{};
    setup.struct_size = sizeof setup;
    setup.node_count = static_cast<std::uint32_t>(n);
    setup.position = view(position_), setup.frame = view(frame_);
    setup.length = view(scope_.lengths()), setup.rest_darboux = view(scope_.rest_darboux());
    setup.segments = scope_.segments();
    setup.guide = guide_;
    check(functions().configure(self(), &setup, &error_), "rod.configure");
    calot_activation activation{};
    activation.struct_size = sizeof activation;
    activation.step_nanoseconds = std::llround(step_seconds * 1e9);
    activation.seed = 1;
    activation.max_contacts = 1;
    check(instance_.abi()->activate(self(), &activation, &error_), "rod.activate");

    input_.struct_size = sizeof input_;
    input_.base.pose.quaternion[0] = input_.tip.pose.quaternion[0] = 1;
    input_.base.mode = CALOT_END_COUPLED; // held as by a hand
    input_.base.insertion = {position_[0], 0, 3000, 30, 50};
    input_.base.rotation = {0, 0, 8, 0.02, 1};
    output_.struct_size = sizeof output_;
    output_.position = out(position_), output_.frame = out(frame_);
}

void EndoscopeJig::check(calot_status status, const char* function) const {
    if (status == CALOT_OK) return;
    throw host::PluginError(instance_.id(), function, status, error_.code, error_.field, error_.message);
}

void EndoscopeJig::step(const std::array<double, 2>& wheel) {
    const std::uint32_t no_brake[2] = {0, 0};
    scope_.steer(wheel.data(), no_brake, frame_, step_seconds);
    input_.rest_darboux = view(scope_.rest_darboux());

    // A plane that the tip touches while it is straight.
    calot_contact stop{};
    const std::size_t last = scope_.nodes() - 1;
    const double radius = scope_.radii().back(), *tip = &position_[3 * last];
    stop.id = 1;
    stop.segment = static_cast<std::uint32_t>(last - 1);
    stop.t = 1;
    std::copy_n(tip, 3, stop.axis_point);
    const double foot[3] = {tip[0], radius, tip[2]};
    std::copy_n(foot, 3, stop.point);
    std::copy_n(foot, 3, stop.free_position);
    stop.normal[1] = -1;
    stop.gap = -tip[1];
    impulse_ = {};
    if (is_stopped_) {
        input_.contacts = {&stop, 1, sizeof stop};
        output_.contact_impulse = {impulse_.data(), 3};
    } else {
        input_.contacts = {};
        output_.contact_impulse = {};
    }
    check(functions().step(self(), &input_, &output_, &error_), "rod.step");
    ++input_.tick;
    if (!std::all_of(position_.begin(), position_.end(), [](double v) { return std::isfinite(v); }))
        throw host::PluginError(instance_.id(), "rod.step", CALOT_FATAL, CALOT_CODE_NOT_FINITE,
                                "output.position", "is not finite");
}

double EndoscopeJig::smallest_bend_radius() const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = scope_.first_bending_segment() + 1; i + 1 < scope_.lengths().size(); ++i) {
        const Vec3 a = rotate(quat(&frame_[4 * (i - 1)]), {0, 0, 1}),
                   b = rotate(quat(&frame_[4 * i]), {0, 0, 1});
        const double turn = std::atan2(norm(cross(a, b)), dot(a, b));
        const double length = 0.5 * (scope_.lengths()[i - 1] + scope_.lengths()[i]);
        if (turn > 0) least = std::min(least, length / turn);
    }
    return least;
}

std::vector<std::array<double, 2>> EndoscopeJig::shape() const {
    std::vector<std::array<double, 2>> line;
    for (std::size_t i = scope_.first_bending_segment(); i < scope_.nodes(); ++i)
        line.push_back({position_[3 * i], position_[3 * i + 1]});
    return line;
}

} // namespace calot::bench
