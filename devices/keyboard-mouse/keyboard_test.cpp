#include "keyboard.hpp"

#include <calot/plugin.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace calot::keyboard {
namespace {

// The device behind the contract, as the host drives it.
class Desk {
  public:
    Desk() {
        host_.struct_size = sizeof host_;
        host_.service = [](const calot_host*, calot_string) -> const void* { return nullptr; };
        exported_.create(exported_, &host_, instance_);
        device_ = static_cast<const calot_device*>(instance_.kind);
        events_ = static_cast<const calot_device_events*>(
            instance_.extension(instance_.self, string(CALOT_EXTENSION_EVENTS)));
        error_.struct_size = sizeof error_;
        instance_.init(instance_.self, &error_);
        calot_controls start = resting_controls();
        start.insertion = 0.14;
        device_->configure(instance_.self, &start, &error_);
        calot_activation activation{};
        activation.struct_size = sizeof activation;
        activation.step_nanoseconds = 1'000'000;
        instance_.activate(instance_.self, &activation, &error_);
        run(0);
    }
    ~Desk() { instance_.destroy(instance_.self); }

    void event(std::uint32_t kind, std::uint32_t code, double value, double x = 0, double y = 0) {
        const calot_input_event e{sizeof e, kind, code, value, x, y};
        events_->event(instance_.self, &e);
    }
    void down(Key key) { event(CALOT_EVENT_KEY, key, 1); }
    void up(Key key) { event(CALOT_EVENT_KEY, key, 0); }
    void tap(Key key) { down(key), run(1), up(key); }
    // Polls for so many ticks, and remembers the largest change of each control in one.
    void run(int ticks) {
        for (int i = 0; i <= ticks; ++i) {
            const calot_controls before = now;
            ASSERT_EQ(device_->poll(instance_.self, tick_, &now, &error_), CALOT_OK);
            if (tick_++ == 0) continue;
            fastest_push = std::max(fastest_push, std::abs(now.insertion - before.insertion));
            fastest_wheel = std::max(fastest_wheel, std::abs(now.wheel[0] - before.wheel[0]));
        }
    }
    void stop(bool is_stopped) {
        calot_feedback feedback{};
        feedback.struct_size = sizeof feedback;
        feedback.stopped = is_stopped;
        ASSERT_EQ(device_->send(instance_.self, &feedback, &error_), CALOT_OK);
    }
    std::vector<std::uint8_t> save() {
        std::vector<std::uint8_t> bytes;
        calot_sink sink{sizeof sink, &bytes, [](void* self, calot_bytes b) -> calot_status {
                            auto& all = *static_cast<std::vector<std::uint8_t>*>(self);
                            all.insert(all.end(), b.data, b.data + b.size);
                            return CALOT_OK;
                        }};
        EXPECT_EQ(instance_.save_state(instance_.self, &sink, &error_), CALOT_OK);
        return bytes;
    }
    void load(const std::vector<std::uint8_t>& bytes) {
        std::span<const std::uint8_t> rest(bytes);
        calot_source source{sizeof source, &rest, [](void* self, calot_bytes_out out) -> std::uint64_t {
                                auto& left = *static_cast<std::span<const std::uint8_t>*>(self);
                                const std::size_t n = std::min<std::size_t>(left.size(), out.size);
                                std::copy_n(left.begin(), n, out.data);
                                left = left.subspan(n);
                                return n;
                            }};
        EXPECT_EQ(instance_.load_state(instance_.self, &source, &error_), CALOT_OK) << error_.message;
    }

    calot_controls now = resting_controls();
    double fastest_push = 0, fastest_wheel = 0;
    const calot_device_events* events() const { return events_; }
    void* self() const { return instance_.self; }

  private:
    Export exported_ = export_device<Keyboard>("org.calot.keyboard", "Keyboard and mouse", "0.1.0");
    calot_host host_{};
    calot_instance instance_{};
    calot_error error_{};
    const calot_device* device_ = nullptr;
    const calot_device_events* events_ = nullptr;
    std::int64_t tick_ = 0;
};

TEST(Keyboard, a_held_key_pushes_at_the_stated_speed_from_where_the_case_began) {
    Desk desk;
    EXPECT_EQ(desk.now.insertion, 0.14);
    desk.down(key_w);
    desk.run(1000);
    const double pushed = desk.now.insertion - 0.14;
    // 60 mm/s for a second, less the lag of the hand (60 mm/s x 60 ms).
    EXPECT_NEAR(pushed, 0.06 - 0.06 * 0.06, 2e-4) << "pushed " << pushed << " m";
    EXPECT_LE(desk.fastest_push, 0.06 * 0.001 * (1 + 1e-9));
    desk.up(key_w);
    desk.run(500);
    const double rest = desk.now.insertion;
    desk.run(100);
    EXPECT_NEAR(desk.now.insertion, rest, 1e-6) << "a released key goes on pushing";
}

TEST(Keyboard, shift_makes_it_fine) {
    Desk coarse, fine;
    fine.down(key_left_shift);
    for (Desk* desk : {&coarse, &fine})
        desk->down(key_d), desk->run(500);
    EXPECT_GT(coarse.now.rotation, 0) << "D turns clockwise, which is positive";
    EXPECT_NEAR(fine.now.rotation / coarse.now.rotation, 0.25, 1e-9);
}

TEST(Keyboard, wheels_stay_where_they_are_left_and_a_key_centres_them) {
    Desk desk;
    desk.down(key_up), desk.down(key_left);
    desk.run(500);
    desk.up(key_up), desk.up(key_left);
    desk.run(1000);
    const double left[2] = {desk.now.wheel[0], desk.now.wheel[1]};
    EXPECT_GT(left[0], 0.5);
    EXPECT_GT(left[1], 0.5);
    desk.run(1000);
    EXPECT_NEAR(desk.now.wheel[0], left[0], 1e-6);
    desk.tap(key_c);
    desk.run(1500);
    EXPECT_EQ(desk.now.wheel[0], 0);
    EXPECT_EQ(desk.now.wheel[1], 0);
}

TEST(Keyboard, wheels_stop_at_the_endoscopes_angulation) {
    Desk desk;
    desk.down(key_down), desk.down(key_right);
    desk.run(5000);
    EXPECT_NEAR(desk.now.wheel[0] * 180 / M_PI, -90, 1e-9);
    EXPECT_NEAR(desk.now.wheel[1] * 180 / M_PI, -100, 1e-9);
}

TEST(Keyboard, the_mouse_turns_the_wheels_while_its_right_button_is_held_no_faster_than_a_hand) {
    Desk desk;
    desk.event(CALOT_EVENT_MOUSE_MOVE, 0, 0, 50, -100);
    desk.run(100);
    EXPECT_EQ(desk.now.wheel[0], 0);
    desk.event(CALOT_EVENT_MOUSE_BUTTON, 3, 1);
    desk.event(CALOT_EVENT_MOUSE_MOVE, 0, 0, 40, -100);
    desk.run(1000);
    EXPECT_NEAR(desk.now.wheel[0] * 180 / M_PI, 25, 1e-9);
    EXPECT_NEAR(desk.now.wheel[1] * 180 / M_PI, -10, 1e-9);
    EXPECT_LE(desk.fastest_wheel, M_PI / 2 * 0.001 * (1 + 1e-9));
}

TEST(Keyboard, brakes_hold_the_wheels) {
    Desk desk;
    desk.tap(key_b);
    desk.down(key_up);
    desk.run(500);
    EXPECT_EQ(desk.now.brake[0], 1u);
    EXPECT_EQ(desk.now.wheel[0], 0);
}

TEST(Keyboard, an_instrument_is_exchanged_only_when_withdrawn) {
    Desk desk;
    desk.tap(key_tab);
    desk.run(1);
    EXPECT_EQ(desk.now.port[0].instrument, 1u);
    desk.down(key_e);
    desk.run(1000);
    desk.up(key_e);
    EXPECT_NEAR(desk.now.port[0].insertion, 0.03, 1e-4);
    desk.tap(key_tab);
    desk.run(1);
    EXPECT_EQ(desk.now.port[0].instrument, 1u);
    desk.down(key_q);
    desk.run(2000);
    desk.up(key_q);
    desk.tap(key_tab);
    desk.run(1);
    EXPECT_EQ(desk.now.port[0].instrument, 2u);
    desk.tap(key_2);
    desk.tap(key_tab);
    desk.run(1);
    EXPECT_EQ(desk.now.port[1].instrument, 1u);
}

TEST(Keyboard, pedals_and_the_re_set_button_are_on_while_held) {
    Desk desk;
    desk.down(key_space), desk.down(key_r);
    desk.run(1);
    EXPECT_EQ(desk.now.pedals, unsigned{CALOT_PEDAL_CUT});
    EXPECT_EQ(desk.now.buttons, unsigned{CALOT_BUTTON_RESET});
    desk.up(key_space), desk.up(key_r);
    desk.run(1);
    EXPECT_EQ(desk.now.pedals, 0u);
    EXPECT_EQ(desk.now.buttons, 0u);
}

TEST(Keyboard, nothing_moves_while_the_case_stands_still_but_it_can_be_resumed) {
    Desk desk;
    desk.down(key_w);
    desk.run(100);
    desk.tap(key_p);
    EXPECT_EQ(desk.now.buttons, unsigned{CALOT_BUTTON_PAUSE});
    desk.stop(true);
    const double held = desk.now.insertion;
    desk.run(500);
    EXPECT_EQ(desk.now.insertion, held);
    desk.tap(key_p);
    EXPECT_EQ(desk.now.buttons, 0u);
    desk.stop(false);
    desk.run(500);
    EXPECT_GT(desk.now.insertion, held);
}

TEST(Keyboard, everything_is_let_go_when_the_window_loses_focus) {
    Desk desk;
    desk.down(key_w), desk.down(key_space);
    desk.run(100);
    desk.event(CALOT_EVENT_FOCUS, 0, 0);
    desk.run(1000);
    const double rest = desk.now.insertion;
    desk.run(100);
    EXPECT_NEAR(desk.now.insertion, rest, 1e-9);
    EXPECT_EQ(desk.now.pedals, 0u);
}

TEST(Keyboard, goes_on_bit_for_bit_from_a_saved_state) {
    Desk first, second;
    first.down(key_w), first.down(key_left);
    first.event(CALOT_EVENT_MOUSE_BUTTON, 3, 1);
    first.event(CALOT_EVENT_MOUSE_MOVE, 0, 0, 200, 100);
    first.run(137);
    second.load(first.save());
    first.run(400), second.run(400);
    EXPECT_EQ(first.now.insertion, second.now.insertion);
    EXPECT_EQ(first.now.wheel[0], second.now.wheel[0]);
    EXPECT_EQ(first.now.wheel[1], second.now.wheel[1]);
    EXPECT_EQ(first.save(), second.save());
}

TEST(Keyboard, every_help_line_says_what_its_key_does) {
    Desk desk;
    const std::uint32_t count = desk.events()->help_count(desk.self());
    EXPECT_GE(count, 20u);
    for (std::uint32_t i = 0; i < count; ++i) {
        calot_help_line line{};
        line.struct_size = sizeof line;
        ASSERT_EQ(desk.events()->help(desk.self(), i, &line, nullptr), CALOT_OK);
        EXPECT_FALSE(view(line.input).empty());
        EXPECT_FALSE(view(line.effect).empty());
    }
}

} // namespace
} // namespace calot::keyboard
