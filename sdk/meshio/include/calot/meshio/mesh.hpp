#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace calot::meshio {

using Vec3 = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;
using Colour = std::array<std::uint8_t, 4>;

/// An indexed triangle surface, in metres, in the world frame (patient LPS: +x left, +y posterior, +z
/// superior). Triangles are counter-clockwise seen from outside the solid. Vertices that share a position are
/// one vertex.
struct TriangleMesh {
    std::string name;
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;
    /// For each triangle, an index in region_names; empty when there is one region at most.
    std::vector<std::uint16_t> region;
    std::vector<std::string> region_names;
    /// Unit normals, one for each vertex, or empty.
    std::vector<Vec3> normals;
    /// One for each vertex, or empty; the mesher bakes ambient occlusion here (255 = open, in red, green and
    /// blue).
    std::vector<Colour> colours;
};

/// What every function of this library throws: one line, "file: what is wrong: remedy".
class MeshError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Joins vertices whose positions are equal (the normals are averaged, the first colour is kept), drops
/// triangles that thereby lose an edge, and vertices that no triangle uses. Order of first use is kept: same
/// input, same bits.
void weld(TriangleMesh& mesh);

/// Fills `normals` with the mean of the adjacent triangles' normals, each weighted by its angle at the
/// vertex.
void compute_normals(TriangleMesh& mesh);

} // namespace calot::meshio
