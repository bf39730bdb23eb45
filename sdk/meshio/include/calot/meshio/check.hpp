#pragma once

#include <calot/meshio/mesh.hpp>

#include <cstddef>
#include <string>

namespace calot::meshio {

/// What can be said of a surface without asking whether it cuts itself (the mesher asks that too).
struct MeshReport {
    std::size_t vertices = 0;
    std::size_t triangles = 0;
    std::size_t components = 0;         ///< parts connected through edges
    std::size_t boundary_edges = 0;     ///< edges with one triangle: 0 when closed
    std::size_t non_manifold_edges = 0; ///< edges with three triangles or more
    std::size_t misoriented_edges = 0;  ///< edges that both their triangles run through in the same direction
    std::size_t non_manifold_vertices = 0; ///< vertices whose triangles form more than one fan
    std::size_t degenerate_triangles =
        0; ///< repeated vertices, or an area below 1e-14 m2 (0.01 mm by 0.002 mm)
    std::size_t inverted_components = 0; ///< components that face the wrong way
    double volume = 0.0;                 ///< enclosed, m3
    double area = 0.0;                   ///< m2
    Vec3 minimum{}, maximum{};           ///< bounding box, m

    bool closed() const { return boundary_edges == 0; }
    bool manifold() const {
        return non_manifold_edges == 0 && misoriented_edges == 0 && non_manifold_vertices == 0;
    }
    /// The first thing that keeps the mesh from being the closed, outward-oriented boundary of a solid; empty
    /// if none.
    std::string problem() const;
};

/// A component nested an odd number of times inside others bounds a cavity, so it must face inwards (a
/// negative signed volume); all others must face outwards. Throws MeshError for indices out of range.
MeshReport check(const TriangleMesh& mesh);

} // namespace calot::meshio
