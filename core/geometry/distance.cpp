#include "geometry/distance.hpp"

#include <algorithm>

namespace calot::geometry {
namespace {

double clamp01(double v) {
    return v < 0.0 ? 0.0 : v > 1.0 ? 1.0 : v;
}

// Parameter in [0, 1] of the point of a + t * ab closest to p; 0 on a segment without length.
double closest_parameter(Vec3 p, Vec3 a, Vec3 ab) {
    const double length2 = norm2(ab);
    return length2 > 0.0 ? clamp01(dot(p - a, ab) / length2) : 0.0;
}

PointOnTriangle closest_on_flat_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
    const Vec3 corners[3] = {a, b, c};
    PointOnTriangle best{a, TrianglePart::vertex0};
    double best_distance2 = norm2(p - a);
    for (int k = 0; k < 3; ++k) {
        const Vec3 edge = corners[(k + 1) % 3] - corners[k];
        const double t = closest_parameter(p, corners[k], edge);
        const Vec3 point = corners[k] + t * edge;
        if (norm2(p - point) < best_distance2) {
            best_distance2 = norm2(p - point);
            const int part = t <= 0.0 ? k : t >= 1.0 ? (k + 1) % 3 : 3 + k;
            best = {point, static_cast<TrianglePart>(part)};
        }
    }
    return best;
}

} // namespace

PointOnTriangle closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
    const Vec3 ab = b - a, ac = c - a, ap = p - a;
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) return {a, TrianglePart::vertex0};

    const Vec3 bp = p - b;
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) return {b, TrianglePart::vertex1};

    const Vec3 cp = p - c;
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6) return {c, TrianglePart::vertex2};

    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3)
        return {a + (d1 / (d1 - d3)) * ab, TrianglePart::edge0};

    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6)
        return {a + (d2 / (d2 - d6)) * ac, TrianglePart::edge2};

    const double va = d3 * d6 - d5 * d4;
    const double to_c = d4 - d3, to_b = d5 - d6;
    if (va <= 0.0 && to_c >= 0.0 && to_b >= 0.0 && to_c + to_b > 0.0)
        return {b + (to_c / (to_c + to_b)) * (c - b), TrianglePart::edge1};

    const double sum = va + vb + vc;
    if (!(sum > 0.0)) return closest_on_flat_triangle(p, a, b, c);
    return {a + (vb / sum) * ab + (vc / sum) * ac, TrianglePart::face};
}

SegmentPair closest_of_segments(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1) {
    const Vec3 u = p1 - p0, v = q1 - q0, w = p0 - q0;
    const double uu = norm2(u), vv = norm2(v), uv = dot(u, v), uw = dot(u, w), vw = dot(v, w);
    const double det = uu * vv - uv * uv;
    double s = 0.0, t = 0.0;
    if (uu <= 0.0) {
        t = closest_parameter(p0, q0, v);
    } else if (vv <= 0.0) {
        s = closest_parameter(q0, p0, u);
    } else if (det > 1e-12 * uu * vv) {
        s = clamp01((uv * vw - vv * uw) / det);
        t = (uv * s + vw) / vv;
        if (t < 0.0 || t > 1.0) {
            t = clamp01(t);
            s = clamp01((uv * t - uw) / uu);
        }
    } else {
        // Parallel to within a millionth of a radian: the middle of the second's shadow on the first.
        const double s0 = clamp01(-uw / uu), s1 = clamp01((uv - uw) / uu);
        s = 0.5 * (s0 + s1);
        t = closest_parameter(p0 + s * u, q0, v);
        s = closest_parameter(q0 + t * v, p0, u);
    }
    const Vec3 on_first = p0 + s * u, on_second = q0 + t * v;
    return {s, t, on_first, on_second, norm2(on_first - on_second)};
}

SegmentTrianglePair closest_segment_triangle(Vec3 p0, Vec3 p1, Vec3 a, Vec3 b, Vec3 c) {
    // Intersection: the ends on opposite sides of the plane, and the crossing point inside the triangle.
    const Vec3 normal = cross(b - a, c - a);
    const double side0 = dot(normal, p0 - a), side1 = dot(normal, p1 - a);
    if ((side0 < 0.0) != (side1 < 0.0) && side0 != side1) {
        const double t = side0 / (side0 - side1);
        const Vec3 point = p0 + t * (p1 - p0);
        if (dot(normal, cross(b - a, point - a)) >= 0.0 && dot(normal, cross(c - b, point - b)) >= 0.0 &&
            dot(normal, cross(a - c, point - c)) >= 0.0)
            return {t, point, point, 0.0};
    }
    SegmentTrianglePair best{0.0, p0, closest_on_triangle(p0, a, b, c).point, 0.0};
    best.distance2 = norm2(best.on_segment - best.on_triangle);
    const Vec3 other = closest_on_triangle(p1, a, b, c).point;
    if (norm2(p1 - other) < best.distance2) best = {1.0, p1, other, norm2(p1 - other)};
    const Vec3 corners[3] = {a, b, c};
    for (int k = 0; k < 3; ++k) {
        const SegmentPair pair = closest_of_segments(p0, p1, corners[k], corners[(k + 1) % 3]);
        if (pair.distance2 < best.distance2) best = {pair.s, pair.on_first, pair.on_second, pair.distance2};
    }
    return best;
}

} // namespace calot::geometry
