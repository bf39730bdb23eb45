#include "bench/block_solve.hpp"

#include "bench/random.hpp"

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace calot::bench {

namespace {

constexpr int blocks = 99, size = 6;

struct Block {
    double a[size][size];
};
struct Part {
    double a[size];
};

struct System {
    std::vector<Block> diagonal, upper; // upper[k] joins k and k + 1
    std::vector<Part> right;

    System() {
        Random random(11);
        for (int k = 0; k < blocks; ++k) {
            Block d, u;
            Part p;
            for (int r = 0; r < size; ++r) {
                p.a[r] = random.uniform(-1, 1);
                for (int c = 0; c < size; ++c)
                    u.a[r][c] = random.uniform(-1, 1), d.a[r][c] = 0;
                for (int c = 0; c <= r; ++c)
                    d.a[r][c] = d.a[c][r] = random.uniform(-1, 1);
                d.a[r][r] = 16;
            }
            diagonal.push_back(d), upper.push_back(u), right.push_back(p);
        }
    }
};

// x -= transposed(u) y, for a block's columns or one vector.
template<int columns>
void subtract(double (*x)[columns], const Block& u, const double (*y)[columns]) {
    for (int k = 0; k < size; ++k)
        for (int r = 0; r < size; ++r)
            for (int c = 0; c < columns; ++c)
                x[r][c] -= u.a[k][r] * y[k][c];
}

// Gaussian elimination without pivoting of [d | u p], diagonally dominant; u and p become d^-1 u and d^-1 p.
void eliminate(Block& d, Block& u, Part& p) {
    for (int i = 0; i < size; ++i) {
        const double inverse = 1 / d.a[i][i];
        for (int c = 0; c < size; ++c)
            u.a[i][c] *= inverse, d.a[i][c] *= inverse;
        p.a[i] *= inverse;
        for (int r = 0; r < size; ++r) {
            if (r == i) continue;
            const double f = d.a[r][i];
            for (int c = 0; c < size; ++c)
                u.a[r][c] -= f * u.a[i][c], d.a[r][c] -= f * d.a[i][c];
            p.a[r] -= f * p.a[i];
        }
    }
}

// S_k = D_k - U^T S^-1 U, forward; then back.
void solve(const System& s, const std::vector<Part>& right, std::vector<Block>& factor,
           std::vector<Part>& x) {
    for (std::size_t k = 0; k < blocks; ++k) {
        Block d = s.diagonal[k];
        factor[k] = s.upper[k];
        x[k] = right[k];
        if (k > 0) {
            subtract<size>(d.a, s.upper[k - 1], factor[k - 1].a);
            subtract<1>(reinterpret_cast<double(*)[1]>(x[k].a), s.upper[k - 1],
                        reinterpret_cast<const double(*)[1]>(x[k - 1].a));
        }
        eliminate(d, factor[k], x[k]);
    }
    for (std::size_t k = blocks - 1; k-- > 0;)
        for (int r = 0; r < size; ++r)
            for (int c = 0; c < size; ++c)
                x[k].a[r] -= factor[k].a[r][c] * x[k + 1].a[c];
}

} // namespace

double block_solve() {
    static const System system;
    static std::vector<Part> right = system.right, x(blocks);
    static std::vector<Block> factor(blocks);
    right[0].a[0] += 1e-3;
    solve(system, right, factor, x);
    constexpr std::size_t k = blocks / 2;
    for (int r = 0; r < size; ++r) {
        double left = -right[k].a[r];
        for (int c = 0; c < size; ++c)
            left += system.diagonal[k].a[r][c] * x[k].a[c] + system.upper[k].a[r][c] * x[k + 1].a[c] +
                    system.upper[k - 1].a[c][r] * x[k - 1].a[c];
        if (!(std::abs(left) < 1e-9)) throw std::runtime_error("the plain block solve is wrong");
    }
    return x[0].a[0];
}

double block_solve_microseconds() {
    static volatile double keep;
    const auto start = std::chrono::steady_clock::now();
    keep = block_solve();
    return 1e6 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

} // namespace calot::bench
