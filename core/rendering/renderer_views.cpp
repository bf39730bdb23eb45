#include "rendering/linear.hpp"
#include "rendering/renderer_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace calot::rendering {
namespace {

constexpr double kSplitAngle = 0.16; // rad; must match kStep of subdivide.geom
constexpr float kExternalExposure = 1.0f;
constexpr double kExternalNear = 0.01, kExternalFar = 4.0; // m

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
            set_camera(p, v);
            p.set("u_veins", 0);
            p.set("u_film", 1);
            p.set("u_light", static_cast<float>(light));
            current = &p;
        }
        // Only what is to be cut is cut.
        static constexpr std::array<float, 4> kNoCut{0, 0, 0, 1};
        if (item.style == Style::Outline)
            p.set("u_veil", 0.02f, 0.45f);
        else if (item.style == Style::Translucent)
            p.set("u_veil", 0.40f, 0.92f);
        else
            p.set("u_veil", 1.0f, 1.0f);
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
        return !v.endoscope && (item.style == Style::Translucent || item.style == Style::Outline);
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
    // Its own shaft is in the camera's view only when the tip is bent right back.
    if (v.endoscope && std::none_of(f.shaft.centreline.begin(), f.shaft.centreline.end(), [&](const Vec3& p) {
            const Eigen::Vector3d local = v.to_local * (to_eigen(p) - v.eye);
            return local.norm() > 2 * f.shaft.radius &&
                   local.z() > std::cos(v.cone.half_angle + 0.3) * local.norm();
        }))
        return;
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

} // namespace calot::rendering
