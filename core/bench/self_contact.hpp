#pragma once

#include "bench/bench_rod.hpp"

#include <calot/abi/contact.h>

#include <vector>

namespace calot::bench {

/// Where a rod touches itself: pairs of segments, by brute force.
class SelfContacts {
  public:
    /// Segments nearer to each other along the rod than half a turn of the tightest bend (a circle of twice
    /// the radius) are no pair.
    SelfContacts(const UniformRod& rod, double friction);

    /// At most `capacity` contacts, the nearest of each pair of segments that are nearer than `reach` (m).
    /// Replaced at each call.
    const std::vector<calot_contact>& contacts(const BenchRod& rod, double reach, std::size_t capacity);

  private:
    int apart_;
    double radius_, friction_;
    std::vector<calot_contact> list_;
};

/// The closest points of the segments a0 a1 and b0 b1, as fractions of each.
struct ClosestPair {
    double s = 0, t = 0, distance = 0;
};
ClosestPair closest_points(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1);

} // namespace calot::bench
