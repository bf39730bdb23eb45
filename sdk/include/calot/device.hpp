// Devices in C++: derive from calot::Device and export with CALOT_PLUGIN (plugin.hpp).
#pragma once

#include <calot/abi/device.h>
#include <calot/instance.hpp>

namespace calot {

class Device : public Instance {
  public:
    // Texts live as long as the instance. Called after init; may throw.
    virtual void sheet(calot_device_sheet& out) = 0;
    // The device goes on from these controls. May throw.
    virtual void configure(const calot_controls& start) = 0;
    // Real-time, like the one below: neither throws nor allocates. `out` holds the configured controls on the
    // first call, afterwards what the last poll left there.
    virtual Result poll(std::int64_t tick, calot_controls& out) = 0;
    virtual Result send(const calot_feedback& feedback) = 0;
};

// Mixed in by a device that takes the host window's input events (calot.device.events/1).
class EventDevice {
  public:
    virtual ~EventDevice() = default;
    // Real-time. Only called while active.
    virtual void event(const calot_input_event& event) = 0;
    struct HelpLine {
        std::string_view input;
        std::string_view effect;
    };
    virtual std::span<const HelpLine> help() const = 0;
};

// Mixed in by a device that sees what the screen shows (calot.device.observation/1).
class ObservingDevice {
  public:
    virtual ~ObservingDevice() = default;
    // Real-time. The spans live until it returns.
    virtual Result observe(const calot_observation& observation) = 0;
};

// Controls with everything at rest: what a case begins with where no pose says otherwise.
inline calot_controls resting_controls() {
    calot_controls c{};
    c.struct_size = sizeof c;
    c.retractor.quaternion[0] = 1;
    return c;
}

namespace detail {

inline void check_controls(Checker& check, const calot_controls& c) {
    check.real("controls.insertion", c.insertion);
    check.real("controls.rotation", c.rotation);
    check.reals("controls.wheel", c.wheel, 2);
    for (std::uint64_t i = 0; i < CALOT_MAX_PORTS; ++i) {
        const double values[3] = {c.port[i].insertion, c.port[i].opening, c.port[i].rotation};
        check.element("controls.port", i, "insertion, opening, rotation", values, 3);
    }
    const double flows[3] = {c.suction, c.air, c.water};
    check.reals("controls.suction, air, water", flows, 3);
    check.pose("controls.retractor", c.retractor);
    check.real("controls.retractor_grip", c.retractor_grip);
    check.reals("controls.table_tilt", c.table_tilt, 2);
}

inline void check_feedback(Checker& check, const calot_feedback& f) {
    check.real("feedback.insertion_force", f.insertion_force);
    check.real("feedback.rotation_torque", f.rotation_torque);
    check.reals("feedback.wheel_torque", f.wheel_torque, 2);
    check.reals("feedback.port_force", f.port_force, CALOT_MAX_PORTS);
}

struct DeviceCell final : Cell {
    Device* device = nullptr;
    EventDevice* events = nullptr;
    ObservingDevice* observer = nullptr;
    calot_controls controls = resting_controls(); // what the last poll gave, or configure
    const void* known_extension(std::string_view id) override;
};

struct DeviceFunctions {
    static DeviceCell& cell(void* self) { return static_cast<DeviceCell&>(*static_cast<Cell*>(self)); }

    static calot_status sheet(void* self, calot_device_sheet* out, calot_error* error) {
        DeviceCell& c = cell(self);
        if (c.life == Life::created) return wrong_state(error, "sheet", "can only be called after init");
        Checker check(error);
        if (!check.whole(out, "out")) return check.status();
        return guarded(error, [&] {
            c.device->sheet(*out);
            return CALOT_OK;
        });
    }
    static calot_status configure(void* self, const calot_controls* start, calot_error* error) {
        DeviceCell& c = cell(self);
        if (!may_configure(c)) return only_while_inactive(error, "configure");
        Checker check(error);
        if (!check.whole(start, "start")) return check.status();
        check_controls(check, *start);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] {
            c.device->configure(*start);
            c.controls = *start;
            c.controls.struct_size = sizeof c.controls;
            c.life = Life::configured;
            return CALOT_OK;
        });
    }
    static calot_status poll(void* self, std::int64_t tick, calot_controls* out, calot_error* error) {
        DeviceCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "poll");
        Checker check(error);
        if (!check.whole(out, "out")) return check.status();
        return guarded(error, [&] {
            calot_controls next = c.controls;
            const Result result = c.device->poll(tick, next);
            if (!result) return give(error, result);
            c.controls = next;
            const std::uint64_t size = out->struct_size;
            *out = next;
            out->struct_size = size;
            return calot_status{CALOT_OK};
        });
    }
    static calot_status send(void* self, const calot_feedback* feedback, calot_error* error) {
        DeviceCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "send");
        Checker check(error);
        if (!check.whole(feedback, "feedback")) return check.status();
        check_feedback(check, *feedback);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.device->send(*feedback)); });
    }
    static const calot_device* functions() {
        static const calot_device table{sizeof(calot_device), &sheet, &configure, &poll, &send};
        return &table;
    }

    static void event(void* self, const calot_input_event* event) {
        DeviceCell& c = cell(self);
        Checker check(nullptr);
        if (c.life != Life::active || !check.whole(event, "event")) return;
        check.real("event.value", event->value);
        check.real("event.x", event->x);
        check.real("event.y", event->y);
        if (!check.is_ok()) return;
        guarded(nullptr, [&] {
            c.events->event(*event);
            return CALOT_OK;
        });
    }
    static std::uint32_t help_count(void* self) {
        return static_cast<std::uint32_t>(cell(self).events->help().size());
    }
    static calot_status help(void* self, std::uint32_t index, calot_help_line* out, calot_error* error) {
        DeviceCell& c = cell(self);
        Checker check(error);
        if (!check.whole(out, "out")) return check.status();
        return guarded(error, [&] {
            const auto lines = c.events->help();
            if (index >= lines.size()) throw Error(CALOT_CODE_OUT_OF_RANGE, "index", "there is no such line");
            out->input = string(lines[index].input);
            out->effect = string(lines[index].effect);
            return CALOT_OK;
        });
    }
    static calot_status observe(void* self, const calot_observation* observation, calot_error* error) {
        DeviceCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "observe");
        Checker check(error);
        if (!check.whole(observation, "observation")) return check.status();
        check.reals("observation.view.position", observation->view.position, 3);
        check.unit("observation.view.quaternion", observation->view.quaternion, 4);
        check.real("observation.field_of_view", observation->field_of_view);
        check.real("observation.fade", observation->fade);
        check.list<calot_marker>(observation->markers, UINT32_MAX, "observation.markers");
        check.list<calot_seen_instrument>(observation->instruments, UINT32_MAX, "observation.instruments");
        check.list<calot_seen_strand>(observation->strands, UINT32_MAX, "observation.strands");
        if (check.is_ok()) check_lists(check, *observation);
        check_feedback(check, observation->felt);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.observer->observe(*observation)); });
    }

    static void check_lists(Checker& check, const calot_observation& o) {
        std::uint64_t i = 0;
        for (const calot_marker& m : items<calot_marker>(o.markers)) {
            check.element("observation.markers", i, "position", m.position, 3);
            check.element("observation.markers", i, "normal", m.normal, 3);
            check.element("observation.markers", i++, "radius", &m.radius, 1);
            check.reals("observation.markers.polyline", m.polyline);
            check.require(m.polyline.size % 3 == 0, CALOT_CODE_INVALID_ARGUMENT,
                          "observation.markers.polyline", "must have three reals for each point");
        }
        i = 0;
        for (const calot_seen_instrument& s : items<calot_seen_instrument>(o.instruments)) {
            check.element("observation.instruments", i, "tip.position", s.tip.position, 3);
            check.element("observation.instruments", i, "tip.quaternion", s.tip.quaternion, 4);
            const double values[2] = {s.opening, s.protrusion};
            check.element("observation.instruments", i++, "opening, protrusion", values, 2);
        }
        i = 0;
        for (const calot_seen_strand& s : items<calot_seen_strand>(o.strands)) {
            check.element("observation.strands", i, "from", s.from, 3);
            check.element("observation.strands", i++, "to", s.to, 3);
        }
    }
};

inline const void* DeviceCell::known_extension(std::string_view id) {
    static const calot_device_events event_functions{sizeof(calot_device_events), &DeviceFunctions::event,
                                                     &DeviceFunctions::help_count, &DeviceFunctions::help};
    static const calot_device_observation observation_functions{sizeof(calot_device_observation),
                                                                &DeviceFunctions::observe};
    if (id == CALOT_EXTENSION_EVENTS && events != nullptr) return &event_functions;
    if (id == CALOT_EXTENSION_OBSERVATION && observer != nullptr) return &observation_functions;
    return nullptr;
}

} // namespace detail
} // namespace calot
