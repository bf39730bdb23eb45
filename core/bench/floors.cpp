#include "bench/floors.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace calot::bench {

namespace {

// Rows of eight: two vector registers, of which six numbers count.
constexpr std::size_t b = 6, row = 8, block = b * row;

// Cholesky of a 6x6 in place, lower triangle; the diagonal becomes its inverse.
inline void factor(double* a) {
    for (std::size_t j = 0; j < b; ++j) {
        const double s = 1 / std::sqrt(a[j * row + j]);
        a[j * row + j] = s;
        for (std::size_t i = j + 1; i < b; ++i)
            a[i * row + j] *= s;
        for (std::size_t i = j + 1; i < b; ++i)
            for (std::size_t k = j + 1; k <= i; ++k)
                a[i * row + k] -= a[i * row + j] * a[k * row + j];
    }
}

} // namespace

BlockSolve::BlockSolve(int blocks) : n_(blocks) {
    const auto n = static_cast<std::size_t>(blocks);
    diagonal_.assign(n * block, 0.0), off_.assign(n * block, 0.0), right_.assign(n * row, 0.0);
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t i = 0; i < b; ++i) {
            right_[k * row + i] = std::sin(static_cast<double>(k * b + i));
            for (std::size_t j = 0; j < b; ++j) {
                diagonal_[k * block + i * row + j] = i == j ? 8.0 : 0.3;
                off_[k * block + i * row + j] = -0.1 - 0.05 * static_cast<double>((3 * i + 5 * j + k) % 7);
            }
        }
    d_ = diagonal_, gain_ = off_, x_ = right_;
}

// Block k+1 is coupled to block k by the transpose of off_[k]. Cholesky: L_k L_k^T = D_k - W^T W, W =
// L_(k-1)^-1 off.
double BlockSolve::run() {
    const auto n = static_cast<std::size_t>(n_);
    std::copy(diagonal_.begin(), diagonal_.end(), d_.begin());
    std::copy(right_.begin(), right_.end(), x_.begin());
    std::copy(off_.begin(), off_.end(), gain_.begin());
    for (std::size_t k = 0; k < n; ++k) {
        double *d = &d_[k * block], *w = &gain_[k * block], *x = &x_[k * row];
        factor(d);
        for (std::size_t i = 0; i < b; ++i) {
            for (std::size_t m = 0; m < i; ++m) {
                const double l = d[i * row + m];
                x[i] -= l * x[m];
                for (std::size_t c = 0; c < row; ++c)
                    w[i * row + c] -= l * w[m * row + c];
            }
            const double s = d[i * row + i];
            x[i] *= s;
            for (std::size_t c = 0; c < row; ++c)
                w[i * row + c] *= s;
        }
        if (k + 1 == n) break;
        double *next = d + block, *below = x + row;
        for (std::size_t i = 0; i < b; ++i)
            for (std::size_t m = 0; m < b; ++m) {
                const double l = w[m * row + i];
                below[i] -= l * x[m];
                for (std::size_t c = 0; c < row; ++c)
                    next[i * row + c] -= l * w[m * row + c];
            }
    }
    for (std::size_t k = n; k-- > 0;) {
        const double *d = &d_[k * block], *w = &gain_[k * block];
        double* x = &x_[k * row];
        if (k + 1 < n)
            for (std::size_t m = 0; m < b; ++m)
                for (std::size_t c = 0; c < b; ++c)
                    x[m] -= w[m * row + c] * x[row + c];
        for (std::size_t i = b; i-- > 0;) {
            for (std::size_t m = i + 1; m < b; ++m)
                x[i] -= d[m * row + i] * x[m];
            x[i] *= d[i * row + i];
        }
    }
    return x_[(n - 1) * row];
}

double BlockSolve::residual() const {
    const auto n = static_cast<std::size_t>(n_);
    double worst = 0;
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t i = 0; i < b; ++i) {
            double left = -right_[k * row + i];
            for (std::size_t j = 0; j < b; ++j) {
                left += diagonal_[k * block + i * row + j] * x_[k * row + j];
                if (k > 0) left += off_[(k - 1) * block + j * row + i] * x_[(k - 1) * row + j];
                if (k + 1 < n) left += off_[k * block + i * row + j] * x_[(k + 1) * row + j];
            }
            worst = std::max(worst, std::abs(left));
        }
    return worst;
}

double tridiagonal_run(int count) {
    static thread_local std::vector<double> gain, x;
    const auto n = static_cast<std::size_t>(count);
    gain.resize(n), x.resize(n);
    double d = 4;
    gain[0] = -1 / d, x[0] = 1 / d;
    for (std::size_t k = 1; k < n; ++k) {
        d = 1 / (4 + gain[k - 1]);
        gain[k] = -d, x[k] = (1 + x[k - 1]) * d;
    }
    for (std::size_t k = n - 1; k-- > 0;)
        x[k] -= gain[k] * x[k + 1];
    return x[0];
}

double explicit_step_run(int count) {
    struct Point {
        double x[3], v[3], q[4], w[3];
    };
    static thread_local std::vector<Point> points;
    const auto n = static_cast<std::size_t>(count);
    if (points.size() != n) points.assign(n, {{0, 0, 0}, {0.1, 0.2, 0.3}, {1, 0, 0, 0}, {0.3, 0.2, 0.1}});
    constexpr double h = 1e-5;
    for (Point& p : points) {
        for (int c = 0; c < 3; ++c)
            p.v[c] -= h * p.x[c], p.x[c] += h * p.v[c];
        const double a = 0.5 * h * p.w[0], e = 0.5 * h * p.w[1], c = 0.5 * h * p.w[2];
        const double q[4] = {
            p.q[0] - p.q[1] * a - p.q[2] * e - p.q[3] * c, p.q[1] + p.q[0] * a + p.q[2] * c - p.q[3] * e,
            p.q[2] + p.q[0] * e + p.q[3] * a - p.q[1] * c, p.q[3] + p.q[0] * c + p.q[1] * e - p.q[2] * a};
        const double s = 1 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int k = 0; k < 4; ++k)
            p.q[k] = s * q[k];
    }
    return points[n / 2].x[0] + points[n / 2].q[1];
}

} // namespace calot::bench
