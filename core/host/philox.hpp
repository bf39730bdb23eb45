#pragma once

#include <array>
#include <cstdint>

namespace calot::host {

/// Philox 4x32 with 10 rounds: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3",
/// SC 2011.
std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key);

/// 64 bits: key is the seed, counter is (counter, stream), low word first.
std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter);
/// In [0, 1): the upper 53 bits.
double random_uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter);
/// Mean 0, deviation 1 (Box and Muller 1958) from both halves of the same block.
double random_normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter);

} // namespace calot::host
