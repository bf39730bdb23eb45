// The three LAPACK routines used, called by their Fortran names: no allocation, no threads.
#pragma once

namespace calot::rod_cosserat::lapack {

/// Gaussian elimination with partial pivoting of a tri-diagonal system (DGTSV). Overwrites all arguments, the
/// solution replaces `right`. False if the matrix is singular.
bool solve_tridiagonal(int n, double* lower, double* diagonal, double* upper, double* right);

/// L D L^T of a symmetric positive definite tri-diagonal matrix (DPTTRF), in place. False if it is not
/// definite.
bool factor_symmetric(int n, double* diagonal, double* off_diagonal);

/// Solves with that factorisation (DPTTRS).
void solve_symmetric(int n, const double* diagonal, const double* off_diagonal, double* right);

} // namespace calot::rod_cosserat::lapack
