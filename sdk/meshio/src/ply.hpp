#pragma once

#include <calot/meshio/read.hpp>

#include <string>

namespace calot::meshio {

/// Parses a PLY file's bytes (ascii, binary little- or big-endian): vertex positions and faces, polygons
/// fanned into triangles; everything else is skipped. Coordinates are left as the file has them. Throws
/// MeshError.
TriangleMesh parse_ply(const std::string& bytes, const std::string& file, const ReadOptions& options);

} // namespace calot::meshio
