// The snapshot as a procedure sees it through the contract.
#pragma once

#include "simulation/snapshot.hpp"
#include "simulation/world.hpp"

#include <calot/abi/plugin.h>

#include <cstdint>
#include <vector>

namespace calot::simulation {

class ProcedureView {
  public:
    /// `world` must outlive it.
    explicit ProcedureView(const World& world);

    /// Valid until the next call; `snapshot` must live as long.
    const calot_snapshot& of(const Snapshot& snapshot);

  private:
    static std::uint32_t pose(void* self, calot_string id, calot_pose* out);
    static std::uint32_t landmark(void* self, calot_string id, calot_marker* out);
    static std::uint32_t organ(void* self, calot_string id);
    static std::uint32_t quantity(void* self, calot_string id, double* out);

    const World& world_;
    std::vector<std::vector<double>> polylines_; // of the anatomy's landmarks, interleaved
    calot_snapshot abi_{};
};

} // namespace calot::simulation
