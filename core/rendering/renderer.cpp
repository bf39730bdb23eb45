#include "rendering/renderer.hpp"

#include "rendering/renderer_state.hpp"

#include <algorithm>
#include <stdexcept>

namespace calot::rendering {
namespace {

Target make_target(int width, int height, int samples, bool with_depth) {
    Target t;
    t.samples = samples;
    t.frame = make_framebuffer();
    t.colour = make_renderbuffer();
    glBindFramebuffer(GL_FRAMEBUFFER, *t.frame);
    const auto storage = [&](GLenum format) {
        if (samples > 1)
            glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
        else
            glRenderbufferStorage(GL_RENDERBUFFER, format, width, height);
    };
    glBindRenderbuffer(GL_RENDERBUFFER, *t.colour);
    storage(GL_RGBA8);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, *t.colour);
    if (with_depth) {
        t.depth = make_renderbuffer();
        glBindRenderbuffer(GL_RENDERBUFFER, *t.depth);
        storage(GL_DEPTH_COMPONENT24);
        glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, *t.depth);
    }
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw std::runtime_error("renderer: no framebuffer of " + std::to_string(width) + " x " +
                                 std::to_string(height) + " with " + std::to_string(samples) + " samples");
    return t;
}

void check_size(int width, int height) {
    if (width < 64 || height < 64 || width > 8192 || height > 8192)
        throw std::invalid_argument("renderer: width and height must lie in 64..8192");
}

ViewPrograms load_view(const std::filesystem::path& folder, bool endoscope) {
    const std::vector<std::string> defines =
        endoscope ? std::vector<std::string>{"FISHEYE", "ENDOSCOPE"} : std::vector<std::string>{};
    ViewPrograms p;
    p.tissue = Program(folder, "tissue.vert", "", "tissue.frag", defines);
    if (endoscope) {
        auto split = defines;
        split.emplace_back("SUBDIVIDE");
        p.tissue_split = Program(folder, "tissue.vert", "subdivide.geom", "tissue.frag", split);
    }
    p.shaft = Program(folder, "shaft.vert", "", "shaft.frag", defines);
    p.marker = Program(folder, "marker.vert", "", "marker.frag", defines);
    return p;
}

} // namespace

Layout make_layout(int width, int height, bool external_on) {
    Layout l;
    const int split = external_on ? width / 2 : 0;
    if (external_on) l.external = {0, 0, split, height};
    l.endoscope = {split, 0, width - split, height};
    const int side = std::min(l.endoscope.width, height);
    const int beside = l.endoscope.width - side, below = height - side;
    l.mask = {split + beside / 2, 0, side, side};
    if (below >= beside / 2)
        l.text = {split + side / 40, side + below / 10, l.endoscope.width - side / 20, below};
    else
        l.text = {split + side / 40, height / 2, beside / 2 - side / 20, height / 2};
    return l;
}

Renderer::State::State(const RendererSettings& s, const std::filesystem::path& folder)
    : settings(s), surfaces(read_appearances(folder / "appearance.toml")), endoscope(load_view(folder, true)),
      external(load_view(folder, false)), flat(folder, "flat.vert", "", "flat.frag", {}),
      overlay(s.text_scale) {
    noise = {};
    make_targets();
}

void Renderer::State::make_targets() {
    scene = make_target(scene_width(), scene_height(), settings.samples, true);
    const bool direct = settings.samples == 1 && settings.scale == 1;
    picture = direct ? Target{} : make_target(settings.width, settings.height, 1, false);
}

void Renderer::State::resolve() const {
    if (!picture.frame) return;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, *scene.frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, *picture.frame);
    glBlitFramebuffer(0, 0, scene_width(), scene_height(), 0, 0, settings.width, settings.height,
                      GL_COLOR_BUFFER_BIT, settings.scale == 1 ? GL_NEAREST : GL_LINEAR);
}

Renderer::Renderer(const RendererSettings& settings) {
    check_size(settings.width, settings.height);
    if (settings.samples != 1 && settings.samples != 4)
        throw std::invalid_argument("renderer: samples must be 1 or 4");
    RendererSettings chosen = settings;
    if (settings.scale == 0)
        chosen.scale = settings.samples == 1 && draws_on_processor() ? kProcessorScale : 1;
    if (!(chosen.scale >= 0.25 && chosen.scale <= 1))
        throw std::invalid_argument("renderer: scale must lie in 0.25..1");
    if (chosen.samples > 1 && chosen.scale != 1)
        throw std::invalid_argument("renderer: with samples = 4, scale must be 1");
    check(settings.optics);
    state_ = std::make_unique<State>(chosen, find_shaders(settings.shaders));
}

Renderer::~Renderer() = default;

SurfaceId Renderer::add(const Surface& s) {
    return state_->surfaces.add(s);
}

void Renderer::update_vertices(SurfaceId id, std::size_t first,
                               std::span<const std::array<float, 3>> vertices,
                               std::span<const std::array<float, 3>> normals) {
    state_->surfaces.update_vertices(id, first, vertices, normals);
}

void Renderer::resize(int width, int height) {
    check_size(width, height);
    if (width == state_->settings.width && height == state_->settings.height) return;
    state_->settings.width = width;
    state_->settings.height = height;
    state_->make_targets();
}

Layout Renderer::layout(bool external_on) const {
    return make_layout(state_->settings.width, state_->settings.height, external_on);
}
const RendererSettings& Renderer::settings() const {
    return state_->settings;
}
Overlay& Renderer::overlay() {
    return state_->overlay;
}
double Renderer::exposure() const {
    return state_->meter.exposure();
}

void Renderer::draw(const FrameState& f, const std::function<void(Overlay&)>& panels,
                    const std::function<void()>& platform) {
    State& s = *state_;
    const Layout l = layout(f.external.on);
    const double elapsed = std::clamp(f.time - s.last_time, 0.0, 1.0);
    s.last_time = f.time;
    s.prepare(f);

    const Layout small =
        make_layout(s.scene_width(), s.scene_height(), f.external.on); // in the scene's pixels
    const Rect flipped{l.mask.x, s.settings.height - l.mask.y - l.mask.height, l.mask.width, l.mask.height};
    const auto scene = [&] {
        glBindFramebuffer(GL_FRAMEBUFFER, *s.scene.frame);
        glViewport(0, 0, s.scene_width(), s.scene_height());
        glClearColor(0, 0, 0, 1);
        glDisable(GL_SCISSOR_TEST);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        s.draw_endoscope(f, small);
    };
    if (s.first) { // the camera has been on for a while: its exposure has settled
        for (int round = 0; round < 6; ++round) {
            scene();
            s.resolve();
            s.meter.measure(s.picture_frame(), flipped);
            s.meter.adapt(10.0);
        }
        s.first = false;
    } else {
        s.meter.adapt(elapsed);
    }
    scene();
    s.draw_external(f, small);
    glDisable(GL_DEPTH_TEST);
    s.resolve();
    s.meter.measure(s.picture_frame(), flipped);

    glBindFramebuffer(GL_FRAMEBUFFER, s.picture_frame());
    glViewport(0, 0, s.settings.width, s.settings.height);
    if (f.fade > 0) s.shapes.draw_fade(s.flat, static_cast<float>(std::clamp(f.fade, 0.0, 1.0)));
    s.overlay.begin(s.settings.width, s.settings.height, elapsed > 0 ? elapsed : 1.0 / 60, platform);
    const double type = s.settings.height / 720.0;
    s.overlay.text_lines(l.text.x, l.text.y, l.text.width, type, f.endoscope_text);
    if (f.external.on)
        s.overlay.text_lines(s.settings.width / 80.0, s.settings.height / 60.0, l.external.width * 0.9, type,
                             f.external_text);
    if (panels) panels(s.overlay);
    s.overlay.end();
    glBindVertexArray(0);
}

void Renderer::read(Image& out) const {
    const State& s = *state_;
    out.width = s.settings.width;
    out.height = s.settings.height;
    const std::size_t row = static_cast<std::size_t>(out.width) * 4;
    out.rgba.resize(row * static_cast<std::size_t>(out.height));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.picture_frame());
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glReadPixels(0, 0, out.width, out.height, GL_RGBA, GL_UNSIGNED_BYTE, out.rgba.data());
    for (int y = 0; y < out.height / 2; ++y)
        std::swap_ranges(out.rgba.begin() + static_cast<std::ptrdiff_t>(row) * y,
                         out.rgba.begin() + static_cast<std::ptrdiff_t>(row) * (y + 1),
                         out.rgba.begin() + static_cast<std::ptrdiff_t>(row) * (out.height - 1 - y));
}

void Renderer::present() const {
    const State& s = *state_;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.picture_frame());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    glBlitFramebuffer(0, 0, s.settings.width, s.settings.height, 0, 0, s.settings.width, s.settings.height,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

} // namespace calot::rendering
