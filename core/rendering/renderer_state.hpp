// The renderer's inside, shared by renderer.cpp (targets, frames) and renderer_views.cpp (what is drawn in
// each view).
#pragma once

#include "rendering/exposure.hpp"
#include "rendering/gl_objects.hpp"
#include "rendering/noise_volume.hpp"
#include "rendering/overlay.hpp"
#include "rendering/picture_shapes.hpp"
#include "rendering/renderer.hpp"
#include "rendering/surface_store.hpp"
#include "rendering/sweep.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace calot::rendering {

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

struct Renderer::State {
    RendererSettings settings;
    SurfaceStore surfaces;
    ViewPrograms endoscope, external;
    Program flat;
    NoiseTexels noise = make_noise_texels();
    Texture veins = upload_noise(noise.veins), film = upload_noise(noise.film);
    Target scene;   // what is drawn into: multi-sampled, or smaller than the picture
    Target picture; // empty if the scene is the picture already
    PictureShapes shapes;
    ExposureMeter meter;
    Overlay overlay;
    ShaftMesh shaft;
    MarkerMesh markers;
    DynamicMesh shaft_gl, marker_gl;
    double last_time = 0;
    bool first = true;

    State(const RendererSettings&, const std::filesystem::path& shaders);
    void make_targets();
    int scene_width() const { return scaled(settings.width); }
    int scene_height() const { return scaled(settings.height); }
    int scaled(int pixels) const {
        return std::max(16, static_cast<int>(std::lround(pixels * settings.scale)));
    }
    GLuint picture_frame() const { return picture.frame ? *picture.frame : *scene.frame; }

    View endoscope_view(const FrameState&, const Layout&) const;
    View external_view(const FrameState&, const Layout&) const;
    void set_camera(const Program&, const View&) const;
    void set_viewport(const Rect& r) const {
        glViewport(r.x, scene_height() - r.y - r.height, r.width, r.height);
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

} // namespace calot::rendering
