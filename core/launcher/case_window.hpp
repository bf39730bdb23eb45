// The window in which a case is performed: both views, status, help, pause.
#pragma once

#include "rendering/orbit_camera.hpp"
#include "rendering/renderer.hpp"
#include "rendering/window.hpp"

#include <calot/abi/device.h>

#include <functional>
#include <string>
#include <vector>

namespace calot::launcher {

/// What the case says about itself, for the lines under the endoscope's picture.
struct CaseStatus {
    double seconds = 0; // of simulated time
    std::string task;   // title of the task at hand
    std::string message;
    double push_force = 0, turn_torque = 0; // felt by the hands, N and N m
    double tissue_force = 0;                // N
    long late_ticks = 0, slipped_ticks = 0; // see simulation::LateTicks; slipped ones are shown prominently
    bool is_paused = false;
    bool is_finished = false;
};

/// The lines of rendering::FrameState::endoscope_text, the same in a window and in a video.
std::vector<std::string> status_lines(const CaseStatus&);

struct HelpLine {
    std::string input, effect;
};

struct CaseWindowSettings {
    std::string title = "Calot";
    std::vector<HelpLine> device_help; // what the device's keys do
    int width = 1440, height = 800;
    rendering::RendererSettings renderer; // its size is the window's
};

enum class CaseRequest { None, Pause, Resume, Finish };

/// On the program's first thread, like rendering::Window.
class CaseWindow {
  public:
    /// `input` gets every raw event for the device, except while a panel is open (then everything held is let
    /// go).
    CaseWindow(const CaseWindowSettings&, std::function<void(const calot_input_event&)> input);

    ~CaseWindow();

    /// Surfaces are added here before the first frame.
    rendering::Renderer& renderer() { return renderer_; }

    /// Draws one frame. The external view's camera, its being on or off and the text lines are this window's;
    /// the rest is taken as given. Returns what the user asks for; closing the window is Finish.
    CaseRequest show(rendering::FrameState frame, const CaseStatus&);

    /// Where the external view starts: a ball that should be in view.
    void frame_external_view(const rendering::Vec3& centre, double radius);

  private:
    void handle(const rendering::WindowEvent&, const CaseStatus&);
    void draw_panels(rendering::Overlay&, const CaseStatus&);
    void let_go(); // tells the device that nothing is held any more
    bool panel_open(const CaseStatus& s) const { return show_help_ || s.is_paused; }

    CaseWindowSettings settings_;
    std::function<void(const calot_input_event&)> input_;
    rendering::Window window_;
    rendering::Renderer renderer_;
    rendering::OrbitCamera camera_;
    bool external_on_ = true, show_help_ = false, dragging_ = false, shifting_ = false;
    int walls_ = 0; // 0 as the case says, 1 solid, 2 cut open
    CaseRequest request_ = CaseRequest::None;
};

} // namespace calot::launcher
