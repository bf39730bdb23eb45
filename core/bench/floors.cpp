#include "bench/floors.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace calot::bench {

namespace {

constexpr std::size_t b = 6, bb = b * b;

// Cholesky of a 6x6 in place, lower triangle.
void factor(double* a) {
    for (std::size_t j = 0; j < b; ++j) {
        for (std::size_t k = 0; k < j; ++k)
            for (std::size_t i = j; i < b; ++i)
                a[i * b + j] -= a[i * b + k] * a[j * b + k];
        const double s = 1 / std::sqrt(a[j * b + j]);
        for (std::size_t i = j; i < b; ++i)
            a[i * b + j] *= s;
    }
}
void forward(const double* l, double* x) {
    for (std::size_t i = 0; i < b; ++i) {
        for (std::size_t k = 0; k < i; ++k)
            x[i] -= l[i * b + k] * x[k];
        x[i] /= l[i * b + i];
    }
}
void backward(const double* l, double* x) {
    for (std::size_t i = b; i-- > 0;) {
        for (std::size_t k = i + 1; k < b; ++k)
            x[i] -= l[k * b + i] * x[k];
        x[i] /= l[i * b + i];
    }
}

} // namespace

BlockSolve::BlockSolve(int blocks) : n_(blocks) {
    const auto n = static_cast<std::size_t>(blocks);
    diagonal_.resize(n * bb), off_.resize(n * bb), right_.resize(n * b);
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t i = 0; i < b; ++i) {
            right_[k * b + i] = std::sin(static_cast<double>(k * b + i));
            for (std::size_t j = 0; j < b; ++j) {
                diagonal_[k * bb + i * b + j] = i == j ? 8.0 : 0.3;
                off_[k * bb + i * b + j] = -0.1 - 0.05 * static_cast<double>((3 * i + 5 * j + k) % 7);
            }
        }
    d_ = diagonal_, gain_ = off_, x_ = right_;
}

// off_[k] couples block k+1 (rows) to block k (columns). L D L^T with D's blocks as Cholesky factors.
double BlockSolve::run() {
    const auto n = static_cast<std::size_t>(n_);
    std::copy(diagonal_.begin(), diagonal_.end(), d_.begin());
    std::copy(right_.begin(), right_.end(), x_.begin());
    for (std::size_t k = 0; k < n; ++k) {
        double* d = &d_[k * bb];
        factor(d);
        forward(d, &x_[k * b]);
        if (k + 1 == n) break;
        // W = L^-1 O^T, kept by rows of O.
        double* w = &gain_[k * bb];
        std::copy_n(&off_[k * bb], bb, w);
        for (std::size_t r = 0; r < b; ++r)
            forward(d, w + r * b);
        double* next = &d_[(k + 1) * bb];
        for (std::size_t i = 0; i < b; ++i) {
            for (std::size_t j = 0; j <= i; ++j)
                for (std::size_t m = 0; m < b; ++m)
                    next[i * b + j] -= w[i * b + m] * w[j * b + m];
            for (std::size_t m = 0; m < b; ++m)
                x_[(k + 1) * b + i] -= w[i * b + m] * x_[k * b + m];
        }
    }
    for (std::size_t k = n; k-- > 0;) {
        if (k + 1 < n)
            for (std::size_t r = 0; r < b; ++r)
                for (std::size_t m = 0; m < b; ++m)
                    x_[k * b + m] -= gain_[k * bb + r * b + m] * x_[(k + 1) * b + r];
        backward(&d_[k * bb], &x_[k * b]);
    }
    return x_.back();
}

double BlockSolve::residual() const {
    const auto n = static_cast<std::size_t>(n_);
    double worst = 0;
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t i = 0; i < b; ++i) {
            double left = -right_[k * b + i];
            for (std::size_t j = 0; j < b; ++j) {
                left += diagonal_[k * bb + i * b + j] * x_[k * b + j];
                if (k > 0) left += off_[(k - 1) * bb + i * b + j] * x_[(k - 1) * b + j];
                if (k + 1 < n) left += off_[k * bb + j * b + i] * x_[(k + 1) * b + j];
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
