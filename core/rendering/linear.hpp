// The little linear algebra between plain poses and OpenGL.
#pragma once

#include "rendering/types.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace calot::rendering {

inline Eigen::Vector3d to_eigen(const Vec3& v) {
    return {v[0], v[1], v[2]};
}
inline Vec3 to_plain(const Eigen::Vector3d& v) {
    return {v.x(), v.y(), v.z()};
}
inline Eigen::Matrix3d to_matrix(const Quat& q) {
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}
inline Quat to_plain(const Eigen::Quaterniond& q) {
    return {q.w(), q.x(), q.y(), q.z()};
}

/// Any unit vector perpendicular to v.
inline Eigen::Vector3d perpendicular(const Eigen::Vector3d& v) {
    const Eigen::Vector3d other =
        std::abs(v.x()) < 0.6 * v.norm() ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    return v.cross(other).normalized();
}

} // namespace calot::rendering
