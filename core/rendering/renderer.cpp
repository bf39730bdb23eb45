#include "rendering/renderer.hpp"

#include "rendering/exposure.hpp"
#include "rendering/gl_objects.hpp"
#include "rendering/linear.hpp"
#include "rendering/noise_volume.hpp"
#include "rendering/overlay.hpp"
#include "rendering/picture_shapes.hpp"
#include "rendering/surface_store.hpp"
#include "rendering/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

namespace calot::rendering {
namespace {

constexpr double kSplitAngle = 0.16; // rad; must match kStep of subdivide.geom
constexpr float kExternalExposure = 1.0f;
constexpr double kExternalNear = 0.01, kExternalFar = 4.0; // m

// A camera as the shaders take it.
struct View {
    bool endoscope = false;
    Rect rect;
    Eigen::Vector3d eye;
    Eigen::Matrix3d to_local;
    std::array<float, 4> lens{};
    std::array<float, 4> cut{0, 0, 0, 1};
    ViewCone cone;
    float exposure = 1;
};

struct ViewPrograms {
    Program tissue, tissue_split, shaft, marker;
};

struct Target {
    int samples = 1;
    Framebuffer frame;
    Renderbuffer colour, depth;
};

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

// A stream of vertices and indices that is filled anew for each frame.
struct DynamicMesh {
    VertexArray array = make_vertex_array();
    Buffer vertices = make_buffer(), indices = make_buffer();
    template<class V>
    void fill(const std::vector<V>& v, const std::vector<std::uint32_t>& i) {
        glBindVertexArray(*array);
        glBindBuffer(GL_ARRAY_BUFFER, *vertices);
        glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(v.size() * sizeof(V)), v.data(),
                     GL_STREAM_DRAW);
        glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, *indices);
        glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(i.size() * sizeof(std::uint32_t)),
                     i.data(), GL_STREAM_DRAW);
    }
};

void attribute(GLuint index, GLint count, GLenum type, GLboolean normalised, std::size_t stride,
               std::size_t offset) {
    glVertexAttribPointer(index, count, type, normalised, static_cast<GLsizei>(stride),
                          reinterpret_cast<const void*>(offset));
    glEnableVertexAttribArray(index);
}

const void* index_offset(std::size_t first) {
    return reinterpret_cast<const void*>(first * sizeof(std::uint32_t));
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

struct Renderer::State {
    RendererSettings settings;
    SurfaceStore surfaces;
    ViewPrograms endoscope, external;
    Program flat;
    NoiseTexels noise = make_noise_texels();
    Texture veins = upload_noise(noise.veins), film = upload_noise(noise.film);
    Target scene, picture;
    PictureShapes shapes;
    ExposureMeter meter;
    Overlay overlay;
    ShaftMesh shaft;
    MarkerMesh markers;
    DynamicMesh shaft_gl, marker_gl;
    double last_time = 0;
    bool first = true;

    State(const RendererSettings& s, const std::filesystem::path& folder)
        : settings(s), surfaces(read_appearances(folder / "appearance.toml")),
          endoscope(load_view(folder, true)), external(load_view(folder, false)),
          flat(folder, "flat.vert", "", "flat.frag", {}), overlay(s.text_scale) {
        noise = {};
        make_targets();
    }

    void make_targets() {
        scene = make_target(settings.width, settings.height, settings.samples, true);
        picture = settings.samples > 1 ? make_target(settings.width, settings.height, 1, false) : Target{};
    }
    GLuint picture_frame() const { return picture.frame ? *picture.frame : *scene.frame; }

    View endoscope_view(const FrameState&, const Layout&) const;
    View external_view(const FrameState&, const Layout&) const;
    void set_camera(const Program&, const View&) const;
    void set_viewport(const Rect& r) const {
        glViewport(r.x, settings.height - r.y - r.height, r.width, r.height);
    }
    void draw_tissue(const View&, const ViewPrograms&, const std::vector<DrawItem>&, bool veils,
                     double light);
    void set_tissue(const Program&, const DrawItem&, const View&) const;
    void draw_shaft(const View&, const Program&, const FrameState&);
    void draw_markers(const View&, const Program&, bool halos);
    void draw_endoscope(const FrameState&, const Layout&);
    void draw_external(const FrameState&, const Layout&);
    void prepare(const FrameState&);
    void resolve() const;
};

View Renderer::State::endoscope_view(const FrameState& f, const Layout& l) const {
    View v;
    v.endoscope = true;
    v.rect = l.mask;
    v.eye = to_eigen(f.tip.position);
    const Eigen::Matrix3d axes = to_matrix(f.tip.rotation);
    v.to_local = axes.transpose();
    const Optics& o = settings.optics;
    const auto scale = static_cast<float>(1 / mask_half_side(o));
    const double z = o.far / (o.far - o.near), w = -o.near * z; // 0..1 of depth, in units of distance
    v.lens = {scale, scale, static_cast<float>(2 * z - 1), static_cast<float>(2 * w)};
    v.cone.eye = v.eye;
    v.cone.axis = axes.col(2);
    v.cone.half_angle = o.field_of_view / 2 + 0.02;
    v.cone.reach = o.far;
    v.cone.split_angle = kSplitAngle;
    v.exposure = static_cast<float>(meter.exposure());
    return v;
}

View Renderer::State::external_view(const FrameState& f, const Layout& l) const {
    View v;
    v.rect = l.external;
    v.eye = to_eigen(f.external.pose.position);
    const Eigen::Matrix3d axes = to_matrix(f.external.pose.rotation);
    v.to_local = axes.transpose();
    const double tangent = std::tan(std::clamp(f.external.vertical_field, 0.05, 2.5) / 2);
    const double aspect = static_cast<double>(l.external.width) / std::max(l.external.height, 1);
    v.lens = {static_cast<float>(1 / (tangent * aspect)), static_cast<float>(1 / tangent),
              static_cast<float>((kExternalFar + kExternalNear) / (kExternalFar - kExternalNear)),
              static_cast<float>(-2 * kExternalFar * kExternalNear / (kExternalFar - kExternalNear))};
    v.cone.eye = v.eye;
    v.cone.axis = axes.col(2);
    v.cone.half_angle = std::atan(tangent * std::hypot(1.0, aspect));
    v.cone.reach = kExternalFar;
    v.exposure = kExternalExposure;
    return v;
}

void Renderer::State::set_camera(const Program& p, const View& v) const {
    const Eigen::Vector3f eye = v.eye.cast<float>();
    const Eigen::Matrix3f to_local = v.to_local.cast<float>();
    const std::array<float, 4> radial{
        static_cast<float>(settings.optics.k[0]), static_cast<float>(settings.optics.k[1]),
        static_cast<float>(settings.optics.k[2]), static_cast<float>(settings.optics.k[3])};
    p.set3("u_eye", eye.data());
    p.set_matrix3("u_to_local", to_local.data());
    p.set4("u_lens", v.lens.data());
    p.set4("u_radial", radial.data());
    p.set4("u_cut", v.cut.data());
    p.set("u_exposure", v.exposure);
    p.set("u_light_shape", static_cast<float>(settings.optics.light_exponent),
          static_cast<float>(settings.optics.light_offset));
}

void Renderer::State::set_tissue(const Program& p, const DrawItem& item, const View& v) const {
    const Eigen::Matrix3f rest_to_local = v.to_local.cast<float>() * item.rotation;
    p.set_matrix3("u_model", item.rotation.data());
    p.set3("u_origin", item.origin.data());
    p.set_matrix3("u_rest_to_local", rest_to_local.data());
}

void Renderer::State::draw_tissue(const View& v, const ViewPrograms& programs,
                                  const std::vector<DrawItem>& items, bool veils, double light) {
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_3D, *veins);
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_3D, *film);
    const Program* current = nullptr;
    const auto draw = [&](const DrawItem& item) {
        const Program& p = item.split ? programs.tissue_split : programs.tissue;
        if (&p != current) {
            p.use();
            View camera = v;
            set_camera(p, camera);
            p.set("u_veins", 0);
            p.set("u_film", 1);
            p.set("u_light", static_cast<float>(light));
            p.set("u_veil", veils ? 1.0f : 0.0f);
            current = &p;
        }
        // Only what is to be cut is cut.
        static constexpr std::array<float, 4> kNoCut{0, 0, 0, 1};
        p.set4("u_cut", item.style == Style::Cut ? v.cut.data() : kNoCut.data());
        set_tissue(p, item, v);
        surfaces.bind(item);
        if (veils) { // only the nearest layer of each veil
            glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
            glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(item.count), GL_UNSIGNED_INT,
                           index_offset(item.first));
            glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        }
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(item.count), GL_UNSIGNED_INT,
                       index_offset(item.first));
    };
    const auto is_veil = [&](const DrawItem& item) {
        return !v.endoscope && item.style == Style::Translucent;
    };
    if (!veils) {
        for (const DrawItem& item : items)
            if (!is_veil(item)) draw(item);
        return;
    }
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    for (auto item = items.rbegin(); item != items.rend(); ++item)
        if (is_veil(*item)) draw(*item);
    glDisable(GL_BLEND);
}

void Renderer::State::draw_shaft(const View& v, const Program& p, const FrameState& f) {
    if (shaft.indices.empty()) return;
    p.use();
    set_camera(p, v);
    p.set("u_light", static_cast<float>(f.light));
    p.set("u_bending", static_cast<float>(f.shaft.bending_length));
    glBindVertexArray(*shaft_gl.array);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(shaft.indices.size()), GL_UNSIGNED_INT, nullptr);
}

void Renderer::State::draw_markers(const View& v, const Program& p, bool halos) {
    const MarkerMesh::Part& part = halos ? markers.halos : markers.cores;
    const std::size_t first = halos ? markers.cores.far.size() + markers.cores.near.size() : 0;
    const std::size_t count = part.far.size() + (v.endoscope ? 0 : part.near.size());
    if (count == 0) return;
    const auto draw = [&](float strength) {
        p.set("u_strength", strength);
        glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT, index_offset(first));
    };
    p.use();
    set_camera(p, v);
    p.set("u_halo", halos ? 1 : 0);
    glBindVertexArray(*marker_gl.array);
    glEnable(GL_BLEND);
    glDepthMask(GL_FALSE);
    // A hint of each marker shows through whatever lies in front of it.
    if (halos) {
        glBlendFuncSeparate(GL_ONE, GL_ONE, GL_ZERO, GL_ONE);
        draw(0.8f);
        if (!v.endoscope) {
            glDisable(GL_DEPTH_TEST);
            draw(0.14f);
            glEnable(GL_DEPTH_TEST);
        }
    } else {
        glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
        glDisable(GL_DEPTH_TEST);
        draw(v.endoscope ? 0.10f : 0.22f);
        glEnable(GL_DEPTH_TEST);
        glDepthMask(GL_TRUE);
        draw(1.0f);
    }
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
}

void Renderer::State::draw_endoscope(const FrameState& f, const Layout& l) {
    const View v = endoscope_view(f, l);
    set_viewport(v.rect);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    shapes.draw_mask(flat); // nearest of all, so that nothing behind it is shaded
    glEnable(GL_CLIP_DISTANCE0);
    draw_shaft(v, endoscope.shaft, f);
    const std::vector<DrawItem> items = surfaces.select(v.cone, f.surfaces, true);
    draw_tissue(v, endoscope, items, false, f.light);
    draw_markers(v, endoscope.marker, false);
    draw_markers(v, endoscope.marker, true);
    glDisable(GL_CLIP_DISTANCE0);
    shapes.draw_mask_edge(flat);
}

void Renderer::State::draw_external(const FrameState& f, const Layout& l) {
    if (l.external.width <= 0) return;
    View v = external_view(f, l);
    set_viewport(v.rect);
    shapes.draw_background(flat);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glEnable(GL_CLIP_DISTANCE0);
    if (f.cut) {
        const Eigen::Vector3d n = to_eigen(f.cut->normal).normalized();
        v.cut = {static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()),
                 static_cast<float>(n.dot(to_eigen(f.cut->point)))};
    }
    View uncut = v;
    uncut.cut = {0, 0, 0, 1};
    draw_shaft(uncut, external.shaft, f);
    const std::vector<DrawItem> items = surfaces.select(v.cone, f.surfaces, false);
    draw_tissue(v, external, items, false, f.light);
    draw_markers(uncut, external.marker, false);
    draw_tissue(v, external, items, true, f.light);
    draw_markers(uncut, external.marker, true);
    glDisable(GL_CLIP_DISTANCE0);
}

void Renderer::State::prepare(const FrameState& f) {
    sweep_shaft(f.shaft, shaft);
    shaft_gl.fill(shaft.vertices, shaft.indices);
    attribute(0, 3, GL_FLOAT, GL_FALSE, sizeof(ShaftVertex), offsetof(ShaftVertex, position));
    attribute(1, 3, GL_FLOAT, GL_FALSE, sizeof(ShaftVertex), offsetof(ShaftVertex, normal));
    attribute(2, 4, GL_FLOAT, GL_FALSE, sizeof(ShaftVertex), offsetof(ShaftVertex, place));
    build_markers(f, markers);
    std::vector<std::uint32_t> indices;
    for (const MarkerMesh::Part* part : {&markers.cores, &markers.halos})
        for (const auto* list : {&part->far, &part->near})
            indices.insert(indices.end(), list->begin(), list->end());
    marker_gl.fill(markers.vertices, indices);
    attribute(0, 3, GL_FLOAT, GL_FALSE, sizeof(MarkerVertex), offsetof(MarkerVertex, position));
    attribute(1, 3, GL_FLOAT, GL_FALSE, sizeof(MarkerVertex), offsetof(MarkerVertex, normal));
    attribute(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(MarkerVertex), offsetof(MarkerVertex, colour));
}

void Renderer::State::resolve() const {
    if (!picture.frame) return;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, *scene.frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, *picture.frame);
    glBlitFramebuffer(0, 0, settings.width, settings.height, 0, 0, settings.width, settings.height,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

Renderer::Renderer(const RendererSettings& settings) {
    check_size(settings.width, settings.height);
    if (settings.samples != 1 && settings.samples != 4)
        throw std::invalid_argument("renderer: samples must be 1 or 4");
    check(settings.optics);
    state_ = std::make_unique<State>(settings, find_shaders(settings.shaders));
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

    const Rect flipped{l.mask.x, s.settings.height - l.mask.y - l.mask.height, l.mask.width, l.mask.height};
    const auto scene = [&] {
        glBindFramebuffer(GL_FRAMEBUFFER, *s.scene.frame);
        glViewport(0, 0, s.settings.width, s.settings.height);
        glClearColor(0, 0, 0, 1);
        glDisable(GL_SCISSOR_TEST);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        s.draw_endoscope(f, l);
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
    s.draw_external(f, l);
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
    for (std::size_t i = 3; i < out.rgba.size(); i += 4)
        out.rgba[i] = 255;
}

void Renderer::present() const {
    const State& s = *state_;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.picture_frame());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    glBlitFramebuffer(0, 0, s.settings.width, s.settings.height, 0, 0, s.settings.width, s.settings.height,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

} // namespace calot::rendering
