#pragma once

#include <calot/math.hpp>

#include <cstdint>
#include <numbers>

namespace calot::bench {

/// SplitMix64 (Steele, Lea & Flood 2014): the same seed gives the same scene everywhere.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t bits() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return z ^ (z >> 31);
    }
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1.0p-53;
    }
    Vec3 direction() {
        const double z = uniform(-1, 1), a = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
        return {r * std::cos(a), r * std::sin(a), z};
    }
    Quat orientation() { return axis_angle(direction(), uniform(0.5, std::numbers::pi)); }

  private:
    std::uint64_t state_;
};

} // namespace calot::bench
