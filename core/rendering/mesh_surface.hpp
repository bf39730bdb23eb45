// From a mesh file's contents to what the renderer takes.
#pragma once

#include "rendering/types.hpp"

#include <calot/meshio/mesh.hpp>

#include <functional>
#include <string>

namespace calot::rendering {

/// The mesh's colours are taken as ambient openness (as the mesher bakes it), its regions become appearances.
/// \param appearance_of  from a region's name (empty: the mesh has none) to an entry of appearance.toml
Surface to_surface(const meshio::TriangleMesh& mesh,
                   const std::function<std::string(const std::string& region)>& appearance_of);

} // namespace calot::rendering
