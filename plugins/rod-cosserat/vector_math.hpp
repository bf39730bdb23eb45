// Three-vectors and unit quaternions, just what the rod needs outside its vectorised loops.
#pragma once

#include <cmath>

namespace calot::rod_cosserat {

struct Vec3 {
    double x = 0.0, y = 0.0, z = 0.0;
};

inline Vec3 operator+(Vec3 a, Vec3 b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator-(Vec3 a) {
    return {-a.x, -a.y, -a.z};
}
inline Vec3 operator*(double s, Vec3 a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline Vec3& operator+=(Vec3& a, Vec3 b) {
    return a = a + b;
}
inline double dot(Vec3 a, Vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(Vec3 a, Vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(Vec3 a) {
    return std::sqrt(dot(a, a));
}
inline bool finite(Vec3 a) {
    return std::isfinite(a.x + a.y + a.z);
}

/// Hamilton's quaternion (w, x, y, z); a unit one turns material into world coordinates.
struct Quat {
    double w = 1.0, x = 0.0, y = 0.0, z = 0.0;
};

inline Quat operator*(Quat a, Quat b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
inline Quat conj(Quat q) {
    return {q.w, -q.x, -q.y, -q.z};
}
inline Quat normalized(Quat q) {
    const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {q.w / n, q.x / n, q.y / n, q.z / n};
}
inline Vec3 rotate(Quat q, Vec3 v) {
    const Vec3 i{q.x, q.y, q.z};
    const Vec3 t = 2.0 * cross(i, v);
    return v + q.w * t + cross(i, t);
}
inline Vec3 third_axis(Quat q) {
    return {2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
            1.0 - 2.0 * (q.x * q.x + q.y * q.y)};
}
/// The smallest turn that carries unit vector a onto unit vector b; a half turn about any normal if they
/// oppose.
inline Quat turn_between(Vec3 a, Vec3 b) {
    const double c = dot(a, b);
    if (c > -0.999999) {
        const Vec3 s = cross(a, b);
        return normalized({1.0 + c, s.x, s.y, s.z});
    }
    const Vec3 n = std::fabs(a.x) < 0.6 ? cross(a, {1, 0, 0}) : cross(a, {0, 1, 0});
    return normalized({0.0, n.x, n.y, n.z});
}
/// Normalised linear interpolation, the short way round.
inline Quat blend(Quat a, Quat b, double s) {
    const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0.0 ? -1.0 : 1.0;
    const double t = sign * s, r = 1.0 - s;
    return normalized({r * a.w + t * b.w, r * a.x + t * b.x, r * a.y + t * b.y, r * a.z + t * b.z});
}

} // namespace calot::rod_cosserat
