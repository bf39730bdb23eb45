// The local minima of the distance from a point or a segment to a surface: what contacts are made of.
#pragma once

#include "geometry/distance.hpp"
#include "geometry/triangle_scene.hpp"

#include <cstdint>

namespace calot::geometry {

// One local minimum. Whether it is a contact is for the caller to say.
struct Minimum {
    Vec3 point;             // on the surface
    Vec3 normal;            // unit, the surface's outward direction there, through the point or segment
    double distance;        // >= 0
    double t;               // on the segment; 0 for a point
    std::uint64_t part;     // which face, edge or vertex, independent of the tree; also breaks ties
    std::uint32_t position; // the triangle that owns the part
    bool behind;            // seen from the back of the surface: normal points away from it
};

// Calls found(Minimum) for the minima over triangle `position` and the edges and vertices that it owns, of
// point c, up to distance `reach`.
template<class Found>
void minima_at_point(const TriangleScene& scene, std::uint32_t position, Vec3 c, double reach, Found&& found);

// The same for the inside (0 < t < 1) of segment p0-p1, over convex edges and the vertices; faces have none.
template<class Found>
void minima_along_segment(const TriangleScene& scene, std::uint32_t position, Vec3 p0, Vec3 p1, double reach,
                          Found&& found);

namespace detail {

constexpr std::uint64_t face_part(std::uint32_t key) {
    return key;
}
constexpr std::uint64_t edge_part(std::uint32_t edge) {
    return 1ull << 32 | edge;
}
constexpr std::uint64_t vertex_part(std::uint32_t vertex) {
    return 2ull << 32 | vertex;
}

// Rounding allowance on directions: a minimum on the border between two parts must not fall between them.
constexpr double direction_tolerance = 1e-9;
// Segments nearly parallel to a flat wall touch its sharp rim (sharper than 10 degrees) up to this tilt, so
// that rim and node hold together and the contact does not hop between them.
constexpr double rim_tilt = 0.05, rim_sharpness = 0.17;

// Is the angle between d and w at least 90 degrees, less `slack` rad?
inline bool leans_away(Vec3 d, Vec3 w, double slack) {
    const double along = dot(d, w);
    return along <= 0.0 || along * along <= slack * slack * norm2(d) * norm2(w);
}

inline Vec3 face_normal(const TriangleScene& scene, std::uint32_t position) {
    const auto& t = scene.triangles()[position];
    const Vec3 n = cross(scene.corner(t, 1) - scene.corner(t, 0), scene.corner(t, 2) - scene.corner(t, 0));
    const double length = norm(n);
    return length > 0.0 ? (1.0 / length) * n : Vec3{};
}

// Mean outward direction of the one or two faces at an edge.
inline Vec3 edge_normal(const TriangleScene& scene, const TriangleScene::Edge& edge) {
    Vec3 n = face_normal(scene, edge.triangle[0]);
    if (edge.triangle[1] != TriangleScene::none) n = n + face_normal(scene, edge.triangle[1]);
    return n;
}

// Outward direction at a vertex, faces weighted by their angle: has the right sign for every point whose
// nearest surface point is the vertex (Baerentzen and Aanaes 2005).
inline Vec3 vertex_normal(const TriangleScene& scene, std::uint32_t vertex) {
    Vec3 sum;
    for (const std::uint32_t position : scene.around(vertex)) {
        const auto& t = scene.triangles()[position];
        const int k = t.vertex[0] == vertex ? 0 : t.vertex[1] == vertex ? 1 : 2;
        const Vec3 e = scene.corner(t, (k + 1) % 3) - scene.corner(t, k);
        const Vec3 f = scene.corner(t, (k + 2) % 3) - scene.corner(t, k);
        const double angle = std::atan2(norm(cross(e, f)), dot(e, f));
        sum = sum + angle * face_normal(scene, position);
    }
    return sum;
}

inline bool is_minimum_at_vertex(const TriangleScene& scene, std::uint32_t vertex, Vec3 d) {
    const Vec3 v = scene.vertices()[vertex];
    for (const std::uint32_t position : scene.around(vertex))
        for (const std::uint32_t other : scene.triangles()[position].vertex)
            if (other != vertex && !leans_away(d, scene.vertices()[other] - v, direction_tolerance))
                return false;
    return true;
}

// Part of w across the direction e.
inline Vec3 across(Vec3 w, Vec3 e) {
    return w - (dot(w, e) / norm2(e)) * e;
}

// Completes a minimum at `point` seen along d = c - point; `outward` decides the side, and the normal where d
// has no direction. Returns false where neither has.
inline bool complete(Minimum& minimum, Vec3 d, Vec3 outward) {
    minimum.distance = norm(d);
    minimum.behind = dot(d, outward) < 0.0;
    Vec3 n = minimum.behind ? -d : d;
    if (minimum.distance < 1e-9) n = outward; // a nanometre: the direction of d is noise
    const double length = norm(n);
    if (!(length > 0.0)) return false;
    minimum.normal = (1.0 / length) * n;
    return true;
}

} // namespace detail

template<class Found>
void minima_at_point(const TriangleScene& scene, std::uint32_t position, Vec3 c, double reach,
                     Found&& found) {
    using namespace detail;
    const TriangleScene::Triangle& triangle = scene.triangles()[position];
    const auto [point, part] = closest_on_triangle(c, scene.corner(triangle, 0), scene.corner(triangle, 1),
                                                   scene.corner(triangle, 2));
    const Vec3 d = c - point;
    if (!(norm2(d) <= reach * reach)) return;
    Minimum minimum{.point = point,
                    .normal = {},
                    .distance = 0,
                    .t = 0,
                    .part = 0,
                    .position = position,
                    .behind = false};
    const int k = static_cast<int>(part) % 3;
    if (part == TrianglePart::face) {
        minimum.part = face_part(triangle.key);
        const Vec3 n = face_normal(scene, position);
        if (!complete(minimum, d, n)) return;
        minimum.normal = n; // truer than d's direction when d is short
    } else if (part >= TrianglePart::edge0) {
        if (!(triangle.owns >> k & 1)) return;
        const TriangleScene::Edge& edge = scene.edges()[triangle.edge[k]];
        if (edge.triangle[1] != TriangleScene::none) {
            const Vec3 a = scene.vertices()[edge.vertex[0]], e = scene.vertices()[edge.vertex[1]] - a;
            const Vec3 m = across(scene.vertices()[edge.opposite[1]] - a, e);
            if (!leans_away(d, m, direction_tolerance)) return;
        }
        minimum.part = edge_part(triangle.edge[k]);
        if (!complete(minimum, d, edge_normal(scene, edge))) return;
    } else {
        if (!(triangle.owns >> (3 + k) & 1)) return;
        if (!is_minimum_at_vertex(scene, triangle.vertex[k], d)) return;
        minimum.part = vertex_part(triangle.vertex[k]);
        if (!complete(minimum, d, vertex_normal(scene, triangle.vertex[k]))) return;
    }
    found(minimum);
}

template<class Found>
void minima_along_segment(const TriangleScene& scene, std::uint32_t position, Vec3 p0, Vec3 p1, double reach,
                          Found&& found) {
    using namespace detail;
    const TriangleScene::Triangle& triangle = scene.triangles()[position];
    const Vec3 u = p1 - p0;
    const double uu = norm2(u);
    if (!(uu > 0.0)) return;
    for (int k = 0; k < 3; ++k) {
        if (!(triangle.owns >> k & 1)) continue;
        const TriangleScene::Edge& edge = scene.edges()[triangle.edge[k]];
        const Vec3 a = scene.vertices()[edge.vertex[0]], e = scene.vertices()[edge.vertex[1]] - a;
        const Vec3 w = p0 - a;
        const double ee = norm2(e), ue = dot(u, e), uw = dot(u, w), ew = dot(e, w);
        const double det = uu * ee - ue * ue;
        if (!(det > 1e-8 * uu * ee)) continue; // parallel to 0.1 mrad: ends and vertices see it
        const double t = (ue * ew - ee * uw) / det, s = (uu * ew - ue * uw) / det;
        if (!(t > 0.0 && t < 1.0 && s > 0.0 && s < 1.0)) continue;
        const Vec3 point = a + s * e, d = p0 + t * u - point;
        if (!(norm2(d) <= reach * reach)) continue;

        const Vec3 n0 = face_normal(scene, edge.triangle[0]);
        Vec3 outward = n0;
        const Vec3 m0 = across(scene.vertices()[edge.opposite[0]] - a, e);
        Vec3 m1{};
        double slack = rim_tilt;
        if (edge.triangle[1] != TriangleScene::none) {
            m1 = across(scene.vertices()[edge.opposite[1]] - a, e);
            const double dip = -dot(n0, m1), length = norm(m1); // sine of the turn over a convex edge
            if (!(dip > 1e-6 * length)) continue;
            const Vec3 n1 = face_normal(scene, edge.triangle[1]);
            if (dip < rim_sharpness * length && dot(n0, n1) > 0.0) slack = direction_tolerance;
            outward = outward + n1;
        }
        Minimum minimum{.point = point,
                        .normal = {},
                        .distance = 0,
                        .t = t,
                        .part = edge_part(triangle.edge[k]),
                        .position = position,
                        .behind = false};
        if (!complete(minimum, d, outward)) continue;
        // Towards the outside at an edge, hence the sign: seen from behind it is the edge that was passed.
        if (!leans_away(minimum.normal, m0, slack) || !leans_away(minimum.normal, m1, slack)) continue;
        found(minimum);
    }
    for (int k = 0; k < 3; ++k) {
        if (!(triangle.owns >> (3 + k) & 1)) continue;
        const Vec3 v = scene.corner(triangle, k);
        const double t = dot(v - p0, u) / uu;
        if (!(t > 0.0 && t < 1.0)) continue;
        const Vec3 d = p0 + t * u - v;
        if (!(norm2(d) <= reach * reach)) continue;
        Minimum minimum{.point = v,
                        .normal = {},
                        .distance = 0,
                        .t = t,
                        .part = vertex_part(triangle.vertex[k]),
                        .position = position,
                        .behind = false};
        // The fan decides before the normal, which costs more; as for edges, both directions are asked for.
        const bool front = is_minimum_at_vertex(scene, triangle.vertex[k], d);
        if (!front && !is_minimum_at_vertex(scene, triangle.vertex[k], -d)) continue;
        if (!complete(minimum, d, vertex_normal(scene, triangle.vertex[k]))) continue;
        if (minimum.behind == front) continue;
        found(minimum);
    }
}

} // namespace calot::geometry
