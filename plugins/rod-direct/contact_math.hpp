// Between the sdk's vectors and those of lanes.hpp.
#pragma once

#include "lanes.hpp"

#include <calot/math.hpp>

namespace calot::rod_direct {

inline Vec<double> vec(const Vec3& a) {
    return {a.x, a.y, a.z};
}
inline Vec3 vec3(const Vec<double>& a) {
    return {a.x, a.y, a.z};
}
inline Vec3 times(const Sym<double>& s, const Vec3& a) {
    return vec3(rod_direct::times(s, vec(a)));
}
/// Adds k n n^T.
inline void add_outer(Sym<double>& s, double k, const Vec3& n) {
    s.xx += k * n.x * n.x, s.xy += k * n.x * n.y, s.xz += k * n.x * n.z;
    s.yy += k * n.y * n.y, s.yz += k * n.y * n.z, s.zz += k * n.z * n.z;
}

} // namespace calot::rod_direct
