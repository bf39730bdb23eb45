// The parts of the surface that may give a node and the segment behind it a contact, remembered while they hardly move.
#pragma once

#include "geometry/triangle_scene.hpp"

#include <array>
#include <cstdint>

namespace calot::geometry {

// Calls face(position), edge(index), vertex(index) for every part of a triangle whose leaf overlaps the box, each
// part once.
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

// Superset of the parts that a point near q0 (faces) or the segment near q0-q1 (convex edges, vertices) may touch from
// outside up to `reach`, while neither end is farther than `slack` from where it was.
class Candidates {
  public:
    // Ends may move this far, m, before the tree is asked again: small enough for short lists, large enough for
    // several ticks of the fastest motion.
    static constexpr double slack = 1e-3;

    bool hold(std::uint64_t version, Vec3 p0, Vec3 p1, double reach) const {
        return version_ == version && reach <= reach_ && norm2(p0 - q0_) <= slack * slack &&
               norm2(p1 - q1_) <= slack * slack;
    }

    // Finds them anew, for scenes with screens only. complete(): there were not too many to remember.
    void gather(const TriangleScene& scene, Vec3 q0, Vec3 q1, double reach);

    bool complete() const { return complete_; }
    std::span<const std::uint32_t> faces() const { return {faces_.data(), face_count_}; }
    std::span<const std::uint32_t> edges() const { return {edges_.data(), edge_count_}; }
    std::span<const std::uint32_t> vertices() const { return {vertices_.data(), vertex_count_}; }

  private:
    std::uint64_t version_ = 0;
    Vec3 q0_, q1_;
    double reach_ = 0;
    bool complete_ = false;
    std::uint32_t face_count_ = 0, edge_count_ = 0, vertex_count_ = 0;
    std::array<std::uint32_t, 64> faces_;
    std::array<std::uint32_t, 96> edges_;
    std::array<std::uint32_t, 64> vertices_;
};

} // namespace calot::geometry
