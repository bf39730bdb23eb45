#include "rendering/linear.hpp"
#include "rendering/types.hpp"

namespace calot::rendering {

Pose look_at(const Vec3& eye, const Vec3& target, const Vec3& up) {
    Eigen::Vector3d forward = to_eigen(target) - to_eigen(eye);
    forward = forward.norm() > 0 ? Eigen::Vector3d(forward.normalized()) : Eigen::Vector3d::UnitZ();
    Eigen::Vector3d left = to_eigen(up).cross(forward);
    left = left.norm() > 1e-9 ? Eigen::Vector3d(left.normalized()) : perpendicular(forward);
    Eigen::Matrix3d axes;
    axes << left, forward.cross(left), forward;
    return {eye, to_plain(Eigen::Quaterniond(axes))};
}

} // namespace calot::rendering
