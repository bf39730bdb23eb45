#pragma once

#include "launcher/case_window.hpp"
#include "rendering/renderer.hpp"
#include "simulation/simulation.hpp"

#include <map>
#include <string>
#include <vector>

namespace calot::app {

/// Turns snapshots of a case into what the renderer and the window show: the same in a window and in a video.
class CasePicture {
  public:
    CasePicture(const simulation::World& world, const std::vector<simulation::TaskState>& tasks);

    /// Adds the organs. On the thread that draws.
    void add_surfaces(rendering::Renderer& renderer);
    rendering::RendererSettings settings(int width, int height) const;

    /// Everything but the external camera and the texts.
    rendering::FrameState frame(const simulation::Snapshot& snapshot) const;
    launcher::CaseStatus status(const simulation::Snapshot& snapshot) const;

    /// A ball that the external view should show.
    rendering::Vec3 centre() const { return centre_; }
    double radius() const { return radius_; }

  private:
    const simulation::World& world_;
    std::map<std::string, std::string, std::less<>> titles_; ///< of tasks
    std::vector<rendering::SurfaceState> surfaces_;
    rendering::Vec3 centre_{};
    double radius_ = 0.2;
};

} // namespace calot::app
