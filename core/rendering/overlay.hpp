// Text and panels over the picture, through Dear ImGui; the same with and without a window.
#pragma once

#include <functional>
#include <string>
#include <vector>

struct ImGuiContext;
struct ImFont;

namespace calot::rendering {

/// One Dear ImGui context with its OpenGL backend. It and the current GL context belong to one thread.
class Overlay {
  public:
    /// `scale`: 1 for 18 pixel text. Needs a current context.
    explicit Overlay(double scale = 1.0);
    ~Overlay();
    Overlay(const Overlay&) = delete;
    Overlay& operator=(const Overlay&) = delete;

    /// Starts a frame of this size; `platform` (of a window) runs between the backend's and ImGui's own
    /// start.
    void begin(int width, int height, double seconds_since_last, const std::function<void()>& platform = {});

    /// Draws what was put into the frame over the framebuffer that is bound.
    void end();

    /// Draws the last frame once more.
    void repeat();

    ImGuiContext* context() const { return context_; }
    ImFont* body() const { return body_; }
    ImFont* large() const { return large_; }

    /// Between begin() and end(): lines with a soft shadow, the first one larger, top left at (x, y), wrapped
    /// at `width` (pixels), `size` times the usual type.
    void text_lines(double x, double y, double width, double size, const std::vector<std::string>& lines);
    double line_height() const;

  private:
    ImGuiContext* context_ = nullptr;
    ImFont* body_ = nullptr;
    ImFont* large_ = nullptr;
};

} // namespace calot::rendering
