#include "geometry/candidates.hpp"

#include <algorithm>

namespace calot::geometry {
namespace {

struct Vec3f {
    float x, y, z;
};

float dot(const float (&a)[3], Vec3f b) { return a[0] * b.x + a[1] * b.y + a[2] * b.z; }

Vec3f difference(Vec3f p, const float (&a)[3]) { return {p.x - a[0], p.y - a[1], p.z - a[2]}; }

// Lanes whose face may have the foot of a point within `slack` of p on it, at a height of 0 to reach.
unsigned lanes_below(const TriangleScene::FaceBlock& block, Vec3f p, float reach, float slack) {
    using namespace detail;
    const Float8 x = splat8(p.x), y = splat8(p.y), z = splat8(p.z), least = splat8(-slack);
    const auto height = [&](const float (&n)[3][8], const float (&offset)[8]) {
        return load8(n[0]) * x + load8(n[1]) * y + load8(n[2]) * z - load8(offset);
    };
    const Float8 over = height(block.normal, block.offset);
    Int8 pass = (over >= least) & (over <= splat8(reach + slack));
    for (int k = 0; k < 3; ++k) pass &= height(block.inward[k], block.inward_offset[k]) >= least;
    return mask8(pass);
}

bool edge_may_touch(const TriangleScene::EdgeScreen& screen, Vec3f p0, Vec3f p1, float reach, float slack) {
    const Vec3f d0 = difference(p0, screen.start), d1 = difference(p1, screen.start);
    const float s0 = dot(screen.along, d0), s1 = dot(screen.along, d1);
    if (std::max(s0, s1) < -slack || std::min(s0, s1) > screen.length + slack) return false;
    const float lean = slack + screen.rim * (reach + slack);
    if (std::min(dot(screen.inward0, d0), dot(screen.inward0, d1)) > lean) return false;
    if (std::min(dot(screen.inward1, d0), dot(screen.inward1, d1)) > lean) return false;
    // The middle of the edge against the segment.
    const float half = 0.5f * screen.length;
    const Vec3f m{d0.x - half * screen.along[0], d0.y - half * screen.along[1], d0.z - half * screen.along[2]};
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
    complete_ = true;
    face_count_ = edge_count_ = vertex_count_ = 0;
    const Vec3f p0{static_cast<float>(q0.x), static_cast<float>(q0.y), static_cast<float>(q0.z)};
    const Vec3f p1{static_cast<float>(q1.x), static_cast<float>(q1.y), static_cast<float>(q1.z)};
    const float r = static_cast<float>(reach), s = static_cast<float>(slack) + scene.screen_tolerance();
    const auto add = [this](auto& list, std::uint32_t& count, std::uint32_t part) {
        if (count < list.size())
            list[count++] = part;
        else
            complete_ = false;
    };
    scene.tree().overlapping(box_of(q0, q1, reach + slack), [&](std::uint32_t leaf) {
        const std::uint32_t first = scene.tree().leaf_begin(leaf);
        unsigned lanes = lanes_below(scene.faces(leaf), p0, r, s) &
                         ((1u << (scene.tree().leaf_begin(leaf + 1) - first)) - 1);
        for (; lanes != 0; lanes &= lanes - 1)
            add(faces_, face_count_, first + static_cast<std::uint32_t>(__builtin_ctz(lanes)));
        for (const TriangleScene::EdgeScreen& screen : scene.convex_edges(leaf))
            if (edge_may_touch(screen, p0, p1, r, s)) add(edges_, edge_count_, screen.edge);
        for (const std::uint32_t vertex : scene.owned_vertices(leaf))
            if (vertex_may_touch(scene, vertex, q0, q1, reach, static_cast<double>(s)))
                add(vertices_, vertex_count_, vertex);
    });
}

} // namespace calot::geometry
