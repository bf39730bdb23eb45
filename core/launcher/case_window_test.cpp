// The case's window with synthetic events: under whatever display there is (./test starts one), else on SDL's
// offscreen driver.
#include "launcher/case_window.hpp"
#include "rendering/egl_context.hpp"
#include "rendering/example_scene.hpp"
#include "rendering/png.hpp"

#include <SDL2/SDL.h>
#include <gtest/gtest.h>

#include <cstdlib>

namespace calot::launcher {
namespace {

using rendering::ExampleScene;
using rendering::Image;

class CaseWindowTest : public testing::Test {
  protected:
    void SetUp() override {
        rendering::limit_software_threads();
        if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY"))
            setenv("SDL_VIDEODRIVER", "offscreen", 0);
        settings_.width = 960;
        settings_.height = 540;
        settings_.device_help = {{"W / S", "push the endoscope in / pull it out"}};
        try {
            window_ = std::make_unique<CaseWindow>(
                settings_, [this](const calot_input_event& e) { events_.push_back(e); });
        } catch (const std::exception& error) {
            GTEST_SKIP() << error.what();
        }
        for (const auto& s : scene_.surfaces)
            window_->renderer().add(s);
        status_.task = "Navigation";
        status_.message =
            "Find the red ring on the anterior wall of the stomach and pass through it into the abdomen.";
        show(); // also takes in the events of the window's opening
        events_.clear();
    }

    CaseRequest show() { return window_->show(scene_.frame, status_); }

    Image picture(const char* name) {
        Image image;
        window_->renderer().read(image);
        if (const char* folder = std::getenv("CALOT_TEST_PICTURES"))
            rendering::write_png(std::string(folder) + "/" + name + ".png", image);
        return image;
    }

    static void key(SDL_Scancode code, bool down) {
        SDL_Event e{};
        e.type = down ? SDL_KEYDOWN : SDL_KEYUP;
        e.key.keysym.scancode = code;
        SDL_PushEvent(&e);
    }
    static void press(SDL_Scancode code) {
        key(code, true);
        key(code, false);
    }

    CaseWindowSettings settings_;
    ExampleScene scene_ = rendering::make_example_scene(8000);
    CaseStatus status_;
    std::vector<calot_input_event> events_;
    std::unique_ptr<CaseWindow> window_;
};

TEST_F(CaseWindowTest, keys_reach_the_device_as_scancodes_down_and_up) {
    press(SDL_SCANCODE_W);
    EXPECT_EQ(show(), CaseRequest::None);
    ASSERT_EQ(events_.size(), 2u);
    EXPECT_EQ(events_[0].kind, static_cast<std::uint32_t>(CALOT_EVENT_KEY));
    EXPECT_EQ(events_[0].code, static_cast<std::uint32_t>(SDL_SCANCODE_W));
    EXPECT_EQ(events_[0].value, 1);
    EXPECT_EQ(events_[1].value, 0);
    picture("case-window");
}

TEST_F(CaseWindowTest, escape_pauses_and_resumes_and_everything_held_is_let_go) {
    press(SDL_SCANCODE_ESCAPE);
    EXPECT_EQ(show(), CaseRequest::Pause);
    const auto lost = [](const calot_input_event& e) { return e.kind == CALOT_EVENT_FOCUS && e.value == 0; };
    EXPECT_EQ(std::count_if(events_.begin(), events_.end(), lost), 1);
    status_.is_paused = true;
    show();
    show();
    picture("case-paused");
    events_.clear();
    press(SDL_SCANCODE_W);
    press(SDL_SCANCODE_ESCAPE);
    EXPECT_EQ(show(), CaseRequest::Resume);
    for (const auto& e : events_)
        EXPECT_NE(e.kind, static_cast<std::uint32_t>(CALOT_EVENT_KEY))
            << "keys must not reach the device while the panel is open";
}

TEST_F(CaseWindowTest, f1_shows_help_over_the_picture) {
    const Image before = picture("case-before-help");
    press(SDL_SCANCODE_F1);
    show();
    show();
    const Image after = picture("case-help");
    ASSERT_EQ(before.rgba.size(), after.rgba.size());
    std::size_t changed = 0;
    for (std::size_t i = 0; i < before.rgba.size(); i += 4)
        changed += std::abs(before.rgba[i] - after.rgba[i]) > 20;
    EXPECT_GT(changed, before.rgba.size() / 4 / 10) << "pixels that differ with the help open";
}

TEST_F(CaseWindowTest, f2_gives_the_endoscope_the_whole_window_and_dragging_turns_the_external_view) {
    const Image before = picture("case-two-views");
    SDL_Event e{};
    e.type = SDL_MOUSEBUTTONDOWN;
    e.button.button = 1;
    e.button.x = 200;
    e.button.y = 200;
    SDL_PushEvent(&e);
    e = {};
    e.type = SDL_MOUSEMOTION;
    e.motion.x = 260;
    e.motion.y = 200;
    e.motion.xrel = 60;
    SDL_PushEvent(&e);
    show();
    const Image turned = picture("case-turned");
    std::size_t changed = 0;
    for (int y = 60; y < 480; ++y)
        for (int x = 0; x < 480; ++x)
            changed += std::abs(before.pixel(x, y)[0] - turned.pixel(x, y)[0]) > 12;
    EXPECT_GT(changed, 2000u) << "the external view did not turn";
    press(SDL_SCANCODE_F2);
    show();
    EXPECT_EQ(window_->renderer().layout(false).mask.width, 540);
    const Image alone = picture("case-endoscope-alone");
    EXPECT_GT(alone.pixel(480, 270)[0], 30) << "the endoscope's picture is in the middle now";
}

TEST_F(CaseWindowTest, closing_the_window_finishes_the_case) {
    SDL_Event e{};
    e.type = SDL_QUIT;
    SDL_PushEvent(&e);
    EXPECT_EQ(show(), CaseRequest::Finish);
}

TEST(StatusLines, time_that_slips_is_never_hidden) {
    CaseStatus s;
    s.seconds = 75.4;
    s.task = "Navigation";
    s.slipped_ticks = 2500;
    s.push_force = -0.01;
    const auto lines = status_lines(s);
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_EQ(lines[0], "Navigation");
    EXPECT_NE(lines[1].find("push 0.0 N"), std::string::npos) << lines[1];
    EXPECT_NE(lines[1].find("01:15"), std::string::npos) << lines[1];
    EXPECT_NE(lines[1].find("SLOWER THAN REAL TIME by 2.5 s"), std::string::npos) << lines[1];
}

} // namespace
} // namespace calot::launcher
