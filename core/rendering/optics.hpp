// The endoscope's optics: an equidistant fisheye with the polynomial of Kannala & Brandt (IEEE TPAMI 2006,
// 28:1335, eq. 6): r = f (theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9).
#pragma once

#include <array>

namespace calot::rendering {

struct Optics {
    double field_of_view = 2.44346; // rad across the mask's farthest corners: 140 degrees
    std::array<double, 4> k{0, 0, 0, 0};
    double light_exponent = 1.6;  // n of the headlight's cos^n(theta)
    double light_offset = 0.0032; // of each of the two light guides from the lens, along the tip's x, m
    double near = 0.0008;         // nearest distance drawn, m
    double far = 0.8;             // farthest, m
};

/// r / f for a ray at angle theta from the axis.
double fisheye_radius(const Optics&, double theta);

/// The angle whose radius is `radius` (bisection; radius in units of f). Radii past the field give its edge.
double fisheye_angle(const Optics&, double radius);

/// Throws std::invalid_argument, naming the field, for optics that no picture can be drawn with: a field
/// outside 10..200 degrees, a radius that does not grow with the angle, distances out of order.
void check(const Optics&);

/// Half the side of the square that holds the mask, in units of f: the mask is an octagon whose corners
/// lie at half the field of view.
double mask_half_side(const Optics&);

/// Corner of the mask's octagon: at (1, kMaskCorner) of the half side, and its mirror images.
inline constexpr double kMaskCorner = 0.62;

/// Where a point given in the tip's frame (x left, y up, z forward) appears: x to the right and y down,
/// both -1..1 across the mask's square. False if it lies outside the drawn cone.
bool project(const Optics&, const std::array<double, 3>& local, double& x, double& y);

} // namespace calot::rendering
