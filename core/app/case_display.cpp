#include "app/case_display.hpp"

#include "app/case_picture.hpp"
#include "host/error.hpp"
#include "launcher/case_window.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <signal.h>
#include <thread>
#include <unistd.h>

namespace calot::app {
namespace {

using Clock = std::chrono::steady_clock;

volatile sig_atomic_t asked_to_stop = 0;

class ProgressLine : public CaseDisplay {
  public:
    explicit ProgressLine(simulation::Simulation& simulation) : simulation_(simulation) {}
    ~ProgressLine() override {
        if (has_written_) std::fputs("\n", stderr);
    }
    void show() override {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        const auto now = Clock::now();
        if (now - shown_ < (is_terminal_ ? std::chrono::milliseconds(200) : std::chrono::milliseconds(10000)))
            return;
        const auto last = simulation_.latest();
        if (!last) return;
        shown_ = now;
        const double wall = std::chrono::duration<double>(now - began_).count();
        const std::string task(last->task.view());
        std::fprintf(stderr, "%s%7.1f s  %-12s  %.2f times real time%s", is_terminal_ ? "\r" : "",
                     last->seconds(), task.c_str(), last->seconds() / wall, is_terminal_ ? "   " : "\n");
        std::fflush(stderr);
        has_written_ = is_terminal_;
    }

  private:
    simulation::Simulation& simulation_;
    bool is_terminal_ = isatty(STDERR_FILENO) == 1;
    bool has_written_ = false;
    Clock::time_point began_ = Clock::now(), shown_ = began_;
};

launcher::CaseWindowSettings window_settings(const simulation::Simulation& simulation,
                                             const CasePicture& picture, const std::string& title) {
    if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr)
        throw host::UserError("--headless", "",
                              "there is no display (DISPLAY is not set); add --headless, or start "
                              "it from a desktop");
    launcher::CaseWindowSettings settings;
    settings.title = title + " - Calot";
    settings.renderer = picture.settings(settings.width, settings.height);
    for (const auto& [input, effect] : simulation.device_help())
        settings.device_help.push_back({input, effect});
    return settings;
}

class WindowDisplay : public CaseDisplay {
  public:
    WindowDisplay(simulation::Simulation& simulation, const simulation::World& world,
                  const std::string& title)
        : simulation_(simulation), picture_(world, simulation.tasks()),
          window_(window_settings(simulation, picture_, title),
                  [this](const calot_input_event& event) { simulation_.input().push(event); }) {
        picture_.add_surfaces(window_.renderer());
        window_.frame_external_view(picture_.centre(), picture_.radius());
    }
    void show() override {
        // At most 60 pictures a second, whether or not the swap waits for the screen.
        std::this_thread::sleep_until(next_);
        next_ = std::max(next_ + std::chrono::microseconds(16667), Clock::now());
        const auto last = simulation_.latest();
        if (!last) return;
        switch (window_.show(picture_.frame(*last), picture_.status(*last))) {
        case launcher::CaseRequest::None:
            break;
        case launcher::CaseRequest::Pause:
            simulation_.pause(true);
            break;
        case launcher::CaseRequest::Resume:
            simulation_.pause(false);
            break;
        case launcher::CaseRequest::Finish:
            simulation_.stop();
            break;
        }
    }

  private:
    simulation::Simulation& simulation_;
    CasePicture picture_;
    launcher::CaseWindow window_;
    Clock::time_point next_ = Clock::now();
};

} // namespace

std::unique_ptr<CaseDisplay> make_window(simulation::Simulation& simulation, const simulation::World& world,
                                         const std::string& title) {
    return std::make_unique<WindowDisplay>(simulation, world, title);
}

std::unique_ptr<CaseDisplay> make_progress_line(simulation::Simulation& simulation) {
    return std::make_unique<ProgressLine>(simulation);
}

void StopSignal::install() {
    struct sigaction action {};
    action.sa_handler = [](int) { asked_to_stop = 1; };
    sigemptyset(&action.sa_mask);
    sigaction(SIGTERM, &action, nullptr);
}

bool StopSignal::is_set() {
    return asked_to_stop != 0;
}

} // namespace calot::app
