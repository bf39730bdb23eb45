#pragma once

#include "bench/bench_rod.hpp"
#include "bench/random.hpp"

#include <calot/abi/contact.h>

#include <vector>

namespace calot::bench {

/// A rigid tube round a curve, closed or open at its far end, and a rod's contacts with it.
class Lumen {
  public:
    /// Samples of the axis, close together; the tube begins at the first.
    Lumen(std::vector<Vec3> axis, double radius, bool is_closed, double friction);

    /// From the origin along +x, winding at random, never tighter than `tightest` (m).
    static std::vector<Vec3> random_axis(Random& random, double length, double tightest);
    /// Straight, then an arc in the x-y plane, then straight.
    static std::vector<Vec3> bend(double lead, double radius, double angle, double tail);

    /// The contacts of every node beyond the tube's mouth, nearer than `reach` (m). Replaced at each call.
    const std::vector<calot_contact>& contacts(const BenchRod& rod, double reach = 2e-3);

  private:
    std::size_t nearest(const Vec3& p, std::size_t from) const;

    std::vector<Vec3> axis_;
    double radius_, friction_;
    bool is_closed_;
    std::vector<std::size_t> near_; // of each node, at the last call
    std::vector<calot_contact> list_;
};

/// A contact of node i (not the base's) with a surface: its point, unit normal towards the rod and the gap.
calot_contact node_contact(const BenchRod& rod, int i, std::uint64_t id, const Vec3& point,
                           const Vec3& normal, double gap, double friction);

} // namespace calot::bench
