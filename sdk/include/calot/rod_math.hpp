// What rod models need of quaternions beyond math.hpp.
#pragma once

#include <calot/math.hpp>

#include <algorithm>
#include <cmath>

namespace calot {

/// A frame's third axis, a segment's direction, in the world.
inline Vec3 third_axis(const Quat& q) {
    return {2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
            1.0 - 2.0 * (q.x * q.x + q.y * q.y)};
}

/// Normalised linear interpolation, the short way round: a at s = 0, b at s = 1.
inline Quat blend(const Quat& a, const Quat& b, double s) {
    const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0.0 ? -1.0 : 1.0;
    const double t = sign * s, r = 1.0 - s;
    return normalized(Quat{r * a.w + t * b.w, r * a.x + t * b.x, r * a.y + t * b.y, r * a.z + t * b.z});
}

/// Turn from frame a to frame b as the vector part of conjugate(a) b, with a scalar part that is not
/// negative.
inline Quat short_turn(const Quat& a, const Quat& b) {
    const Quat p = conjugate(a) * b;
    return p.w < 0.0 ? Quat{-p.w, -p.x, -p.y, -p.z} : p;
}

/// A turn by phi is measured as 4 sin(phi / 4): twice the quaternion's imaginary part times this factor of
/// its real part w. The moment that goes with it, EI/c 2 sin(phi / 2), is weaker than EI/c phi by phi^2 / 24;
/// of the measures tried, with chords for arcs, it leaves the least error of second order at large loads.
inline double turn_factor(double w) {
    return std::sqrt(2.0 / (1.0 + w));
}
/// Its derivative, given the factor.
inline double turn_factor_slope(double w, double factor) {
    return -0.5 * factor / (1.0 + w);
}
/// The turn of which half the measure is v.
inline Quat turn_of_measure(const Vec3& v) {
    const double square = std::min(dot(v, v), 2.0), s = std::sqrt(1.0 - 0.25 * square);
    return normalized(Quat{1.0 - 0.5 * square, s * v.x, s * v.y, s * v.z});
}

/// The turn whose vector part is v: unit where |v| <= 1.
inline Quat turn_of(const Vec3& v) {
    const double s = norm(v);
    if (s >= 1.0) return {0.0, v.x / s, v.y / s, v.z / s};
    return {std::sqrt(1.0 - s * s), v.x, v.y, v.z};
}

} // namespace calot
