#pragma once

#include "app/case_picture.hpp"
#include "simulation/simulation.hpp"

#include <filesystem>
#include <memory>

namespace calot::app {

/// Draws both views at 30 pictures a simulated second (15 without a GPU) into a video, on a thread of its
/// own. A run as fast as possible waits for it, so that no picture is missing; a run in real time never does:
/// then the pictures that it could not draw are counted.
class VideoRecorder : public simulation::Observer {
  public:
    /// Throws host::UserError when the file or the picture can't be made. [main]
    VideoRecorder(const std::filesystem::path& file, const simulation::World& world,
                  const std::vector<simulation::TaskState>& tasks, bool may_wait);
    ~VideoRecorder() override;

    void began(const simulation::Snapshot& snapshot) override;
    void ticked(const simulation::Snapshot& snapshot) override;
    void ended(const simulation::Snapshot& snapshot) override;

    /// Waits until the file is complete. Throws host::UserError when it could not be written. [main]
    void finish();
    std::size_t frames() const;
    std::size_t missed() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace calot::app
