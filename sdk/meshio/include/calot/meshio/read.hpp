#pragma once

#include <calot/meshio/mesh.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>

namespace calot::meshio {

/// The axes that a file's coordinates are written in.
enum class Axes {
    lps,  ///< x left, y posterior, z superior (DICOM, ITK)
    gltf, ///< x left, y cranial, z anterior (glTF: y up, z forward): LPS = (x, -z, y)
};

struct ReadOptions {
    double scale = 1.0;       ///< metres for each unit of the file (0.001 for a file in millimetres)
    std::optional<Axes> axes; ///< unless given: gltf for .glb and .gltf, lps for .obj, .stl and .ply
    std::size_t max_vertices = 4'000'000;
    std::size_t max_triangles = 4'000'000;
    std::uintmax_t max_bytes = 512u << 20;
};

/// Reads .glb, .gltf, .obj, .stl or .ply into one welded mesh. Materials (or, without materials, part names)
/// become regions. Any file may be hostile: it is bounded, checked for indices out of range and for values
/// that are not finite. Throws MeshError. Any thread.
TriangleMesh read_mesh(const std::filesystem::path& file, const ReadOptions& options = {});

} // namespace calot::meshio
