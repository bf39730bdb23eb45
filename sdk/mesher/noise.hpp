#pragma once

#include "vec.hpp"

#include <cstdint>

namespace calot::mesher {

/// Gradient noise (Perlin 2002, quintic fade) over a hashed unit lattice: C2, zero mean, about -1 to 1. The
/// same point and seed always give the same bits.
double gradient_noise(Vec p, std::uint32_t seed);

/// Octaves of gradient noise, each of twice the frequency and half the weight, scaled back to about -1 to 1.
double layered_noise(Vec p, int octaves, std::uint32_t seed);

/// Cells around one jittered point per unit lattice cube (Worley 1996).
struct Cell {
    double nearest; ///< distance to the nearest point
    double edge;    ///< how much farther the second nearest is: 0 on the border between two cells
    std::uint32_t id;
};
Cell cell_noise(Vec p, std::uint32_t seed);

/// A number in [0, 1) that depends on the three integers alone.
double hashed(std::int64_t a, std::int64_t b, std::uint32_t seed);

} // namespace calot::mesher
