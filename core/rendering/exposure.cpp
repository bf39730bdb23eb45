#include "rendering/exposure.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rendering {
namespace {
constexpr int kSide = 40; // of the thumbnail
constexpr GLsizeiptr kBytes = GLsizeiptr{4} * kSide * kSide;
constexpr double kTarget = 0.44;       // mean of the displayed values
constexpr double kGlareShare = 0.06;   // of the picture that may be near white
constexpr double kTimeConstant = 0.25; // s
constexpr double kLeast = 0.004, kMost = 30;
} // namespace

ExposureMeter::ExposureMeter()
    : frame_(make_framebuffer()), colour_(make_renderbuffer()), pixels_(make_buffer()) {
    glBindRenderbuffer(GL_RENDERBUFFER, *colour_);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, kSide, kSide);
    glBindFramebuffer(GL_FRAMEBUFFER, *frame_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, *colour_);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, *pixels_);
    glBufferData(GL_PIXEL_PACK_BUFFER, kBytes, nullptr, GL_STREAM_READ);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

void ExposureMeter::measure(GLuint framebuffer, const Rect& r) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, *frame_);
    glBlitFramebuffer(r.x, r.y, r.x + r.width, r.y + r.height, 0, 0, kSide, kSide, GL_COLOR_BUFFER_BIT,
                      GL_LINEAR);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, *frame_);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, *pixels_);
    glReadPixels(0, 0, kSide, kSide, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    pending_ = true;
}

void ExposureMeter::adapt(double seconds) {
    if (!pending_) return;
    pending_ = false;
    glBindBuffer(GL_PIXEL_PACK_BUFFER, *pixels_);
    const auto* p =
        static_cast<const unsigned char*>(glMapBufferRange(GL_PIXEL_PACK_BUFFER, 0, kBytes, GL_MAP_READ_BIT));
    if (!p) {
        glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
        return;
    }
    double sum = 0, weight = 0, glare = 0;
    const unsigned char* c = p;
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x, c += 4) {
            const double u = (x + 0.5) / kSide * 2 - 1, v = (y + 0.5) / kSide * 2 - 1;
            if (std::abs(u) + std::abs(v) > 1 + kMaskCorner) continue; // behind the mask
            const double luma = (0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]) / 255;
            const double w = 1.25 - 0.5 * (u * u + v * v); // the centre counts more
            sum += w * luma;
            weight += w;
            if (luma > 0.9) glare += w;
        }
    glUnmapBuffer(GL_PIXEL_PACK_BUFFER);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    if (!(weight > 0)) return;
    const double mean = std::clamp(sum / weight, 0.01, 0.98);
    // Display values go with the 1/2.2th power of light.
    double wanted = std::pow(kTarget / mean, 1.6);
    const double excess = glare / weight / kGlareShare;
    if (excess > 1) wanted = std::min(wanted, 1 / (1 + 0.25 * (excess - 1)));
    wanted = std::clamp(wanted, 0.25, 4.0);
    exposure_ =
        std::clamp(exposure_ * std::pow(wanted, 1 - std::exp(-seconds / kTimeConstant)), kLeast, kMost);
}

} // namespace calot::rendering
