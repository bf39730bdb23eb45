// The LAPACK routine used, called by its Fortran name: no allocation, no threads.
#pragma once

namespace calot::rod_cosserat::lapack {

/// Gaussian elimination with partial pivoting of a tri-diagonal system (DGTSV). Overwrites all arguments, the
/// solution replaces `right`. False if the matrix is singular.
bool solve_tridiagonal(int n, double* lower, double* diagonal, double* upper, double* right);

} // namespace calot::rod_cosserat::lapack
