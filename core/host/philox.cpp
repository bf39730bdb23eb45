#include "host/philox.hpp"

#include <cmath>
#include <numbers>

namespace calot::host {
namespace {

std::array<std::uint32_t, 4> block(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
    const auto low = [](std::uint64_t x) { return static_cast<std::uint32_t>(x); };
    const auto high = [](std::uint64_t x) { return static_cast<std::uint32_t>(x >> 32); };
    return philox4x32({low(counter), high(counter), low(stream), high(stream)}, {low(seed), high(seed)});
}

double unit(std::uint64_t bits) {
    return static_cast<double>(bits >> 11) * 0x1p-53;
}

} // namespace

std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> c, std::array<std::uint32_t, 2> key) {
    for (int round = 0; round < 10; ++round) {
        const std::uint64_t a = 0xD2511F53ull * c[0];
        const std::uint64_t b = 0xCD9E8D57ull * c[2];
        c = {static_cast<std::uint32_t>(b >> 32) ^ c[1] ^ key[0], static_cast<std::uint32_t>(b),
             static_cast<std::uint32_t>(a >> 32) ^ c[3] ^ key[1], static_cast<std::uint32_t>(a)};
        key[0] += 0x9E3779B9u;
        key[1] += 0xBB67AE85u;
    }
    return c;
}

std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
    const auto b = block(seed, stream, counter);
    return static_cast<std::uint64_t>(b[1]) << 32 | b[0];
}

double random_uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
    return unit(random_bits(seed, stream, counter));
}

double random_normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
    const auto b = block(seed, stream, counter);
    const double u = 1 - unit(static_cast<std::uint64_t>(b[1]) << 32 | b[0]); // in (0, 1]
    const double v = unit(static_cast<std::uint64_t>(b[3]) << 32 | b[2]);
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

} // namespace calot::host
