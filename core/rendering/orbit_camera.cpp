#include "rendering/orbit_camera.hpp"

#include "rendering/linear.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rendering {
namespace {
constexpr double kNearest = 0.05, kFarthest = 3; // m
constexpr double kSteepest = 1.5;                // rad
} // namespace

OrbitCamera::OrbitCamera(const Vec3& target, double distance, double azimuth, double elevation)
    : target_(target), distance_(std::clamp(distance, kNearest, kFarthest)), azimuth_(azimuth),
      elevation_(std::clamp(elevation, -kSteepest, kSteepest)) {}

void OrbitCamera::turn(double azimuth, double elevation) {
    azimuth_ = std::remainder(azimuth_ + azimuth, 2 * EIGEN_PI);
    elevation_ = std::clamp(elevation_ + elevation, -kSteepest, kSteepest);
}

void OrbitCamera::zoom(double factor) {
    distance_ = std::clamp(distance_ * factor, kNearest, kFarthest);
}

void OrbitCamera::shift(double left, double up) {
    const Eigen::Matrix3d axes = to_matrix(pose().rotation);
    target_ = to_plain(to_eigen(target_) + left * axes.col(0) + up * axes.col(1));
}

void OrbitCamera::frame(const Vec3& centre, double radius, double vertical_field) {
    target_ = centre;
    distance_ = std::clamp(radius / std::sin(std::clamp(vertical_field, 0.1, 2.5) / 2), kNearest, kFarthest);
}

Pose OrbitCamera::pose() const {
    const double c = std::cos(elevation_);
    const Eigen::Vector3d from(c * std::sin(azimuth_), -c * std::cos(azimuth_), std::sin(elevation_));
    return look_at(to_plain(to_eigen(target_) + distance_ * from), target_, {0, 0, 1});
}

} // namespace calot::rendering
