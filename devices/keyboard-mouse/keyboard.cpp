#include "keyboard.hpp"

#include <calot/math.hpp>

#include <algorithm>
#include <cmath>

namespace calot::keyboard {
namespace {

constexpr double degree = 3.14159265358979323846 / 180;

// Stops of the wheels: the angulation of a GIF-2T160 (up 210, down 90, left and right 100 degrees; Olympus).
constexpr double wheel_up = 210 * degree, wheel_down = -90 * degree, wheel_side = 100 * degree;

// A hand does not reach its speed at once: time constant of the velocities, s.
constexpr double hand_lag = 0.06;

// Instruments and the assistant: speeds and bounds.
constexpr double instrument_speed = 0.03;                         // m/s
constexpr double instrument_out = -0.01, instrument_reach = 0.08; // m; stroke beyond the tip up to 80 mm
constexpr double jaw_rate = 2;                                    // 1/s: half a second from closed to open
constexpr double instrument_turn = 180 * degree;                  // rad/s
constexpr double retractor_speed = 0.05;                          // m/s
constexpr double tilt_speed = 5 * degree, tilt_limit = 30 * degree;

constexpr std::array<Parameter, 6> table = {{
    {"insertion-speed", "Speed of pushing and pulling", "m/s", 0.005, 0.2, 0.06, false},
    {"rotation-speed", "Speed of turning", "rad/s", 0.1, 6.3, 90 * degree, false},
    {"wheel-speed", "Speed of the wheels", "rad/s", 0.1, 3.2, 90 * degree, false},
    {"fine-factor", "Part of these speeds while Shift is held", "", 0.05, 1, 0.25, false},
    {"mouse-gain", "Wheel angle for each pixel of the mouse", "rad", 0.0005, 0.02, 0.25 * degree, false},
    {"instrument-count", "Instruments on the tray", "", 0, 16, 4, true},
}};

constexpr std::array<EventDevice::HelpLine, 22> lines = {{
    {"W / S", "push the endoscope in / pull it out"},
    {"A / D", "turn the shaft anticlockwise / clockwise"},
    {"Up / Down", "large wheel: tip up / down"},
    {"Left / Right", "small wheel: tip left / right"},
    {"Right mouse button and move", "both wheels"},
    {"C", "centre the wheels"},
    {"B", "brakes of the wheels on / off"},
    {"Shift", "fine: everything at a quarter of its speed"},
    {"R (hold)", "re-set the hose: pushing and turning without effect"},
    {"1 / 2 / 3", "choose a port: first channel, second channel, assistant"},
    {"Tab", "next instrument of that port, once it is withdrawn"},
    {"E / Q", "advance / withdraw the instrument"},
    {"X / Z", "open / close its jaws"},
    {", / .", "turn it left / right"},
    {"T (hold)", "its trigger"},
    {"Space (hold)", "pedal: cut"},
    {"Ctrl (hold)", "pedal: coagulate"},
    {"V / G / H (hold)", "suction / air / water"},
    {"J L, I K, U O", "retractor: left and right, up and down, forward and back"},
    {"Y", "retractor: grip / let go"},
    {"Page up / down, Home / End", "tilt the table: head, sides"},
    {"P", "pause / go on"},
}};

// Moves `value` by `by`, no further than `target`.
double approach(double value, double target, double by) {
    return value < target ? std::min(value + by, target) : std::max(value - by, target);
}

} // namespace

std::span<const Parameter> Keyboard::parameters() const {
    return table;
}
std::span<const EventDevice::HelpLine> Keyboard::help() const {
    return lines;
}

void Keyboard::sheet(calot_device_sheet& out) {
    const auto size = out.struct_size;
    out = {};
    out.struct_size = size;
    out.title = string("Keyboard and mouse");
    out.rate = 1000;
}

void Keyboard::configure(const calot_controls& start) {
    State fresh;
    fresh.controls = start;
    start_ = state_ = fresh;
}

void Keyboard::activate(const calot_activation& activation) {
    step_ = 1e-9 * static_cast<double>(activation.step_nanoseconds);
    smoothing_ = 1 - std::exp(-step_ / hand_lag);
    state_ = start_;
}

void Keyboard::reset(std::uint64_t) {
    state_ = start_;
}

void Keyboard::save(StateWriter& to) const {
    const State& s = state_;
    const calot_controls& c = s.controls;
    to.value(c.insertion), to.value(c.rotation);
    to.values<double>(c.wheel), to.values<std::uint32_t>(c.brake);
    for (const calot_port_controls& p : c.port) {
        to.value(p.instrument), to.value(p.trigger);
        to.value(p.insertion), to.value(p.opening), to.value(p.rotation);
    }
    to.value(c.pedals), to.value(c.buttons);
    to.value(c.suction), to.value(c.air), to.value(c.water);
    to.values<double>(c.retractor.position), to.values<double>(c.retractor.quaternion);
    to.value(c.retractor_grip), to.values<double>(c.table_tilt);
    for (std::size_t key = 0; key < s.held.size(); ++key)
        to.value<bool>(s.held[key]);
    to.values<double>(s.mouse);
    to.value(s.insertion_velocity), to.value(s.rotation_velocity), to.values<double>(s.wheel_velocity);
    to.value(s.port), to.value(s.is_mouse_steering), to.value(s.is_centring), to.value(s.is_stopped);
}

void Keyboard::load(StateReader& from) {
    State s;
    calot_controls& c = s.controls;
    from.value(c.insertion), from.value(c.rotation);
    from.values<double>(c.wheel), from.values<std::uint32_t>(c.brake);
    for (calot_port_controls& p : c.port) {
        from.value(p.instrument), from.value(p.trigger);
        from.value(p.insertion), from.value(p.opening), from.value(p.rotation);
    }
    from.value(c.pedals), from.value(c.buttons);
    from.value(c.suction), from.value(c.air), from.value(c.water);
    from.values<double>(c.retractor.position), from.values<double>(c.retractor.quaternion);
    from.value(c.retractor_grip), from.values<double>(c.table_tilt);
    for (std::size_t key = 0; key < s.held.size(); ++key)
        s.held[key] = from.value<std::uint8_t>() != 0;
    from.values<double>(s.mouse);
    from.value(s.insertion_velocity), from.value(s.rotation_velocity), from.values<double>(s.wheel_velocity);
    from.value(s.port);
    if (s.port >= CALOT_MAX_PORTS) StateReader::corrupt("names a port that does not exist");
    for (bool* flag : {&s.is_mouse_steering, &s.is_centring, &s.is_stopped})
        *flag = from.value<std::uint8_t>() != 0;
    state_ = s;
}

void Keyboard::event(const calot_input_event& event) {
    switch (event.kind) {
    case CALOT_EVENT_KEY:
        if (event.code >= state_.held.size()) return;
        // Repeats of a held key come as further downs.
        if (event.value != 0 && !state_.held[event.code]) press(static_cast<Key>(event.code));
        state_.held[event.code] = event.value != 0;
        break;
    case CALOT_EVENT_MOUSE_BUTTON:
        if (event.code == 3) state_.is_mouse_steering = event.value != 0;
        break;
    case CALOT_EVENT_MOUSE_MOVE:
        if (!state_.is_mouse_steering || state_.is_stopped) return;
        // Up on the desk is tip up; x grows to the right, the left-right wheel to the left.
        state_.mouse[0] -= parameter(mouse_gain) * event.y;
        state_.mouse[1] -= parameter(mouse_gain) * event.x;
        state_.is_centring = false;
        break;
    case CALOT_EVENT_FOCUS:
        if (event.value != 0) return;
        state_.held.reset();
        state_.is_mouse_steering = false;
        break;
    default:
        break;
    }
}

void Keyboard::press(Key key) {
    calot_controls& c = state_.controls;
    if (key == key_p) c.buttons ^= CALOT_BUTTON_PAUSE;
    if (state_.is_stopped) return;
    calot_port_controls& port = c.port[state_.port];
    switch (key) {
    case key_1:
        state_.port = 0;
        break;
    case key_2:
        state_.port = 1;
        break;
    case key_3:
        state_.port = 2;
        break;
    case key_b:
        c.brake[0] = c.brake[1] = c.brake[0] == 0;
        break;
    case key_c:
        state_.is_centring = true;
        break;
    case key_y:
        c.retractor_grip = c.retractor_grip < 0.5 ? 1 : 0;
        break;
    case key_tab:
        // What is still in the patient can't be exchanged.
        if (port.insertion > 0) break;
        port.instrument =
            (port.instrument + 1) % (static_cast<std::uint32_t>(parameter(instrument_count)) + 1);
        port.opening = 0, port.rotation = 0;
        break;
    case key_up:
    case key_down:
    case key_left:
    case key_right:
        state_.is_centring = false;
        break;
    default:
        break;
    }
}

Result Keyboard::poll(std::int64_t, calot_controls& out) {
    calot_controls& c = state_.controls;
    if (!state_.is_stopped) {
        const bool is_fine = held(key_left_shift) || held(key_right_shift);
        const double pace = is_fine ? parameter(fine_factor) : 1;
        move_shaft(pace);
        move_wheels(pace);
        move_port(pace);
        move_assistant(pace);
        const bool is_coagulating = held(key_left_ctrl) || held(key_right_ctrl);
        c.pedals = 0;
        if (held(key_space)) c.pedals |= CALOT_PEDAL_CUT;
        if (is_coagulating) c.pedals |= CALOT_PEDAL_COAGULATE;
        c.buttons &= ~static_cast<std::uint32_t>(CALOT_BUTTON_RESET);
        if (held(key_r)) c.buttons |= CALOT_BUTTON_RESET;
        c.suction = held(key_v), c.air = held(key_g), c.water = held(key_h);
    }
    out = c;
    return Result::ok();
}

Result Keyboard::send(const calot_feedback& feedback) {
    state_.is_stopped = feedback.stopped != 0;
    if (state_.is_stopped) {
        state_.insertion_velocity = state_.rotation_velocity = 0;
        state_.wheel_velocity = {};
        state_.mouse = {};
    }
    return Result::ok();
}

void Keyboard::move_shaft(double pace) {
    State& s = state_;
    const double insertion = pace * parameter(insertion_speed) * axis(key_s, key_w);
    // Clockwise for the operator, who looks along the base's +z, is right-handed.
    const double rotation = pace * parameter(rotation_speed) * axis(key_a, key_d);
    s.insertion_velocity += smoothing_ * (insertion - s.insertion_velocity);
    s.rotation_velocity += smoothing_ * (rotation - s.rotation_velocity);
    s.controls.insertion += step_ * s.insertion_velocity;
    s.controls.rotation += step_ * s.rotation_velocity;
}

void Keyboard::move_wheels(double pace) {
    State& s = state_;
    const double asked[2] = {axis(key_down, key_up), axis(key_right, key_left)};
    const double low[2] = {wheel_down, -wheel_side}, high[2] = {wheel_up, wheel_side};
    const double most = parameter(wheel_speed) * step_;
    for (std::size_t i = 0; i < 2; ++i) {
        double& wheel = s.controls.wheel[i];
        if (s.controls.brake[i] != 0) {
            s.wheel_velocity[i] = s.mouse[i] = 0;
            continue;
        }
        s.wheel_velocity[i] += smoothing_ * (pace * parameter(wheel_speed) * asked[i] - s.wheel_velocity[i]);
        // The mouse is followed no faster than a hand turns the wheel.
        const double by_mouse = clamp(pace * s.mouse[i], -most, most);
        s.mouse[i] -= by_mouse / pace;
        wheel = clamp(wheel + step_ * s.wheel_velocity[i] + by_mouse, low[i], high[i]);
        if (s.is_centring) s.wheel_velocity[i] = 0, wheel = approach(wheel, 0, most);
    }
    if (s.controls.wheel[0] == 0 && s.controls.wheel[1] == 0) s.is_centring = false;
}

void Keyboard::move_port(double pace) {
    calot_port_controls& port = state_.controls.port[state_.port];
    for (calot_port_controls& other : state_.controls.port)
        other.trigger = 0;
    if (port.instrument == 0) return;
    port.insertion = clamp(port.insertion + pace * instrument_speed * step_ * axis(key_q, key_e),
                           instrument_out, instrument_reach);
    port.opening = clamp(port.opening + pace * jaw_rate * step_ * axis(key_z, key_x), 0, 1);
    port.rotation += pace * instrument_turn * step_ * axis(key_comma, key_period);
    port.trigger = held(key_t);
}

void Keyboard::move_assistant(double pace) {
    calot_controls& c = state_.controls;
    const double by = pace * retractor_speed * step_;
    // World axes: +x left, +y posterior, +z superior. The patient lies on his back: up is anterior.
    c.retractor.position[0] += by * axis(key_l, key_j);
    c.retractor.position[1] += by * axis(key_i, key_k);
    c.retractor.position[2] += by * axis(key_o, key_u);
    const double turn = pace * tilt_speed * step_;
    c.table_tilt[0] =
        clamp(c.table_tilt[0] + turn * axis(key_page_up, key_page_down), -tilt_limit, tilt_limit);
    c.table_tilt[1] = clamp(c.table_tilt[1] + turn * axis(key_end, key_home), -tilt_limit, tilt_limit);
}

} // namespace calot::keyboard
