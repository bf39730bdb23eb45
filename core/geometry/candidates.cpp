#include "geometry/candidates.hpp"

#include <algorithm>

namespace calot::geometry {
namespace {

struct Vec3f {
    float x, y, z;
};

float dot(const float (&a)[3], Vec3f b) {
    return a[0] * b.x + a[1] * b.y + a[2] * b.z;
}

Vec3f difference(Vec3f p, const float (&a)[3]) {
    return {p.x - a[0], p.y - a[1], p.z - a[2]};
}

bool edge_may_touch(const TriangleScene::EdgeScreen& screen, Vec3f p0, Vec3f p1, float reach, float slack) {
    const Vec3f d0 = difference(p0, screen.start), d1 = difference(p1, screen.start);
    const float s0 = dot(screen.along, d0), s1 = dot(screen.along, d1);
    if (std::max(s0, s1) < -slack || std::min(s0, s1) > screen.length + slack) return false;
    const float lean = slack + std::fabs(screen.tilt) * (reach + slack);
    if (std::min(dot(screen.inward0, d0), dot(screen.inward0, d1)) > lean) return false;
    if (std::min(dot(screen.inward1, d0), dot(screen.inward1, d1)) > lean) return false;
    if (screen.tilt > 0.0f) { // both faces must be seen from the front
        const float(&e)[3] = screen.along, (&m)[3] = screen.inward0;
        const float normal[3] = {e[1] * m[2] - e[2] * m[1], e[2] * m[0] - e[0] * m[2],
                                 e[0] * m[1] - e[1] * m[0]};
        if (std::max(dot(normal, d0), dot(normal, d1)) < -slack) return false;
    }
    // The middle of the edge against the segment.
    const float half = 0.5f * screen.length;
    const Vec3f m{d0.x - half * screen.along[0], d0.y - half * screen.along[1],
                  d0.z - half * screen.along[2]};
    const Vec3f u{p1.x - p0.x, p1.y - p0.y, p1.z - p0.z};
    const float uu = u.x * u.x + u.y * u.y + u.z * u.z;
    const float t = uu > 0.0f ? std::clamp(-(m.x * u.x + m.y * u.y + m.z * u.z) / uu, 0.0f, 1.0f) : 0.0f;
    const Vec3f d{m.x + t * u.x, m.y + t * u.y, m.z + t * u.z};
    const float limit = reach + slack + half;
    return d.x * d.x + d.y * d.y + d.z * d.z <= limit * limit;
}

bool vertex_may_touch(const TriangleScene& scene, std::uint32_t vertex, Vec3 p0, Vec3 p1, double reach,
                      double slack) {
    const Vec3 v = scene.vertices()[vertex], u = p1 - p0;
    const double uu = norm2(u);
    const double t = uu > 0.0 ? std::clamp(dot(v - p0, u) / uu, 0.0, 1.0) : 0.0;
    if (norm2(p0 + t * u - v) > (reach + slack) * (reach + slack)) return false;
    for (const std::uint32_t position : scene.around(vertex))
        for (const std::uint32_t other : scene.triangles()[position].vertex) {
            const Vec3 w = scene.vertices()[other] - v;
            const double along = std::min(calot::geometry::dot(p0 - v, w), calot::geometry::dot(p1 - v, w));
            if (along > 0.0 && along * along > slack * slack * norm2(w)) return false;
        }
    return true;
}

} // namespace

void Candidates::gather(const TriangleScene& scene, Vec3 q0, Vec3 q1, double reach) {
    version_ = scene.version();
    q0_ = q0;
    q1_ = q1;
    reach_ = reach;
    tolerance_ = 1e-6f + scene.screen_tolerance();
    complete_ = true;
    face_count_ = edge_count_ = vertex_count_ = 0;
    const Vec3f p0{static_cast<float>(q0.x), static_cast<float>(q0.y), static_cast<float>(q0.z)};
    const Vec3f p1{static_cast<float>(q1.x), static_cast<float>(q1.y), static_cast<float>(q1.z)};
    const float r = static_cast<float>(reach), s = static_cast<float>(slack) + scene.screen_tolerance();
    scene.tree().around_segment(q0, q1, reach + slack, [&](std::uint32_t leaf) {
        const std::uint32_t first = scene.tree().leaf_begin(leaf);
        const TriangleScene::FaceBlock& block = scene.faces(leaf);
        unsigned lanes = detail::lanes_below(block, q0, r, s);
        lanes &= (1u << (scene.tree().leaf_begin(leaf + 1) - first)) - 1;
        for (; lanes != 0; lanes &= lanes - 1) {
            const auto lane = static_cast<std::uint32_t>(__builtin_ctz(lanes));
            add_face(block, lane, first + lane);
        }
        for (const TriangleScene::EdgeScreen& screen : scene.convex_edges(leaf))
            if (edge_may_touch(screen, p0, p1, r, s)) add_edge(screen);
        for (const std::uint32_t vertex : scene.salient_vertices(leaf))
            if (vertex_may_touch(scene, vertex, q0, q1, reach, static_cast<double>(s))) add_vertex(vertex);
    });
}

void Candidates::add_vertex(std::uint32_t vertex) {
    if (vertex_count_ == most_vertices)
        complete_ = false;
    else
        vertices_[vertex_count_++] = vertex;
}

void Candidates::add_face(const TriangleScene::FaceBlock& block, std::uint32_t lane, std::uint32_t position) {
    if (face_count_ == most_faces) {
        complete_ = false;
        return;
    }
    FaceLanes& to = faces_[face_count_ / 8];
    const std::uint32_t at = face_count_++ % 8;
    to.position[at] = position;
    const auto copy = [&](const float(&n)[3][8], const float(&offset)[8], float(&n_to)[3][8],
                          float(&offset_to)[8]) {
        for (int k = 0; k < 3; ++k)
            n_to[k][at] = n[k][lane];
        const Vec3 normal{n[0][lane], n[1][lane], n[2][lane]};
        offset_to[at] =
            static_cast<float>(static_cast<double>(offset[lane]) - calot::geometry::dot(normal, q0_));
    };
    copy(block.normal, block.offset, to.planes.normal, to.planes.offset);
    for (int k = 0; k < 3; ++k)
        copy(block.inward[k], block.inward_offset[k], to.planes.inward[k], to.planes.inward_offset[k]);
}

void Candidates::add_edge(const TriangleScene::EdgeScreen& screen) {
    if (edge_count_ == most_edges) {
        complete_ = false;
        return;
    }
    EdgeBlock& block = edges_[edge_count_ / 8];
    const std::uint32_t lane = edge_count_++ % 8;
    const double origin[3] = {q0_.x, q0_.y, q0_.z};
    for (int k = 0; k < 3; ++k) {
        block.start[k][lane] = static_cast<float>(static_cast<double>(screen.start[k]) - origin[k]);
        block.along[k][lane] = screen.along[k];
        block.inward0[k][lane] = screen.inward0[k];
        block.inward1[k][lane] = screen.inward1[k];
    }
    block.length[lane] = screen.length;
    block.tilt[lane] = std::fabs(screen.tilt);
    block.edge[lane] = screen.edge;
}

// Positions relative to q0. The same conditions as in edge_minimum and edge_minimum_along, less a micrometre
// and the rounding of the edges' places.
Candidates::EdgeLanes Candidates::screen(const EdgeBlock& block, Vec3 p0, Vec3 p1, float reach) const {
    using namespace detail;
    const auto dot3 = [](const Float8(&a)[3], const Float8(&b)[3]) {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const Float8 zero = splat8(0.0f), tolerance = splat8(tolerance_), one = splat8(1.0f);
    const Vec3 segment = p1 - p0;
    Float8 w[3], e[3], m0[3], m1[3], u[3];
    for (int k = 0; k < 3; ++k) {
        w[k] = splat8(static_cast<float>(p0[k])) - load8(block.start[k]);
        u[k] = splat8(static_cast<float>(segment[k]));
        e[k] = load8(block.along[k]);
        m0[k] = load8(block.inward0[k]);
        m1[k] = load8(block.inward1[k]);
    }
    const Float8 length = load8(block.length), limit = splat8(reach) + tolerance;
    const Float8 ew = dot3(e, w);
    const Float8 w0 = dot3(m0, w), w1 = dot3(m1, w);
    const Float8 ww = dot3(w, w);
    // At the point: across the edge the distance is w less its part along e.
    const Int8 point = (ew >= -tolerance) & (ew <= length + tolerance) & (w0 <= tolerance) &
                       (w1 <= tolerance) & (ww - ew * ew <= limit * limit);
    // Inside: where the lines come nearest. For nearly parallel ones (6 degrees) that is uncertain.
    const Float8 uu = dot3(u, u), ue = dot3(u, e), uw = dot3(u, w);
    const Float8 det = uu - ue * ue;
    const Int8 parallel = det <= splat8(0.01f) * uu;
    const Float8 t = (ue * ew - uw) / (det > zero ? det : one), s = ew + t * ue;
    const Float8 lean = tolerance + load8(block.tilt) * limit;
    const Float8 d2 = ww + splat8(2.0f) * t * uw + t * t * uu - s * s;
    const Float8 t_slack = splat8(1e-3f);
    const Float8 rise0 = dot3(m0, u), rise1 = dot3(m1, u);
    const Int8 along = (t >= -t_slack) & (t <= one + t_slack) & (s >= -tolerance) &
                       (s <= length + tolerance) & (w0 + t * rise0 <= lean) & (w1 + t * rise1 <= lean) &
                       (d2 <= limit * limit);
    // Of those the whole segment is asked: at least one end must lean away, and the first be near.
    const Float8 stray = limit + splat8(0.1f * static_cast<float>(norm(segment)));
    const Int8 beside = (w0 + (rise0 < zero ? rise0 : zero) <= lean) &
                        (w1 + (rise1 < zero ? rise1 : zero) <= lean) & (ww - ew * ew <= stray * stray);
    return {mask8(point), mask8(parallel ? beside : along)};
}

} // namespace calot::geometry
