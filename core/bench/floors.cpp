#include "bench/floors.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

namespace calot::bench {

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
