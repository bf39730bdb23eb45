// The parts of the surface that may give a node and the segment behind it a contact, remembered while they
// hardly move.
#pragma once

#include "geometry/triangle_scene.hpp"

#include <array>
#include <cstdint>

namespace calot::geometry {

namespace detail {
struct NearSegment;
}

// Calls face(position), edge(index), vertex(index) for every part of a triangle whose leaf overlaps the box,
// each part once.
template<class Face, class EdgeVisit, class Vertex>
void visit_parts(const TriangleScene& scene, const Box& box, Face&& face, EdgeVisit&& edge, Vertex&& vertex) {
    scene.tree().overlapping(box, [&](std::uint32_t leaf) {
        for (std::uint32_t i = scene.tree().leaf_begin(leaf); i < scene.tree().leaf_begin(leaf + 1); ++i) {
            const TriangleScene::Triangle& t = scene.triangles()[i];
            face(i);
            for (int k = 0; k < 3; ++k) {
                if (t.owns >> k & 1) edge(t.edge[k]);
                if (t.owns >> (3 + k) & 1) vertex(t.vertex[k]);
            }
        }
    });
}

// Superset of the parts that a point near q0 (faces) or the segment near q0-q1 (convex edges, vertices) may
// touch from outside up to `reach`, while neither end is farther than `slack` from where it was.
class Candidates {
  public:
    // Ends may move `slack`, m, before the tree is asked again. What rests wants short lists, what moves
    // wants to keep them for many ticks.
    static constexpr double least_slack = 0.4e-3, least_moving_slack = 1e-3, most_slack = 3.5e-3;
    static constexpr std::size_t most_faces = 224, most_edges = 224, most_vertices = 128;

    bool hold(std::uint64_t version, Vec3 p0, Vec3 p1, double reach) const {
        return version_ == version && reach <= reach_ && norm2(p0 - q0_) <= slack_ * slack_ &&
               norm2(p1 - q1_) <= slack_ * slack_;
    }

    // Is the first end, having come from `before`, on its way out?
    bool aging(Vec3 p0, Vec3 before) const {
        const Vec3 away = p0 - q0_;
        return dot(away, p0 - before) > 0.0 && norm2(away) > 0.7 * slack_ * slack_;
    }

    // Finds them anew, for scenes with screens only. complete(): there were not too many to remember.
    void gather(const TriangleScene& scene, Vec3 q0, Vec3 q1, double reach, double slack);

    // The same for a scene whose vertices move: which triangles are within reach is asked of the tree; their
    // screens are made anew for each content of the scene, until the ends or the vertices have moved too far.
    bool hold_moving(const TriangleScene& scene, Vec3 p0, Vec3 p1, double reach) const;
    void gather_moving(const TriangleScene& scene, Vec3 q0, Vec3 q1, double reach, double slack);
    bool are_screens_of(const TriangleScene& scene) const { return version_ == scene.version(); }
    void make_screens(const TriangleScene& scene);

    bool complete() const { return complete_; }
    std::span<const std::uint32_t> vertices() const { return {vertices_.data(), vertex_count_}; }

    // Calls visit(position) for the faces that may have the foot of p0 on them now.
    template<class Visit>
    void faces(Vec3 p0, double reach, Visit&& visit) const;

    // Calls at_point(edge) for the edges that p0 may touch now, inside(edge) for those that the inside of
    // p0-p1 may.
    template<class AtPoint, class Inside>
    void edges(Vec3 p0, Vec3 p1, double reach, AtPoint&& at_point, Inside&& inside) const;

  private:
    // Lane by lane, places relative to q0: in single precision good to a few nanometres.
    struct alignas(32) FaceLanes {
        TriangleScene::FaceBlock planes;
        std::uint32_t position[8];
    };
    using EdgeBlock = TriangleScene::EdgeBlock; // tilts without their signs
    struct EdgeLanes {
        unsigned at_point, inside;
    };
    EdgeLanes screen(const EdgeBlock& block, Vec3 p0, Vec3 p1, float reach) const;
    void screen_faces(const TriangleScene& scene);
    void screen_edges(const TriangleScene& scene);
    void gather_leaf(const TriangleScene& scene, std::uint32_t leaf, bool near_q0,
                     const detail::NearSegment& segment);
    void add_face(const TriangleScene::FaceBlock& block, std::uint32_t lane, std::uint32_t position);
    void add_vertex(std::uint32_t vertex);
    void add_edge(const TriangleScene::EdgeBlock& block, std::uint32_t lane);

    std::uint64_t version_ = 0;
    Vec3 q0_, q1_;
    double reach_ = 0, slack_ = 0;
    float tolerance_ = 0, least_height_ = 0;
    bool complete_ = false;
    std::uint32_t face_count_ = 0, edge_count_ = 0, vertex_count_ = 0;
    std::array<std::uint32_t, most_vertices> vertices_;

    // Of a moving scene: positions of the triangles within reach, and how far it had moved then.
    std::uint64_t surface_ = 0;
    double moved_ = 0, span_ = 0; // span: how far from q0 their corners were, m
    std::uint32_t near_count_ = 0;
    bool near_complete_ = false;
    std::array<std::uint32_t, most_faces> near_;

    // Side by side, since of both only the first few are used.
    struct Blocks {
        FaceLanes faces;
        EdgeBlock edges;
    };
    static_assert(most_faces == most_edges);
    std::array<Blocks, most_faces / 8> blocks_;
};

namespace detail {

// Lanes whose face may have the foot of a point within `slack` of p on it, at a height of 0 to reach.
inline unsigned lanes_below(const TriangleScene::FaceBlock& block, Vec3 p, float reach, float slack) {
    const Float8 x = splat8(static_cast<float>(p.x)), y = splat8(static_cast<float>(p.y)),
                 z = splat8(static_cast<float>(p.z)), least = splat8(-slack);
    const auto height = [&](const float(&n)[3][8], const float(&offset)[8]) {
        return load8(n[0]) * x + load8(n[1]) * y + load8(n[2]) * z - load8(offset);
    };
    const Float8 over = height(block.normal, block.offset);
    Int8 pass = (over >= least) & (over <= splat8(reach + slack));
    if (mask8(pass) == 0) return 0;
    for (int k = 0; k < 3; ++k)
        pass &= height(block.inward[k], block.inward_offset[k]) >= least;
    return mask8(pass);
}

} // namespace detail

template<class Visit>
void Candidates::faces(Vec3 p0, double reach, Visit&& visit) const {
    for (std::uint32_t first = 0; first < face_count_; first += 8) {
        const FaceLanes& lanes = blocks_[first / 8].faces;
        const unsigned used = face_count_ - first >= 8 ? 0xffu : (1u << (face_count_ - first)) - 1;
        unsigned mask =
            used & detail::lanes_below(lanes.planes, p0 - q0_, static_cast<float>(reach), tolerance_);
        for (; mask != 0; mask &= mask - 1)
            visit(lanes.position[__builtin_ctz(mask)]);
    }
}

template<class AtPoint, class Inside>
void Candidates::edges(Vec3 p0, Vec3 p1, double reach, AtPoint&& at_point, Inside&& inside) const {
    for (std::uint32_t first = 0; first < edge_count_; first += 8) {
        const EdgeBlock& block = blocks_[first / 8].edges;
        EdgeLanes lanes = screen(block, p0 - q0_, p1 - q0_, static_cast<float>(reach));
        const unsigned used = edge_count_ - first >= 8 ? 0xffu : (1u << (edge_count_ - first)) - 1;
        for (lanes.at_point &= used; lanes.at_point != 0; lanes.at_point &= lanes.at_point - 1)
            at_point(block.edge[__builtin_ctz(lanes.at_point)]);
        for (lanes.inside &= used; lanes.inside != 0; lanes.inside &= lanes.inside - 1)
            inside(block.edge[__builtin_ctz(lanes.inside)]);
    }
}

} // namespace calot::geometry
