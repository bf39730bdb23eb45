// What no rod can be faster than: the bare arithmetic, timed beside the models as a unit that travels between
// machines.
#pragma once

namespace calot::bench {

/// A tridiagonal system of n unknowns by Thomas' algorithm; returns its first unknown.
double tridiagonal_run(int n);
/// One explicit step of n points and frames without any stiffness: positions, velocities and quaternions move
/// on.
double explicit_step_run(int n);

} // namespace calot::bench
