// What no rod can be faster than: the bare arithmetic, timed beside the models as a unit that travels between
// machines.
#pragma once

#include <vector>

namespace calot::bench {

/// A block-tridiagonal system of 6x6 blocks, symmetric and definite, eliminated from one end: the unit in
/// which rods are bounded. Plain loops; each run solves the same system afresh.
class BlockSolve {
  public:
    explicit BlockSolve(int blocks);
    /// Factors and solves; returns a component of the solution.
    double run();
    /// Largest component of what is left of the right-hand side.
    double residual() const;

  private:
    int n_;
    std::vector<double> diagonal_, off_, right_, d_, gain_, x_;
};

/// A tridiagonal system of n unknowns by Thomas' algorithm; returns its last unknown.
double tridiagonal_run(int n);
/// One explicit step of n points and frames without any stiffness: positions, velocities and quaternions move
/// on.
double explicit_step_run(int n);

} // namespace calot::bench
