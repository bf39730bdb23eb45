#include "geometry/candidates.hpp"

#include "geometry/near_segment.hpp"

#include <algorithm>
#include <array>

namespace calot::geometry {

using detail::dot3;
using detail::Float8;
using detail::Int8;

void Candidates::gather(const TriangleScene& scene, Vec3 q0, Vec3 q1, double reach, double slack) {
    version_ = scene.version();
    surface_ = 0;
    q0_ = q0;
    q1_ = q1;
    reach_ = reach;
    slack_ = slack;
    tolerance_ = 1e-6f + scene.screen_tolerance();
    complete_ = true;
    face_count_ = edge_count_ = vertex_count_ = 0;
    const float s = static_cast<float>(slack) + scene.screen_tolerance();
    const detail::NearSegment segment(q0, q1, reach, s);
    // A leaf is a dozen cache lines and more: they are fetched while the tree is still being asked.
    struct Near {
        std::uint32_t leaf;
        bool faces; // are asked for the first end only
    };
    std::array<Near, 64> waiting;
    std::size_t count = 0;
    const auto take = [&] {
        for (std::size_t i = 0; i < count; ++i)
            gather_leaf(scene, waiting[i].leaf, waiting[i].faces, segment);
        count = 0;
    };
    scene.tree().around_segment(
        q0, q1, reach + static_cast<double>(s), [&](std::uint32_t leaf, bool near_q0) {
            const TriangleScene::LeafPlane& plane = scene.plane(leaf);
            const double lowest = static_cast<double>(plane.lowest) - static_cast<double>(s);
            const double height0 = detail::height_over(plane, q0);
            if (height0 < lowest && detail::height_over(plane, q1) < lowest) return; // all behind
            scene.prefetch(leaf);
            if (count == waiting.size()) take();
            waiting[count++] = {leaf, near_q0 && height0 >= lowest};
        });
    take();
}

void Candidates::gather_leaf(const TriangleScene& scene, std::uint32_t leaf, bool near_q0,
                             const detail::NearSegment& segment) {
    unsigned lanes = 0;
    if (near_q0) {
        const std::uint32_t first = scene.tree().leaf_begin(leaf);
        const TriangleScene::FaceBlock& block = scene.faces(leaf);
        const float slack = static_cast<float>(slack_) + scene.screen_tolerance();
        lanes = detail::lanes_below(block, q0_, static_cast<float>(reach_), slack);
        lanes &= (1u << (scene.tree().leaf_begin(leaf + 1) - first)) - 1;
        for (; lanes != 0; lanes &= lanes - 1) {
            const auto lane = static_cast<std::uint32_t>(__builtin_ctz(lanes));
            add_face(block, lane, first + lane);
        }
    }
    for (const TriangleScene::EdgeBlock& edges : scene.convex_edges(leaf))
        for (lanes = segment.touching(edges); lanes != 0; lanes &= lanes - 1)
            add_edge(edges, static_cast<std::uint32_t>(__builtin_ctz(lanes)));
    for (const TriangleScene::SalientVertex& vertex : scene.salient_vertices(leaf))
        if (segment.touches(vertex)) add_vertex(vertex.vertex);
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
    FaceLanes& to = blocks_[face_count_ / 8].faces;
    const std::uint32_t at = face_count_++ % 8;
    to.position[at] = position;
    const auto copy = [&](const float(&n)[3][8], const float(&offset)[8], float(&n_to)[3][8],
                          float(&offset_to)[8]) {
        for (int k = 0; k < 3; ++k)
            n_to[k][at] = n[k][lane];
        const Vec3 normal{n[0][lane], n[1][lane], n[2][lane]};
        offset_to[at] = static_cast<float>(static_cast<double>(offset[lane]) - dot(normal, q0_));
    };
    copy(block.normal, block.offset, to.planes.normal, to.planes.offset);
    for (int k = 0; k < 3; ++k)
        copy(block.inward[k], block.inward_offset[k], to.planes.inward[k], to.planes.inward_offset[k]);
}

void Candidates::add_edge(const EdgeBlock& block, std::uint32_t lane) {
    if (edge_count_ == most_edges) {
        complete_ = false;
        return;
    }
    EdgeBlock& to = blocks_[edge_count_ / 8].edges;
    const std::uint32_t at = edge_count_++ % 8;
    for (int k = 0; k < 3; ++k) {
        to.start[k][at] = static_cast<float>(static_cast<double>(block.start[k][lane]) - q0_[k]);
        to.along[k][at] = block.along[k][lane];
        to.inward0[k][at] = block.inward0[k][lane];
        to.inward1[k][at] = block.inward1[k][lane];
    }
    to.length[at] = block.length[lane];
    to.tilt[at] = std::fabs(block.tilt[lane]);
    to.edge[at] = block.edge[lane];
}

// Positions relative to q0. The same conditions as in edge_minimum and edge_minimum_along, less a micrometre
// and the rounding of the edges' places.
Candidates::EdgeLanes Candidates::screen(const EdgeBlock& block, Vec3 p0, Vec3 p1, float reach) const {
    using namespace detail;
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
