// Keyboard and mouse as an endoscope's controls.
#pragma once

#include <calot/device.hpp>

#include <array>
#include <bitset>
#include <cstdint>

namespace calot::keyboard {

// SDL scancodes of the keys that do something (they are USB HID usage numbers).
enum Key : std::uint32_t {
    key_a = 4,
    key_b = 5,
    key_c = 6,
    key_d = 7,
    key_e = 8,
    key_g = 10,
    key_h = 11,
    key_i = 12,
    key_j = 13,
    key_k = 14,
    key_l = 15,
    key_o = 18,
    key_p = 19,
    key_q = 20,
    key_r = 21,
    key_s = 22,
    key_t = 23,
    key_u = 24,
    key_v = 25,
    key_w = 26,
    key_x = 27,
    key_y = 28,
    key_z = 29,
    key_1 = 30,
    key_2 = 31,
    key_3 = 32,
    key_tab = 43,
    key_space = 44,
    key_comma = 54,
    key_period = 55,
    key_home = 74,
    key_page_up = 75,
    key_end = 77,
    key_page_down = 78,
    key_right = 79,
    key_left = 80,
    key_down = 81,
    key_up = 82,
    key_left_ctrl = 224,
    key_left_shift = 225,
    key_right_ctrl = 228,
    key_right_shift = 229,
};

// Index in Keyboard::parameters().
enum Setting : std::size_t {
    insertion_speed,
    rotation_speed,
    wheel_speed,
    fine_factor,
    mouse_gain,
    instrument_count,
};

class Keyboard final : public Device, public EventDevice {
  public:
    void sheet(calot_device_sheet& out) override;
    void configure(const calot_controls& start) override;
    void activate(const calot_activation& activation) override;
    void reset(std::uint64_t seed) override;
    void save(StateWriter& to) const override;
    void load(StateReader& from) override;
    std::span<const Parameter> parameters() const override;
    Result poll(std::int64_t tick, calot_controls& out) override;
    Result send(const calot_feedback& feedback) override;
    void event(const calot_input_event& event) override;
    std::span<const HelpLine> help() const override;

  private:
    // Everything that steers the future, beside the controls themselves.
    struct State {
        calot_controls controls = resting_controls();
        std::bitset<256> held;
        std::array<double, 2> mouse{}; // rad of wheel that the mouse has asked for and not been given yet
        double insertion_velocity = 0; // m/s
        double rotation_velocity = 0;  // rad/s
        std::array<double, 2> wheel_velocity{}; // rad/s
        std::uint32_t port = 0;
        bool is_mouse_steering = false;
        bool is_centring = false;
        bool is_stopped = false; // the case stands still
    };

    bool held(Key key) const { return state_.held[key]; }
    // -1, 0 or 1
    double axis(Key minus, Key plus) const { return (held(plus) ? 1 : 0) - (held(minus) ? 1 : 0); }
    void press(Key key);
    void move_shaft(double pace);
    void move_wheels(double pace);
    void move_port(double pace);
    void move_assistant(double pace);

    State state_;
    State start_;          // as configured
    double step_ = 0.001;  // s
    double smoothing_ = 1; // part of the way to the asked-for velocity that one step goes
};

} // namespace calot::keyboard
