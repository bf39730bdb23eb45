// Draws frames: the endoscope's camera right, the external view left.
#pragma once

#include "rendering/optics.hpp"
#include "rendering/types.hpp"

#include <filesystem>
#include <functional>
#include <memory>

namespace calot::rendering {

class Overlay;

/// A rectangle of the picture in pixels, from its top left corner.
struct Rect {
    int x = 0, y = 0, width = 0, height = 0;
    bool contains(int px, int py) const { return px >= x && py >= y && px < x + width && py < y + height; }
};

/// Where things are in a picture of this size.
struct Layout {
    Rect external;  // empty when the external view is off
    Rect endoscope; // the panel
    Rect mask;      // the square in it that the endoscope's picture fills
    Rect text;      // room for lines below or beside that square
};
Layout make_layout(int width, int height, bool external_on);

inline constexpr double kProcessorScale = 0.7; // half the pixels

struct RendererSettings {
    int width = 1280, height = 720;
    int samples = 1; // of multi-sampling: 1 or 4; 4 triples the time without a GPU
    // Of the views within the picture, 0.25..1: smaller is faster and a little softer; text stays sharp. 0: 1
    // on a graphics card, kProcessorScale where the processor draws.
    double scale = 0;
    Optics optics;
    std::filesystem::path shaders; // folder; empty: found (see find_shaders)
    double text_scale = 1.0;
};

/// All functions need the GL context that was current at construction, on one thread.
class Renderer {
  public:
    /// Throws std::runtime_error (shaders, framebuffers) or std::invalid_argument (settings).
    explicit Renderer(const RendererSettings&);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// Throws std::invalid_argument for a surface that cannot be drawn.
    SurfaceId add(const Surface&);

    /// See SurfaceStore::update_vertices.
    void update_vertices(SurfaceId, std::size_t first, std::span<const std::array<float, 3>> vertices,
                         std::span<const std::array<float, 3>> normals);

    void resize(int width, int height);

    /// `panels` may build ImGui windows over the picture; `platform` is Overlay::begin's.
    void draw(const FrameState&, const std::function<void(Overlay&)>& panels = {},
              const std::function<void()>& platform = {});

    /// The last picture drawn.
    void read(Image& out) const;

    /// Copies it to the default framebuffer (a window of the same size).
    void present() const;

    Layout layout(bool external_on) const;
    const RendererSettings& settings() const;
    Overlay& overlay();
    double exposure() const; // of the endoscope's camera, 1: the headlight at 30 mm

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace calot::rendering
