// Three-vectors and unit quaternions: just what plugins need to handle poses. Header-only, no dependency.
#pragma once

#include <calot/abi/common.h>

#include <cmath>
#include <cstddef>

namespace calot {

struct Vec3 {
    double x = 0, y = 0, z = 0;

    double& operator[](std::size_t i) { return i == 0 ? x : i == 1 ? y : z; }
    double operator[](std::size_t i) const { return i == 0 ? x : i == 1 ? y : z; }
    Vec3& operator+=(const Vec3& b) { return x += b.x, y += b.y, z += b.z, *this; }
    Vec3& operator-=(const Vec3& b) { return x -= b.x, y -= b.y, z -= b.z, *this; }
    Vec3& operator*=(double s) { return x *= s, y *= s, z *= s, *this; }
    friend bool operator==(const Vec3&, const Vec3&) = default;
};

inline Vec3 operator+(Vec3 a, const Vec3& b) {
    return a += b;
}
inline Vec3 operator-(Vec3 a, const Vec3& b) {
    return a -= b;
}
inline Vec3 operator-(const Vec3& a) {
    return {-a.x, -a.y, -a.z};
}
inline Vec3 operator*(Vec3 a, double s) {
    return a *= s;
}
inline Vec3 operator*(double s, Vec3 a) {
    return a *= s;
}
inline Vec3 operator/(const Vec3& a, double s) {
    return {a.x / s, a.y / s, a.z / s};
}
inline double dot(const Vec3& a, const Vec3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3& a) {
    return std::sqrt(dot(a, a));
}
// The zero vector has no direction: `otherwise` is returned for it.
inline Vec3 normalized(const Vec3& a, const Vec3& otherwise = {0, 0, 1}) {
    const double length = norm(a);
    return length > 0 ? a / length : otherwise;
}
inline bool is_finite(const Vec3& a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

// Three consecutive scalars, as the contract carries points.
inline Vec3 vec3(const double* p) {
    return {p[0], p[1], p[2]};
}
inline void store(const Vec3& a, double* p) {
    p[0] = a.x, p[1] = a.y, p[2] = a.z;
}

// (w, x, y, z); a unit quaternion turns body coordinates into world coordinates.
struct Quat {
    double w = 1, x = 0, y = 0, z = 0;
    friend bool operator==(const Quat&, const Quat&) = default;
};

inline Quat operator*(const Quat& a, const Quat& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
inline Quat conjugate(const Quat& q) {
    return {q.w, -q.x, -q.y, -q.z};
}
inline double norm(const Quat& q) {
    return std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
}
// The zero quaternion becomes the identity.
inline Quat normalized(const Quat& q) {
    const double length = norm(q);
    return length > 0 ? Quat{q.w / length, q.x / length, q.y / length, q.z / length} : Quat{};
}
// v turned by the unit quaternion q: v + 2 u x (u x v + w v).
inline Vec3 rotate(const Quat& q, const Vec3& v) {
    const Vec3 u{q.x, q.y, q.z};
    return v + 2.0 * cross(u, cross(u, v) + q.w * v);
}
inline Vec3 rotate_back(const Quat& q, const Vec3& v) {
    return rotate(conjugate(q), v);
}
// Right-handed turn by `angle` (rad) about the unit vector `axis`.
inline Quat axis_angle(const Vec3& axis, double angle) {
    const double s = std::sin(0.5 * angle);
    return {std::cos(0.5 * angle), s * axis.x, s * axis.y, s * axis.z};
}
// The shortest turn that takes the unit vector a to the unit vector b.
inline Quat between(const Vec3& a, const Vec3& b) {
    const double c = dot(a, b);
    if (c < -1 + 1e-12) {
        const Vec3 any = std::abs(a.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
        const Vec3 axis = normalized(cross(a, any));
        return {0, axis.x, axis.y, axis.z};
    }
    const Vec3 axis = cross(a, b);
    return normalized(Quat{1 + c, axis.x, axis.y, axis.z});
}
inline Quat quat(const double* q) {
    return {q[0], q[1], q[2], q[3]};
}
inline void store(const Quat& a, double* q) {
    q[0] = a.w, q[1] = a.x, q[2] = a.y, q[3] = a.z;
}

inline calot_pose pose(const Vec3& position, const Quat& orientation) {
    return {{position.x, position.y, position.z},
            {orientation.w, orientation.x, orientation.y, orientation.z}};
}
inline Vec3 to_world(const calot_pose& p, const Vec3& body) {
    return vec3(p.position) + rotate(quat(p.quaternion), body);
}
inline Vec3 to_body(const calot_pose& p, const Vec3& world) {
    return rotate_back(quat(p.quaternion), world - vec3(p.position));
}

inline double clamp(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

} // namespace calot
