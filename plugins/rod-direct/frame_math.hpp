// What the rod needs of quaternions beyond the sdk's headers.
#pragma once

#include <calot/rod_math.hpp>

namespace calot::rod_direct {

// A rotation's matrix is taken in the form that is homogeneous in the quaternion: what lies in a coordinate
// plane stays in it to the last bit, which the form with 1 - 2 (x^2 + y^2) does not.

/// A frame's third axis, a segment's direction, in the world.
inline Vec3 axis_z(const Quat& q) {
    return {2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
            (q.w * q.w - q.y * q.y) + (q.z * q.z - q.x * q.x)};
}
inline Vec3 axis_x(const Quat& q) {
    return {(q.w * q.w - q.y * q.y) - (q.z * q.z - q.x * q.x), 2.0 * (q.x * q.y + q.w * q.z),
            2.0 * (q.x * q.z - q.w * q.y)};
}
inline Vec3 axis_y(const Quat& q) {
    return {2.0 * (q.x * q.y - q.w * q.z), (q.w * q.w - q.z * q.z) + (q.y * q.y - q.x * q.x),
            2.0 * (q.y * q.z + q.w * q.x)};
}
inline Vec3 in_world(const Quat& q, const Vec3& v) {
    return v.x * axis_x(q) + v.y * axis_y(q) + v.z * axis_z(q);
}
inline Vec3 in_frame(const Quat& q, const Vec3& v) {
    return {dot(v, axis_x(q)), dot(v, axis_y(q)), dot(v, axis_z(q))};
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
