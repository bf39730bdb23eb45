#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace calot::mesher {

/// A point or direction in the project frame of the descriptions: x left, y cranial, z anterior, in
/// millimetres.
struct Vec {
    double x = 0, y = 0, z = 0;
};

inline Vec operator+(Vec a, Vec b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec operator-(Vec a, Vec b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec operator*(double s, Vec a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline double dot(Vec a, Vec b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec cross(Vec a, Vec b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec a) {
    return std::sqrt(dot(a, a));
}
/// The unit vector along a; x for zero.
inline Vec normalised(Vec a) {
    const double n = norm(a);
    return n > 0 ? (1 / n) * a : Vec{1, 0, 0};
}

/// 0 below `from`, 1 above `to`, smooth between (Hermite).
inline double smooth_step(double from, double to, double v) {
    const double t = std::clamp((v - from) / (to - from), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

struct Box {
    Vec low{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity()};
    Vec high{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
             std::numeric_limits<double>::infinity()};

    static Box around(Vec centre, Vec half) { return {centre - half, centre + half}; }
    Box grown(double by) const { return {low - Vec{by, by, by}, high + Vec{by, by, by}}; }
    Box united(const Box& o) const {
        return {{std::min(low.x, o.low.x), std::min(low.y, o.low.y), std::min(low.z, o.low.z)},
                {std::max(high.x, o.high.x), std::max(high.y, o.high.y), std::max(high.z, o.high.z)}};
    }
    Box common(const Box& o) const {
        return {{std::max(low.x, o.low.x), std::max(low.y, o.low.y), std::max(low.z, o.low.z)},
                {std::min(high.x, o.high.x), std::min(high.y, o.high.y), std::min(high.z, o.high.z)}};
    }
    bool bounded() const {
        return std::isfinite(low.x + low.y + low.z + high.x + high.y + high.z) && low.x <= high.x &&
               low.y <= high.y && low.z <= high.z;
    }
    double distance(Vec p) const {
        const Vec out{std::max({low.x - p.x, 0.0, p.x - high.x}), std::max({low.y - p.y, 0.0, p.y - high.y}),
                      std::max({low.z - p.z, 0.0, p.z - high.z})};
        return norm(out);
    }
};

/// A rotation, as the images of the axes.
struct Rotation {
    Vec x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

    /// Turns about x, then y, then z, in degrees.
    static Rotation of_degrees(Vec degrees) {
        constexpr double rad = 3.14159265358979323846 / 180;
        const double cx = std::cos(degrees.x * rad), sx = std::sin(degrees.x * rad);
        const double cy = std::cos(degrees.y * rad), sy = std::sin(degrees.y * rad);
        const double cz = std::cos(degrees.z * rad), sz = std::sin(degrees.z * rad);
        const auto turn = [&](Vec v) {
            v = {v.x, cx * v.y - sx * v.z, sx * v.y + cx * v.z};
            v = {cy * v.x + sy * v.z, v.y, cy * v.z - sy * v.x};
            return Vec{cz * v.x - sz * v.y, sz * v.x + cz * v.y, v.z};
        };
        return {turn({1, 0, 0}), turn({0, 1, 0}), turn({0, 0, 1})};
    }
    Vec to_world(Vec p) const { return p.x * x + p.y * y + p.z * z; }
    Vec to_local(Vec p) const { return {dot(p, x), dot(p, y), dot(p, z)}; }
    /// Half extents of the world box around a local box of half extents h.
    Vec half_extents(Vec h) const {
        return {std::abs(x.x) * h.x + std::abs(y.x) * h.y + std::abs(z.x) * h.z,
                std::abs(x.y) * h.x + std::abs(y.y) * h.y + std::abs(z.y) * h.z,
                std::abs(x.z) * h.x + std::abs(y.z) * h.y + std::abs(z.z) * h.z};
    }
};

} // namespace calot::mesher
