// Embree's point queries, the peer that distances to surfaces are timed beside.
#pragma once

#include "bench/geometry_scenes.hpp"

#include <memory>
#include <span>

namespace calot::bench {

class EmbreeSpheres {
  public:
    /// Null where this build has no Embree.
    static std::unique_ptr<EmbreeSpheres> make(const Surface& surface);
    virtual ~EmbreeSpheres() = default;
    /// Sum of the distances from those centres that have the surface within `reach`, in double precision.
    virtual double distances(std::span<const geometry::Vec3> centres, double reach) const = 0;
};

} // namespace calot::bench
