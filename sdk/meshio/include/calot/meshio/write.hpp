#pragma once

#include <calot/meshio/mesh.hpp>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace calot::meshio {

struct GlbOptions {
    std::string generator = "calot meshio";
    /// Written in this order as strings into asset.extras.
    std::vector<std::pair<std::string, std::string>> extras;
};

/// The mesh as the bytes of a binary glTF 2.0 file, in glTF's axes (x left, y cranial, z anterior), metres,
/// single precision: one mesh, one primitive for each region in use, the region's name as its material's.
/// Normals are computed where the mesh has none. Same mesh, same bytes. Throws MeshError for a mesh that is
/// empty or inconsistent.
std::string to_glb(const TriangleMesh& mesh, const GlbOptions& options = {});

/// Writes to_glb(mesh) to a file, through a temporary file beside it. Throws MeshError.
void write_glb(const std::filesystem::path& file, const TriangleMesh& mesh, const GlbOptions& options = {});

/// The string members of asset.extras of a binary glTF file, as written by write_glb; empty when there are
/// none. Throws MeshError when the file cannot be read or is no binary glTF.
std::vector<std::pair<std::string, std::string>> read_glb_extras(const std::filesystem::path& file);

} // namespace calot::meshio
