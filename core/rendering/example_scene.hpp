// Simple shapes that stand for organs, for the picture test and the timing program.
#pragma once

#include "rendering/types.hpp"

#include <functional>

namespace calot::rendering {

/// A surface of revolution around a curve, as a grid of `around` x `along` quads, closed at both ends when
/// the radius shrinks to zero there. Normals point outward. \param axis   centreline for t in 0..1 \param
/// radius for (t, angle), m
Surface swept_surface(const std::string& name, const std::function<Vec3(double)>& axis,
                      const std::function<double(double, double)>& radius, int along, int around);

Surface ball(const std::string& name, const Vec3& centre, double radius, int rings);

struct ExampleScene {
    std::vector<Surface> surfaces; // gullet and stomach in one, liver, gallbladder, in the world frame
    FrameState frame;              // the endoscope in the stomach, looking at a ring on its anterior wall
};

/// About `triangles` in all.
ExampleScene make_example_scene(int triangles);

} // namespace calot::rendering
