#pragma once

#include "description.hpp"

#include <calot/meshio/check.hpp>
#include <calot/meshio/mesh.hpp>

#include <string>

namespace calot::mesher {

struct OrganMesh {
    meshio::TriangleMesh mesh; ///< metres, LPS; normals from the field, ambient occlusion as colours
    meshio::MeshReport report; ///< of the mesh as single precision stores it
    std::size_t self_intersections = 0;
    /// What keeps the mesh from being fit for use; empty if nothing does.
    std::string problem;
};

/// Meshes an organ and checks the result. Throws SurfaceError when no mesh could be made.
OrganMesh mesh_organ(const Organ& organ);

/// The checks alone, for a mesh from anywhere; `budget` 0: any number of triangles.
OrganMesh examine(meshio::TriangleMesh mesh, std::size_t budget);

} // namespace calot::mesher
