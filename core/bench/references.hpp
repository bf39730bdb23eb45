#pragma once

namespace calot::bench {

/// Tip of a clamped, initially horizontal inextensible rod of unit length.
struct PlanarTip {
    double drop = 0;       ///< across
    double shortening = 0; ///< 1 - along
    double angle = 0;      ///< rad
};

/// Under a dead tip load, alpha = P L^2 / EI, and its own weight, beta = w L^3 / EI: theta'' = -(alpha + beta
/// (1 - s)) cos theta, theta(0) = 0, theta'(1) = 0, by shooting from the tip (Runge-Kutta of fourth order,
/// bisection). The first branch, any loads from 0 to some 10^5; agrees with Mattiasson (1981) to his five
/// digits.
PlanarTip planar_tip(double alpha, double beta);

} // namespace calot::bench
