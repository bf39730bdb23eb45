#include "noise.hpp"

namespace calot::mesher {
namespace {

/// The finaliser of MurmurHash3 over the lattice coordinates.
std::uint32_t hash(std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t seed) {
    std::uint64_t h = seed * 0x9e3779b97f4a7c15ull + 0x632be59bd9b4e019ull;
    for (const std::int64_t c : {x, y, z}) {
        h ^= static_cast<std::uint64_t>(c);
        h *= 0xff51afd7ed558ccdull;
        h ^= h >> 33;
        h *= 0xc4ceb9fe1a85ec53ull;
        h ^= h >> 33;
    }
    return static_cast<std::uint32_t>(h);
}

double unit(std::uint32_t h) {
    return h * (1.0 / 4294967296.0);
}

/// Perlin's twelve edge directions, four of them twice.
double slope(std::uint32_t h, double x, double y, double z) {
    switch (h & 15) {
    case 0:
        return x + y;
    case 1:
        return y - x;
    case 2:
        return x - y;
    case 3:
        return -x - y;
    case 4:
        return x + z;
    case 5:
        return z - x;
    case 6:
        return x - z;
    case 7:
        return -x - z;
    case 8:
        return y + z;
    case 9:
        return z - y;
    case 10:
        return y - z;
    case 11:
        return -y - z;
    case 12:
        return x + y;
    case 13:
        return z - y;
    case 14:
        return y - x;
    default:
        return -y - z;
    }
}

double fade(double t) {
    return t * t * t * (t * (6 * t - 15) + 10);
}
double mix(double a, double b, double t) {
    return a + t * (b - a);
}

} // namespace

double gradient_noise(Vec p, std::uint32_t seed) {
    const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
    const auto i = static_cast<std::int64_t>(fx), j = static_cast<std::int64_t>(fy),
               k = static_cast<std::int64_t>(fz);
    const double x = p.x - fx, y = p.y - fy, z = p.z - fz;
    double at[2][2][2];
    for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b)
            for (int c = 0; c < 2; ++c)
                at[a][b][c] = slope(hash(i + a, j + b, k + c, seed), x - a, y - b, z - c);
    const double u = fade(x), v = fade(y), w = fade(z);
    return mix(mix(mix(at[0][0][0], at[1][0][0], u), mix(at[0][1][0], at[1][1][0], u), v),
               mix(mix(at[0][0][1], at[1][0][1], u), mix(at[0][1][1], at[1][1][1], u), v), w);
}

double layered_noise(Vec p, int octaves, std::uint32_t seed) {
    double sum = 0, weight = 1, total = 0;
    for (int i = 0; i < octaves; ++i) {
        sum += weight * gradient_noise(p, seed + static_cast<std::uint32_t>(i));
        total += weight;
        weight *= 0.5;
        p = 2.0 * p + Vec{17.3, 5.1, 9.7}; // off the lattice, so that octaves do not share their zeros
    }
    return sum / total;
}

Cell cell_noise(Vec p, std::uint32_t seed) {
    const auto i = static_cast<std::int64_t>(std::floor(p.x)), j = static_cast<std::int64_t>(std::floor(p.y)),
               k = static_cast<std::int64_t>(std::floor(p.z));
    double first = 1e300, second = 1e300;
    std::uint32_t id = 0;
    for (std::int64_t a = i - 1; a <= i + 1; ++a)
        for (std::int64_t b = j - 1; b <= j + 1; ++b)
            for (std::int64_t c = k - 1; c <= k + 1; ++c) {
                const std::uint32_t h = hash(a, b, c, seed);
                const Vec q{static_cast<double>(a) + 0.15 + 0.7 * unit(h),
                            static_cast<double>(b) + 0.15 + 0.7 * unit(hash(a, b, c, seed ^ 0x51ed270bu)),
                            static_cast<double>(c) + 0.15 + 0.7 * unit(hash(a, b, c, seed ^ 0x2545f491u))};
                const double d = dot(p - q, p - q);
                if (d < first)
                    second = first, first = d, id = h;
                else if (d < second)
                    second = d;
            }
    return {std::sqrt(first), std::sqrt(second) - std::sqrt(first), id};
}

double hashed(std::int64_t a, std::int64_t b, std::uint32_t seed) {
    return unit(hash(a, b, 0, seed));
}

} // namespace calot::mesher
