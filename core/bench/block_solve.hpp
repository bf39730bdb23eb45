#pragma once

namespace calot::bench {

/// One plain solve of a symmetric block-tridiagonal system of 99 blocks of 6 x 6 by block elimination,
/// fixed-size matrices, one thread: the yardstick for a step of a rod of 100 nodes. Every call solves another
/// right side, from the same blocks. Returns a component of the solution. Checks its own residual in a block:
/// throws std::runtime_error if that is not small.
double block_solve();
/// Wall time of one.
double block_solve_microseconds();

} // namespace calot::bench
