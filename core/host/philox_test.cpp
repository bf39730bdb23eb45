#include "host/philox.hpp"

#include <gtest/gtest.h>

#include <cmath>

using namespace calot::host;

// Known answers of Random123 1.09 (Salmon et al. 2011), kat_vectors, philox4x32 with 10 rounds.
TEST(Philox, gives_the_published_numbers) {
    using Block = std::array<std::uint32_t, 4>;
    EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
    EXPECT_EQ(philox4x32({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}),
              (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
    EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
              (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Philox, uniform_and_normal_numbers_have_their_moments) {
    constexpr int n = 100000;
    double u = 0, z = 0, z2 = 0;
    for (int i = 0; i < n; ++i) {
        const double x = random_uniform(7, 3, i);
        ASSERT_GE(x, 0);
        ASSERT_LT(x, 1);
        u += x;
        const double y = random_normal(7, 4, i);
        ASSERT_TRUE(std::isfinite(y)) << "at counter " << i;
        z += y, z2 += y * y;
    }
    // Five standard errors.
    EXPECT_NEAR(u / n, 0.5, 5 * std::sqrt(1.0 / 12 / n));
    EXPECT_NEAR(z / n, 0, 5 / std::sqrt(n));
    EXPECT_NEAR(z2 / n, 1, 5 * std::sqrt(2.0 / n));
}

TEST(Philox, other_seeds_streams_and_counters_give_other_bits) {
    const auto bits = random_bits(1, 2, 3);
    EXPECT_EQ(bits, random_bits(1, 2, 3));
    EXPECT_NE(bits, random_bits(2, 2, 3));
    EXPECT_NE(bits, random_bits(1, 3, 3));
    EXPECT_NE(bits, random_bits(1, 2, 4));
}
