// An OpenGL 3.3 core context without any window, through EGL. A window's context comes from window.hpp,
// also through EGL; everything else in this folder works on whichever context is current.
#pragma once

#include <memory>

namespace calot::rendering {

/// Without a GPU, Mesa draws with one thread, leaving the other core to physics. Call before the first
/// context is made and before other threads start (it sets an environment variable, unless the user did).
void limit_software_threads();

class EglContext {
  public:
    /// Makes a context on the surfaceless platform, else on the first device that has one, else on the
    /// default display, and makes it current on the calling thread. Throws std::runtime_error with the
    /// reasons of all three.
    EglContext();
    ~EglContext();
    EglContext(const EglContext&) = delete;
    EglContext& operator=(const EglContext&) = delete;

    void make_current();
    void release(); // so that another thread may make it current

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace calot::rendering
