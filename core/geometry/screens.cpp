#include "geometry/surface_minima.hpp"
#include "geometry/triangle_scene.hpp"

#include <algorithm>
#include <limits>

namespace calot::geometry {
namespace {

void set_lane(float (&to)[3][8], std::uint32_t lane, Vec3 v) {
    for (int k = 0; k < 3; ++k) to[k][lane] = static_cast<float>(v[k]);
}

void set(float (&to)[3], Vec3 v) {
    for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(v[k]);
}

} // namespace

void TriangleScene::make_screens() {
    using namespace detail;
    const std::uint32_t leaves = tree_.leaf_count();
    double farthest = 0.0;
    for (const Vec3& v : vertices_)
        farthest = std::max({farthest, std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
    // Offsets and points err by 2^-24 of their size each, products add as much again; 10 um are left for thin
    // triangles, whose planes are the less certain the thinner they are.
    screen_tolerance_ = static_cast<float>(1e-5 + 1e-6 * farthest);

    faces_.resize(leaves);
    leaf_edges_.assign(1, 0);
    leaf_vertex_begins_.assign(1, 0);
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
        FaceBlock& block = faces_[leaf];
        block = {};
        std::fill_n(block.offset, 8, std::numeric_limits<float>::infinity());
        const std::uint32_t first = tree_.leaf_begin(leaf);
        for (std::uint32_t i = first; i < tree_.leaf_begin(leaf + 1); ++i) {
            const Triangle& t = triangles_[i];
            const std::uint32_t lane = i - first;
            const Vec3 a = corner(t, 0), n = cross(corner(t, 1) - a, corner(t, 2) - a);
            const double area = norm(n);
            const double longest2 = std::max({norm2(corner(t, 1) - a), norm2(corner(t, 2) - corner(t, 1)),
                                              norm2(a - corner(t, 2))});
            block.offset[lane] = 0.0f;
            if (area > 1e-6 * longest2) { // thinner ones pass every screen
                const Vec3 unit = (1.0 / area) * n;
                set_lane(block.normal, lane, unit);
                block.offset[lane] = static_cast<float>(dot(unit, a));
                for (int k = 0; k < 3; ++k) {
                    const Vec3 m = cross(unit, corner(t, (k + 1) % 3) - corner(t, k));
                    const Vec3 inward = (1.0 / norm(m)) * m;
                    set_lane(block.inward[k], lane, inward);
                    block.inward_offset[k][lane] = static_cast<float>(dot(inward, corner(t, k)));
                }
            }
            for (int k = 0; k < 3; ++k) {
                if (t.owns >> (3 + k) & 1) leaf_vertices_.push_back(t.vertex[k]);
                if (!(t.owns >> k & 1)) continue;
                const Edge& edge = edges_[t.edge[k]];
                const EdgeFrame frame = edge_frame(*this, edge);
                if (!frame.convex) continue;
                EdgeScreen screen{};
                const double length = norm(frame.along);
                set(screen.start, frame.start);
                set(screen.along, (1.0 / length) * frame.along);
                screen.length = static_cast<float>(length);
                // Towards a face that is hardly there nothing is refused.
                const auto unit_or_none = [](Vec3 m, double scale) {
                    return norm(m) > 1e-6 * scale ? (1.0 / norm(m)) * m : Vec3{};
                };
                set(screen.inward0, unit_or_none(frame.inward0, length));
                set(screen.inward1, unit_or_none(frame.inward1, length));
                screen.rim = static_cast<float>(frame.tilt);
                screen.edge = t.edge[k];
                edge_screens_.push_back(screen);
            }
        }
        leaf_edges_.push_back(static_cast<std::uint32_t>(edge_screens_.size()));
        leaf_vertex_begins_.push_back(static_cast<std::uint32_t>(leaf_vertices_.size()));
    }
}

} // namespace calot::geometry
