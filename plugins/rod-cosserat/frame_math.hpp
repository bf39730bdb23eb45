// What the rod needs of quaternions beyond calot/math.hpp.
#pragma once

#include <calot/math.hpp>

namespace calot::rod_cosserat {

/// A frame's third axis, a segment's direction, in the world.
inline Vec3 third_axis(const Quat& q) {
    return {2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x),
            1.0 - 2.0 * (q.x * q.x + q.y * q.y)};
}

/// Normalised linear interpolation, the short way round.
inline Quat blend(const Quat& a, const Quat& b, double s) {
    const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0.0 ? -1.0 : 1.0;
    const double t = sign * s, r = 1.0 - s;
    return normalized(Quat{r * a.w + t * b.w, r * a.x + t * b.x, r * a.y + t * b.y, r * a.z + t * b.z});
}

} // namespace calot::rod_cosserat
