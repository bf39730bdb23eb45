#include "simulation/operator_link.hpp"

#include "simulation/plugin_call.hpp"

#include <algorithm>

namespace calot::simulation {

namespace {

constexpr std::int64_t step_nanoseconds = 1'000'000;

calot_activation activation(std::uint64_t seed) {
    return {.struct_size = sizeof(calot_activation),
            .step_nanoseconds = step_nanoseconds,
            .seed = seed,
            .max_contacts = 0,
            .max_actions = 0};
}

void require_sane(const Plugin& device, const calot_controls& c) {
    const double scalars[] = {c.insertion, c.rotation, c.wheel[0],       c.wheel[1],      c.suction,
                              c.air,       c.water,    c.retractor_grip, c.table_tilt[0], c.table_tilt[1]};
    require_finite(device, "device.poll", "controls", scalars);
    require_finite(device, "device.poll", "controls.retractor", c.retractor.position);
    require_finite(device, "device.poll", "controls.retractor", c.retractor.quaternion);
    for (const calot_port_controls& p : c.port) {
        const double port[] = {p.insertion, p.opening, p.rotation};
        require_finite(device, "device.poll", "controls.port", port);
    }
}

} // namespace

OperatorLink::OperatorLink(const Plugin& device, ControlSource* replay, const calot_controls& start,
                           double field_of_view, std::uint64_t seed)
    : device_(device), replay_(replay), field_of_view_(field_of_view) {
    markers_.reserve(MarkerSet::most);
    if (replay_ != nullptr || !device_) return;
    functions_ = &functions<calot_device>(device_);
    sheet_.struct_size = sizeof sheet_;
    call(device_, "device.sheet", functions_->sheet, &sheet_);
    const double figures[] = {sheet_.travel,
                              sheet_.max_force,
                              sheet_.max_torque,
                              sheet_.stiffness_limit[0],
                              sheet_.stiffness_limit[1],
                              sheet_.watchdog,
                              sheet_.rate};
    require_finite(device_, "device.sheet", "sheet", figures);
    events_ = extension<calot_device_events>(device_, CALOT_EXTENSION_EVENTS);
    observation_ = extension<calot_device_observation>(device_, CALOT_EXTENSION_OBSERVATION);
    call(device_, "device.configure", functions_->configure, &start);
    const calot_activation a = activation(seed);
    call(device_, "device.activate", device_.instance->activate, &a);
}

OperatorLink::~OperatorLink() {
    if (functions_ == nullptr) return;
    try {
        call(device_, "device.deactivate", device_.instance->deactivate);
    } catch (const host::PluginError&) { // the case is over; there is nobody left to tell
    }
}

void OperatorLink::remember(const Snapshot& s) {
    seen_tick_ = s.tick;
    seen_view_ = s.camera;
    seen_fade_ = s.fade;
    seen_task_ = s.task.view();
    felt_ = s.feedback;
    if (seen_markers_.generation == s.markers.generation) return;
    seen_markers_.generation = s.markers.generation;
    seen_markers_.count = s.markers.count;
    std::copy_n(s.markers.marker.begin(), s.markers.count, seen_markers_.marker.begin());
    markers_.clear();
    for (const Marker& m : seen_markers_.all()) {
        calot_marker out{};
        out.struct_size = sizeof out;
        out.id = abi_text(m.id.view());
        out.kind = m.kind;
        out.is_done = m.is_done;
        std::copy_n(m.position.begin(), 3, out.position);
        std::copy_n(m.normal.begin(), 3, out.normal);
        out.radius = m.radius;
        std::copy_n(m.colour.begin(), 4, out.colour);
        out.polyline = {m.points.data(), m.points.size()};
        markers_.push_back(out);
    }
}

OperatorLink::Polled OperatorLink::poll(std::int64_t tick, InputQueue& input, calot_controls& out) {
    if (replay_ != nullptr) return replay_->next(tick, out) ? Polled::ok : Polled::over;
    if (functions_ == nullptr) return Polled::ok;
    calot_input_event event;
    while (input.pop(event)) {
        if (events_ == nullptr) continue;
        const host::Call mark(device_.id.c_str(), "device.event");
        events_->event(device_.instance->self, &event);
    }
    if (observation_ != nullptr) observe();
    calot_controls polled = out;
    polled.struct_size = sizeof polled;
    try {
        call(device_, "device.poll", functions_->poll, tick, &polled);
    } catch (const host::PluginError& error) {
        if (error.code == CALOT_CODE_UNAVAILABLE && error.status == CALOT_ERROR) return Polled::unplugged;
        throw;
    }
    require_sane(device_, polled);
    out = polled;
    return Polled::ok;
}

void OperatorLink::observe() {
    calot_observation seen{};
    seen.struct_size = sizeof seen;
    seen.tick = seen_tick_;
    seen.view = seen_view_;
    seen.field_of_view = field_of_view_;
    seen.fade = seen_fade_;
    seen.task = abi_text(seen_task_.view());
    seen.markers = {markers_.data(), markers_.size(), sizeof(calot_marker)};
    seen.instruments = {nullptr, 0, sizeof(calot_seen_instrument)};
    seen.strands = {nullptr, 0, sizeof(calot_seen_strand)};
    seen.felt = felt_;
    call(device_, "device.observe", observation_->observe, &seen);
}

void OperatorLink::send(const calot_feedback& feedback) {
    if (functions_ != nullptr) call(device_, "device.send", functions_->send, &feedback);
}

std::vector<std::pair<std::string, std::string>> OperatorLink::help() const {
    std::vector<std::pair<std::string, std::string>> lines;
    if (events_ == nullptr) return lines;
    const std::uint32_t count = std::min(events_->help_count(device_.instance->self), 100u);
    for (std::uint32_t i = 0; i < count; ++i) {
        calot_help_line line{};
        line.struct_size = sizeof line;
        call(device_, "device.help", events_->help, i, &line);
        lines.emplace_back(view(line.input), view(line.effect));
    }
    return lines;
}

} // namespace calot::simulation
