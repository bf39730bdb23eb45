// The direct solver against a dense one.
#include "chain_solver.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <random>

namespace calot::rod_direct {
namespace {

using Matrix = Eigen::MatrixXd;
using Matrix3 = Eigen::Matrix3d;
using Vector = Eigen::VectorXd;

Matrix3 cross_matrix(const Eigen::Vector3d& c) {
    Matrix3 m;
    m << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
    return m;
}

// A random chain, its full blocks where `is_full` says so, in the solver and as one dense matrix.
struct Chain {
    std::mt19937 random{7};
    ChainSolver solver;
    Matrix dense;
    Vector right;

    double any() { return std::uniform_real_distribution<double>(-1, 1)(random); }
    Matrix3 positive(double least) {
        Matrix3 a;
        for (int i = 0; i < 9; ++i)
            a(i) = any();
        return a * a.transpose() + least * Matrix3::Identity();
    }
    static void put(std::vector<double>* to, std::size_t at, const Matrix3& m) {
        int k = 0;
        for (int r = 0; r < 3; ++r)
            for (int c = r; c < 3; ++c)
                to[k++][at] = m(r, c);
    }

    Chain(int m, auto is_full) : solver(m) {
        dense = Matrix::Zero(6 * m, 6 * m);
        right = Vector::Zero(6 * m);
        std::vector<Matrix3> node(static_cast<std::size_t>(m) + 1);
        for (int i = 0; i <= m; ++i) {
            const auto at = static_cast<std::size_t>(i);
            const bool full = (i > 0 && is_full(i - 1)) && (i < m && is_full(i));
            solver.w[at] = 0.6 + 0.5 * any();
            node[at] = full ? positive(0.1) : Matrix3(solver.w[at] * Matrix3::Identity());
            put(solver.full_w, at, node[at]);
        }
        std::vector<Matrix3> joint(static_cast<std::size_t>(m) + 1, Matrix3::Zero());
        for (int i = 1; i < m; ++i) {
            const auto at = static_cast<std::size_t>(i);
            const Matrix3 k = positive(0.2);
            Eigen::Vector3d c(0.1 * any(), 0.1 * any(), 0.1 * any());
            put(solver.k, at, k);
            for (int r = 0; r < 3; ++r)
                solver.c[r][at] = c(r);
            joint[at] = k;
            dense.block<3, 3>(6 * (i - 1), 6 * i) = -(k - cross_matrix(c));
            dense.block<3, 3>(6 * i, 6 * (i - 1)) = -(k - cross_matrix(c)).transpose();
            dense.block<3, 3>(6 * (i - 1) + 3, 6 * i + 3) = node[at];
            dense.block<3, 3>(6 * i + 3, 6 * (i - 1) + 3) = node[at];
        }
        for (int j = 0; j < m; ++j) {
            const auto at = static_cast<std::size_t>(j);
            const Matrix3 h = joint[at] + joint[at + 1] + positive(0.3);
            const Eigen::Vector3d arm(any(), any(), any());
            Matrix3 e = -cross_matrix(arm), v = node[at] + node[at + 1] + 0.01 * Matrix3::Identity();
            put(solver.h, at, h);
            solver.soft[at] = 0.01;
            solver.plain[at] = is_full(j) ? 0 : 1;
            for (int r = 0; r < 3; ++r)
                solver.arm[r][at] = arm(r);
            if (is_full(j)) {
                const int neighbour = j <= solver.middle() ? j - 1 : j + 1;
                for (int k = 0; k < 9; ++k)
                    e(k / 3, k % 3) += 0.1 * any();
                for (int k = 0; k < 9; ++k) {
                    solver.e[k][at] = e(k / 3, k % 3);
                    const double z = 0.2 * any();
                    solver.z[k][at] = z;
                    if (neighbour < 0 || neighbour >= m) continue;
                    dense(6 * neighbour + 3 + k / 3, 6 * j + k % 3) += z;
                    dense(6 * j + k % 3, 6 * neighbour + 3 + k / 3) += z;
                }
                put(solver.v, at, v);
            }
            dense.block<3, 3>(6 * j, 6 * j) = h;
            dense.block<3, 3>(6 * j, 6 * j + 3) = e;
            dense.block<3, 3>(6 * j + 3, 6 * j) = e.transpose();
            dense.block<3, 3>(6 * j + 3, 6 * j + 3) = -v;
            for (int r = 0; r < 3; ++r) {
                right(6 * j + r) = solver.g[r][at] = any();
                right(6 * j + 3 + r) = solver.r[r][at] = any();
            }
        }
    }

    void agrees(const std::string& what) {
        ASSERT_TRUE(solver.solve()) << what;
        const Vector expected = dense.partialPivLu().solve(right);
        double worst = 0;
        for (int j = 0; j < solver.segments(); ++j)
            for (int r = 0; r < 3; ++r) {
                const auto at = static_cast<std::size_t>(j);
                worst = std::max({worst, std::abs(solver.a[r][at] - expected(6 * j + r)),
                                  std::abs(solver.n[r][at] - expected(6 * j + 3 + r))});
            }
        EXPECT_LT(worst, 1e-9 * (1 + expected.cwiseAbs().maxCoeff())) << what << ": off by " << worst;
    }
};

TEST(ChainSolver, solves_plain_chains_of_any_length_as_a_dense_solver_does) {
    for (int m : {2, 3, 4, 5, 6, 9, 24, 51})
        Chain(m, [](int) { return false; }).agrees(std::to_string(m) + " segments");
}

TEST(ChainSolver, solves_chains_with_full_blocks_anywhere) {
    for (int m : {2, 3, 4, 5, 6, 7, 12, 23}) {
        Chain(m, [](int) { return true; }).agrees(std::to_string(m) + " full");
        for (int at = 0; at + 1 < m; ++at)
            Chain(m, [&](int j) {
                return j == at || j == at + 1;
            }).agrees(std::to_string(m) + " segments, full at " + std::to_string(at));
    }
}

TEST(ChainSolver, says_when_a_block_is_not_definite) {
    Chain chain(12, [](int) { return false; });
    chain.solver.h[0][4] = -50;
    EXPECT_FALSE(chain.solver.solve());
    Chain other(12, [](int) { return false; });
    other.solver.g[1][3] = std::nan("");
    EXPECT_FALSE(other.solver.solve());
}

} // namespace
} // namespace calot::rod_direct
