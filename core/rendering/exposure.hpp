// The endoscope camera's automatic exposure.
#pragma once

#include "rendering/gl_objects.hpp"
#include "rendering/renderer.hpp"

namespace calot::rendering {

/// Follows the brightness of the picture like a video processor's average metering with a limit on glare.
class ExposureMeter {
  public:
    ExposureMeter();

    /// Starts reading a thumbnail of this rectangle (GL's orientation) of the framebuffer.
    void measure(GLuint framebuffer, const Rect&);

    /// Moves the exposure towards what the thumbnail last measured asks for, over `seconds`.
    void adapt(double seconds);

    double exposure() const { return exposure_; }

  private:
    Framebuffer frame_;
    Renderbuffer colour_;
    Buffer pixels_; // filled by the GPU while the processor goes on
    bool pending_ = false;
    double exposure_ = 1;
};

} // namespace calot::rendering
