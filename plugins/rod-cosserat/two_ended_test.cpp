#include "lapack.hpp"
#include "two_ended.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace calot::rod_cosserat {
namespace {

struct System {
    std::vector<double> lower, diagonal, upper, right;
};

System random_system(int m, std::uint32_t seed, double weakest) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1, 1), strong(weakest, 2 * weakest + 1);
    System s;
    for (int j = 0; j < m; ++j) {
        s.lower.push_back(any(random)), s.upper.push_back(any(random));
        s.diagonal.push_back(strong(random)), s.right.push_back(any(random));
    }
    return s;
}

double residual(const System& s, const std::vector<double>& x) {
    double worst = 0;
    const std::size_t m = x.size();
    for (std::size_t j = 0; j < m; ++j) {
        double sum = s.diagonal[j] * x[j] - s.right[j];
        if (j > 0) sum += s.lower[j] * x[j - 1];
        if (j + 1 < m) sum += s.upper[j] * x[j + 1];
        worst = std::max(worst, std::fabs(sum));
    }
    return worst;
}

TEST(TwoEnded, solves_any_number_of_rows) {
    for (int m = 1; m <= 40; ++m) {
        const System s = random_system(m, static_cast<std::uint32_t>(m), 2.0);
        std::vector<double> inverse(s.right.size()), x(s.right.size());
        ASSERT_TRUE(two_ended::solve(m, s.lower.data(), s.diagonal.data(), s.upper.data(), s.right.data(),
                                     inverse.data(), x.data()));
        EXPECT_LT(residual(s, x), 1e-14) << m << " rows";
    }
}

TEST(TwoEnded, solves_a_symmetric_system_again_and_again) {
    for (int m = 1; m <= 40; ++m) {
        System s = random_system(m, static_cast<std::uint32_t>(m), 2.0);
        for (std::size_t j = 0; j + 1 < s.right.size(); ++j)
            s.lower[j + 1] = s.upper[j];
        std::vector<double> diagonal = s.diagonal, off = s.upper;
        two_ended::factor(m, diagonal.data(), off.data());
        for (int again = 0; again < 2; ++again) {
            std::vector<double> x = s.right;
            two_ended::solve(m, diagonal.data(), off.data(), x.data());
            EXPECT_LT(residual(s, x), 1e-14) << m << " rows";
            std::swap(s.right.front(), s.right.back());
        }
    }
}

// What it accepts it solves well; what it refuses LAPACK, which exchanges rows, still solves.
TEST(TwoEnded, refuses_small_pivots) {
    int refused = 0;
    for (std::uint32_t seed = 1; seed <= 200; ++seed) {
        System s = random_system(20, seed, 0.3);
        std::vector<double> inverse(20), x(20);
        if (two_ended::solve(20, s.lower.data(), s.diagonal.data(), s.upper.data(), s.right.data(),
                             inverse.data(), x.data())) {
            EXPECT_LT(residual(s, x), 1e-10) << "seed " << seed;
            continue;
        }
        ++refused;
        const System whole = s;
        ASSERT_TRUE(lapack::solve_tridiagonal(20, s.lower.data() + 1, s.diagonal.data(), s.upper.data(),
                                              s.right.data()));
        EXPECT_LT(residual(whole, s.right), 1e-10) << "seed " << seed;
    }
    EXPECT_GT(refused, 0);
    EXPECT_LT(refused, 200);
}

} // namespace
} // namespace calot::rod_cosserat
