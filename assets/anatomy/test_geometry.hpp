// What the tests of anatomies measure meshes with.
#pragma once

#include <calot/meshio/mesh.hpp>

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace calot::meshio {

constexpr double endoscope_radius = 0.0063; // m, facts.tsv endoscope.GIF-2T160.OD

inline Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vec3 operator*(double s, const Vec3& a) {
    return {s * a[0], s * a[1], s * a[2]};
}
inline double dot(const Vec3& a, const Vec3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double norm(const Vec3& a) {
    return std::sqrt(dot(a, a));
}

inline double segment_distance(const Vec3& p, const Vec3& a, const Vec3& b) {
    const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
    return norm(p - a - t * (b - a));
}

inline double triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = cross(b - a, c - a);
    const bool over = dot(cross(b - a, n), p - a) <= 0 && dot(cross(c - b, n), p - b) <= 0 &&
                      dot(cross(a - c, n), p - c) <= 0;
    if (over) return std::abs(dot(p - a, n)) / norm(n);
    return std::min({segment_distance(p, a, b), segment_distance(p, b, c), segment_distance(p, c, a)});
}

inline double clearance(const TriangleMesh& mesh, const Vec3& p) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& t : mesh.triangles)
        least = std::min(least,
                         triangle_distance(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
    return least;
}

/// Whether p lies in the solid: the sum of the solid angles is 4 pi inside (Van Oosterom and Strackee 1983).
inline bool inside(const TriangleMesh& mesh, const Vec3& p) {
    double turns = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3 u = mesh.vertices[t[0]] - p, v = mesh.vertices[t[1]] - p, w = mesh.vertices[t[2]] - p;
        const double lu = norm(u), lv = norm(v), lw = norm(w);
        turns +=
            std::atan2(dot(u, cross(v, w)), lu * lv * lw + dot(u, v) * lw + dot(v, w) * lu + dot(w, u) * lv);
    }
    return turns > M_PI; // half of it is summed
}

inline Vec3 vec(const toml::node_view<toml::node>& v) {
    const toml::array& a = *v.as_array();
    return {a[0].value<double>().value(), a[1].value<double>().value(), a[2].value<double>().value()};
}

} // namespace calot::meshio
