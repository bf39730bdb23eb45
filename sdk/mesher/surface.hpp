#pragma once

#include "vec.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

// The only doorway to CGAL: surface.cpp is the one file that includes it.
namespace calot::mesher {

struct Surface {
    std::vector<Vec> points;
    std::vector<std::array<std::uint32_t, 3>> triangles; ///< counter-clockwise from outside
};

class SurfaceError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

struct SurfaceRequest {
    std::function<double(Vec)> field; ///< negative inside
    Box bounds;                       ///< holds the solid
    std::vector<Vec> seeds;           ///< points of the surface, at least some on each component
    std::function<double(Vec)> edge;  ///< largest edge wanted at a point, mm
    std::function<double(Vec)>
        deviation;           ///< largest distance between triangle and surface wanted at a point, mm
    std::size_t most_points; ///< refinement stops with an error beyond
};

/// Restricted Delaunay triangulation of the field's zero set, refined until edges, deviation and angles (25
/// degrees) are met and the surface is a closed manifold (Boissonnat and Oudot 2005; CGAL Surface_mesher).
/// Its triangles are faces of a Delaunay triangulation, so they cannot cut each other. Same request, same
/// bits. Throws SurfaceError.
Surface extract_surface(const SurfaceRequest& request);

/// Pairs of triangles that cut each other.
std::size_t self_intersections(const Surface& surface);

} // namespace calot::mesher
