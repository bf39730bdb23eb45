// A beam on two knife edges, pressed down half-way between them.
#pragma once

namespace calot::fitting {

/// Beyond this share of the span the load hardly grows any more (it is greatest at 0.25, where the beam slips
/// through), so that nothing can be read off it.
constexpr double largest_deflection = 0.2;

/// F span^2 / EI that presses the middle down by `deflection` (a share of the span, up to
/// largest_deflection either way): 48 times it while it is small. Supports without friction, so that they
/// push at right angles to the beam, which slides over them; their distance stays. Exact for an inextensible
/// beam: with the slope t at the supports, J = integral of sqrt(sin) from 0 to t, X = 2 sqrt(sin t) cos t + J
/// sin t, Y = 2 sqrt(sin t) sin t - J cos t: deflection = Y / 2X, load = 4 X^2 cos t (Conway, Phil. Mag. 38
/// (1947) 905, in another notation). Throws std::invalid_argument beyond.
double three_point_load(double deflection);

} // namespace calot::fitting
