// The local minima of the distance from a point or a segment to a surface: what contacts are made of. Each
// function asks one part of the surface (a face, an edge, a vertex) in double precision; whether it is a
// contact is for the caller to say.
//
// Neighbouring parts accept a little more than their share, so that rounding leaves no gap between them: a
// minimum on the border may be found twice, at the same place, never not at all.
#pragma once

#include "geometry/triangle_scene.hpp"

#include <cstdint>

namespace calot::geometry {

struct Minimum {
    Vec3 point;             // on the surface
    Vec3 normal;            // unit, the surface's outward direction there, through the point or segment
    double distance;        // >= 0
    double t;               // on the segment; 0 for a point
    std::uint64_t part;     // which face, edge or vertex, independent of the tree; also breaks ties
    std::uint32_t position; // the triangle that owns the part
    bool behind;            // seen from the back of the surface: normal points away from the point or segment
};

namespace detail {

// Rounding allowance on directions, rad.
constexpr double direction_tolerance = 1e-9;
// Edges flatter than this, rad, are left to their faces, which accept as much beyond their borders.
constexpr double flat_edge = 1e-6;
// Segments nearly parallel to a flat wall touch its sharp rim (sharper than 10 degrees) up to this tilt, rad,
// so that rim and node hold together and the contact does not hop between them.
constexpr double rim_tilt = 0.05, rim_sharpness = 0.17;

// Is the angle between d and w at least 90 degrees, less `slack` rad?
inline bool leans_away(Vec3 d, Vec3 w, double slack) {
    const double along = dot(d, w);
    return along <= 0.0 || along * along <= slack * slack * norm2(d) * norm2(w);
}

// Part of w across the direction e.
inline Vec3 across(Vec3 w, Vec3 e) {
    return w - (dot(w, e) / norm2(e)) * e;
}

inline Vec3 unit_or_zero(Vec3 v) {
    const double length = norm(v);
    return length > 0.0 ? (1.0 / length) * v : Vec3{};
}

// Across the face, with the length of twice its area.
inline Vec3 area_vector(const TriangleScene& scene, std::uint32_t position) {
    const auto& t = scene.triangles()[position];
    const Vec3 a = scene.corner(t, 0);
    return cross(scene.corner(t, 1) - a, scene.corner(t, 2) - a);
}

// An edge and the one or two faces at it.
struct EdgeFrame {
    Vec3 start, along;     // from end to end
    Vec3 inward0, inward1; // in the faces' planes, across the edge, from it; inward1 zero at a border
    Vec3 outward;          // mean of the faces' normals
    bool convex;           // a border counts as convex
    double tilt;           // up to which segments touch it
};

inline EdgeFrame edge_frame(const TriangleScene& scene, const TriangleScene::Edge& edge) {
    EdgeFrame frame{};
    frame.start = scene.vertices()[edge.vertex[0]];
    frame.along = scene.vertices()[edge.vertex[1]] - frame.start;
    frame.inward0 = across(scene.vertices()[edge.opposite[0]] - frame.start, frame.along);
    frame.convex = true;
    frame.tilt = rim_tilt;
    frame.outward = unit_or_zero(area_vector(scene, edge.triangle[0]));
    if (edge.triangle[1] == TriangleScene::none) return frame;
    frame.inward1 = across(scene.vertices()[edge.opposite[1]] - frame.start, frame.along);
    const Vec3 n0 = frame.outward, n1 = unit_or_zero(area_vector(scene, edge.triangle[1]));
    const double dip = -dot(n0, frame.inward1), length = norm(frame.inward1); // ratio: sine of the turn
    frame.convex = dip > flat_edge * length;
    if (dip < rim_sharpness * length && dot(n0, n1) > 0.0) frame.tilt = direction_tolerance;
    frame.outward = n0 + n1;
    return frame;
}

// Outward direction at a vertex, faces weighted by their angle: has the right sign for every point whose
// nearest surface point is the vertex (Baerentzen and Aanaes 2005).
inline Vec3 vertex_outward(const TriangleScene& scene, std::uint32_t vertex) {
    Vec3 sum;
    for (const std::uint32_t position : scene.around(vertex)) {
        const auto& t = scene.triangles()[position];
        const int k = t.vertex[0] == vertex ? 0 : t.vertex[1] == vertex ? 1 : 2;
        const Vec3 e = scene.corner(t, (k + 1) % 3) - scene.corner(t, k);
        const Vec3 f = scene.corner(t, (k + 2) % 3) - scene.corner(t, k);
        const double angle = std::atan2(norm(cross(e, f)), dot(e, f));
        sum = sum + angle * unit_or_zero(area_vector(scene, position));
    }
    return sum;
}

inline bool vertex_is_nearest_along(const TriangleScene& scene, std::uint32_t vertex, Vec3 d) {
    const Vec3 v = scene.vertices()[vertex];
    for (const std::uint32_t position : scene.around(vertex))
        for (const std::uint32_t other : scene.triangles()[position].vertex)
            if (other != vertex && !leans_away(d, scene.vertices()[other] - v, direction_tolerance))
                return false;
    return true;
}

// Completes a minimum seen along d, from its point; `outward` decides the side, and the normal where d has no
// direction. Returns false where neither has.
inline bool complete(Minimum& minimum, Vec3 d, Vec3 outward) {
    minimum.distance = norm(d);
    minimum.behind = dot(d, outward) < 0.0;
    Vec3 n = minimum.behind ? -d : d;
    if (minimum.distance < 1e-9) n = outward; // a nanometre: the direction of d is noise
    minimum.normal = unit_or_zero(n);
    return minimum.normal != Vec3{};
}

} // namespace detail

// Of point c over the inside of a face.
inline bool face_minimum(const TriangleScene& scene, std::uint32_t position, Vec3 c, double reach,
                         Minimum& minimum) {
    const TriangleScene::Triangle& triangle = scene.triangles()[position];
    const Vec3 corners[3] = {scene.corner(triangle, 0), scene.corner(triangle, 1), scene.corner(triangle, 2)};
    const Vec3 n = cross(corners[1] - corners[0], corners[2] - corners[0]);
    const double nn = norm2(n), height = dot(c - corners[0], n); // height times |n|
    if (!(nn > 0.0) || height * height > reach * reach * nn) return false;
    const double slack = 1.5 * detail::flat_edge * std::fabs(height);
    for (int k = 0; k < 3; ++k) {
        const Vec3 e = corners[(k + 1) % 3] - corners[k];
        const double inside = dot(cross(n, e), c - corners[k]); // times |n| |e|
        if (inside < 0.0 && inside * inside > slack * slack * norm2(e)) return false;
    }
    const double length = std::sqrt(nn);
    minimum.behind = height < 0.0;
    minimum.distance = std::fabs(height) / length;
    minimum.normal = (1.0 / length) * n;
    minimum.point = c - (height / nn) * n;
    minimum.t = 0.0;
    minimum.part = triangle.key;
    minimum.position = position;
    return true;
}

// Of point c at an edge: a convex one, or when `behind` any one.
inline bool edge_minimum(const TriangleScene& scene, std::uint32_t index, Vec3 c, double reach, bool behind,
                         Minimum& minimum) {
    using namespace detail;
    const TriangleScene::Edge& edge = scene.edges()[index];
    const Vec3 a = scene.vertices()[edge.vertex[0]], e = scene.vertices()[edge.vertex[1]] - a;
    const double s = dot(c - a, e) / norm2(e);
    if (!(s >= 0.0 && s <= 1.0)) return false;
    minimum.point = a + s * e;
    const Vec3 d = c - minimum.point;
    if (!(norm2(d) <= reach * reach)) return false;
    const EdgeFrame frame = edge_frame(scene, edge);
    if (!behind && !frame.convex) return false;
    if (!leans_away(d, frame.inward0, direction_tolerance) ||
        !leans_away(d, frame.inward1, direction_tolerance))
        return false;
    minimum.t = 0.0;
    minimum.part = 1ull << 32 | index;
    minimum.position = edge.triangle[0];
    return complete(minimum, d, frame.outward);
}

// Of point c at a vertex.
inline bool vertex_minimum(const TriangleScene& scene, std::uint32_t vertex, Vec3 c, double reach,
                           Minimum& minimum) {
    using namespace detail;
    minimum.point = scene.vertices()[vertex];
    const Vec3 d = c - minimum.point;
    if (!(norm2(d) <= reach * reach) || !vertex_is_nearest_along(scene, vertex, d)) return false;
    minimum.t = 0.0;
    minimum.part = 2ull << 32 | vertex;
    minimum.position = scene.owner(vertex);
    return complete(minimum, d, vertex_outward(scene, vertex));
}

// Of the inside (0 < t < 1) of segment p0-p1 at a convex edge. Seen from behind it is an edge that was
// passed.
inline bool edge_minimum_along(const TriangleScene& scene, std::uint32_t index, Vec3 p0, Vec3 p1,
                               double reach, Minimum& minimum) {
    using namespace detail;
    const TriangleScene::Edge& edge = scene.edges()[index];
    const Vec3 a = scene.vertices()[edge.vertex[0]], e = scene.vertices()[edge.vertex[1]] - a;
    const Vec3 u = p1 - p0, w = p0 - a;
    const double uu = norm2(u), ee = norm2(e), ue = dot(u, e), uw = dot(u, w), ew = dot(e, w);
    const double det = uu * ee - ue * ue;
    if (!(det > 1e-8 * uu * ee)) return false; // parallel to 0.1 mrad: ends and vertices see it
    const double t = (ue * ew - ee * uw) / det, s = (uu * ew - ue * uw) / det;
    if (!(t > 0.0 && t < 1.0 && s >= 0.0 && s <= 1.0)) return false;
    minimum.point = a + s * e;
    const Vec3 d = p0 + t * u - minimum.point;
    if (!(norm2(d) <= reach * reach)) return false;
    const EdgeFrame frame = edge_frame(scene, edge);
    if (!frame.convex) return false;
    minimum.t = t;
    minimum.part = 1ull << 32 | index;
    minimum.position = edge.triangle[0];
    // By the normal, not by d: from either side of the surface an edge is touched where it sticks out.
    return complete(minimum, d, frame.outward) && leans_away(minimum.normal, frame.inward0, frame.tilt) &&
           leans_away(minimum.normal, frame.inward1, frame.tilt);
}

// Of the inside (0 < t < 1) of segment p0-p1 at a vertex.
inline bool vertex_minimum_along(const TriangleScene& scene, std::uint32_t vertex, Vec3 p0, Vec3 p1,
                                 double reach, Minimum& minimum) {
    using namespace detail;
    minimum.point = scene.vertices()[vertex];
    const Vec3 u = p1 - p0;
    const double t = dot(minimum.point - p0, u) / norm2(u);
    if (!(t > 0.0 && t < 1.0)) return false;
    const Vec3 d = p0 + t * u - minimum.point;
    if (!(norm2(d) <= reach * reach)) return false;
    // The neighbours decide before the normal, which costs more.
    const bool front = vertex_is_nearest_along(scene, vertex, d);
    if (!front && !vertex_is_nearest_along(scene, vertex, -d)) return false;
    minimum.t = t;
    minimum.part = 2ull << 32 | vertex;
    minimum.position = scene.owner(vertex);
    return complete(minimum, d, vertex_outward(scene, vertex)) && minimum.behind != front;
}

} // namespace calot::geometry
