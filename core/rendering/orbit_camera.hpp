// The external view's camera as a hand moves it: around a point, nearer, farther, aside.
#pragma once

#include "rendering/types.hpp"

namespace calot::rendering {

class OrbitCamera {
  public:
    /// Looks at `target` from `distance`; azimuth 0 is from the patient's front, positive from the left side;
    /// elevation positive from above the head. Radians.
    OrbitCamera(const Vec3& target = {0.02, -0.03, 0.06}, double distance = 0.75, double azimuth = 0.25,
                double elevation = 0.15);

    void turn(double azimuth, double elevation); // elevation stops short of the poles
    void zoom(double factor);                    // of the distance, which stays within 0.05..3 m
    void shift(double left, double up);          // of the target, m along the screen

    /// Places the camera so that a ball of this radius fills the view.
    void frame(const Vec3& centre, double radius, double vertical_field);

    Pose pose() const;
    double distance() const { return distance_; }
    const Vec3& target() const { return target_; }

  private:
    Vec3 target_;
    double distance_, azimuth_, elevation_;
};

} // namespace calot::rendering
