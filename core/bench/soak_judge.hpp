#pragma once

#include "bench/row.hpp"
#include "simulation/simulation.hpp"

#include <cstdint>
#include <vector>

namespace calot::bench {

/// Whether the line from a to b touches a surface. Counts a touch of an edge: nothing slips between
/// triangles.
bool crosses(const geometry::TriangleScene& scene, const geometry::Vec3& a, const geometry::Vec3& b);

/// Nodes that lie beyond a surface: followed from the base, the shaft's axis has crossed one on the way to
/// them. The axis of a shaft in a lumen crosses none, whatever it is pressed against.
std::size_t nodes_outside(const geometry::TriangleScene& scene, const std::vector<double>& position);

/// Watches a case that is to end well: how deep the shaft sinks into organs and for how long, whether a node
/// leaves the lumen, what energy and forces it comes to.
class SoakJudge : public simulation::Observer {
  public:
    /// `world` must outlive it. The lumen is looked at every `period` ticks.
    SoakJudge(const simulation::World& world, int period);
    void ticked(const simulation::Snapshot& snapshot) override;

    std::int64_t ticks() const { return ticks_; }
    double deepest() const { return deepest_; }                ///< m
    std::int64_t longest_over_1mm() const { return longest_; } ///< ticks in a row
    std::size_t most_outside() const { return most_outside_; } ///< nodes
    double top_energy() const { return top_energy_; }          ///< J, elastic and kinetic
    double energy_bound() const { return energy_bound_; }      ///< J
    std::int64_t deepest_tick() const { return deepest_tick_; }

    /// The judged quantities. `wanted`: s that were to be simulated.
    std::vector<Row> rows(const Row& like, double wanted) const;

  private:
    const simulation::World& world_;
    int period_;
    double smallest_radius_, energy_bound_;
    std::int64_t ticks_ = 0, streak_ = 0, longest_ = 0, deepest_tick_ = 0;
    double deepest_ = 0, top_energy_ = 0, top_force_ = 0, top_speed_ = 0;
    double shortest_inside_ = 1e9, longest_inside_ = 0;
    std::size_t most_outside_ = 0;
};

} // namespace calot::bench
