// What the rod needs of quaternions beyond calot/math.hpp.
#pragma once

#include <calot/math.hpp>

namespace calot::rod_direct {

/// A frame's third axis, a segment's direction, in the world.
inline Vec3 third_axis(const Quat& q) {
    return {2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
            1.0 - 2.0 * (q.x * q.x + q.y * q.y)};
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

/// The measure of a unit quaternion's turn, the short way round.
inline Vec3 turn_vector(const Quat& q) {
    const double sign = q.w < 0.0 ? -1.0 : 1.0, s = 2.0 * sign * turn_factor(sign * q.w);
    return {s * q.x, s * q.y, s * q.z};
}

/// A turn by the rotation vector v; the angle is 2 atan(|v| / 2), equal to |v| to third order.
inline Quat turned_by(const Vec3& v) {
    return normalized(Quat{1.0, 0.5 * v.x, 0.5 * v.y, 0.5 * v.z});
}

} // namespace calot::rod_direct
