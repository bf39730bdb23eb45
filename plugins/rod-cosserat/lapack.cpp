#include "lapack.hpp"

extern "C" {
void dgtsv_(const int* n, const int* nrhs, double* dl, double* d, double* du, double* b, const int* ldb,
            int* info);

// LAPACK's handler of illegal arguments prints through the Fortran library and ends the program. Arguments
// here are sizes checked at construction; with this definition the archive needs no Fortran library.
void xerbla_(const char*, const int*, unsigned long) {}
}

namespace calot::rod_cosserat::lapack {

bool solve_tridiagonal(int n, double* lower, double* diagonal, double* upper, double* right) {
    const int one = 1;
    int info = 0;
    dgtsv_(&n, &one, lower, diagonal, upper, right, &n, &info);
    return info == 0;
}

} // namespace calot::rod_cosserat::lapack
