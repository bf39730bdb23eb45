// What opens when `calot` is started without arguments: choose a procedure, perform it, see the metrics.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace calot::rendering {
struct Image;
}

namespace calot::launcher {

/// A procedure as its manifest describes it.
struct ProcedureEntry {
    std::string id, title, specialty, level;
    double minutes = 0;
    std::string description;
    std::filesystem::path picture; // PNG; may be empty
    std::string demonstration;     // id of the device that shows it; empty: none
    std::uint64_t demonstration_seed = 1;
};

struct DeviceEntry {
    std::string id, title;
};

struct LauncherSettings {
    std::vector<ProcedureEntry> procedures;
    std::vector<DeviceEntry> devices;
    std::vector<std::string> refusals;  // one line for each plugin that was refused
    std::filesystem::path program;      // `calot`, for the cases
    std::filesystem::path cases_folder; // each case gets a folder of its own in it
    std::string preferred_device;       // chosen at first, if there
    double text_scale = 1.15;
    int width = 1280, height = 800;
};

/// What is on the screen.
enum class LauncherPage { Choose, Running, Results };

/// On the program's first thread. A case runs as `PROGRAM run ID --device ID --seed N --operator CODE --out
/// FOLDER`.
class Launcher {
  public:
    /// Throws std::runtime_error: no display.
    explicit Launcher(LauncherSettings);
    ~Launcher();

    /// One frame; false once the user has closed the window.
    bool step();

    void run() {
        while (step()) {
        }
    }

    LauncherPage page() const;

    /// Starts the chosen procedure, as the button does. Does nothing unless page() is Choose and there is a
    /// choice.
    void start();

    /// The last frame.
    void read(rendering::Image& out);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace calot::launcher
