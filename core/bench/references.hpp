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
/// bisection); from alpha + beta = 360,000 on that of a long rod. The first branch, any loads; agrees with
/// Mattiasson (1981) to his five digits.
PlanarTip planar_tip(double alpha, double beta);

/// A rope with bending stiffness EI drawn over a drum of radius R (of its centreline), friction mu acting at
/// its centreline, held back by T: it leaves the drum before a rope without stiffness would, by psi with 1 -
/// cos psi = EI / (2 T R^2) on either side (the free rope's EI k^2 / 2 = T (1 - cos psi) meets the drum's k =
/// 1/R), and presses on the drum there with T sin psi; in between, at constant curvature, Euler's exp(mu
/// angle) holds.
struct StiffCapstan {
    double ratio = 1;           ///< of the tension it is drawn with to the one it is held back with
    double slack = 0, taut = 0; ///< rad, psi where it is held back and where it is drawn
    bool holds = false;         ///< it lies on the drum between the two
};
/// `stiffness`: EI / (T R^2).
StiffCapstan stiff_capstan(double mu, double angle, double stiffness);

} // namespace calot::bench
