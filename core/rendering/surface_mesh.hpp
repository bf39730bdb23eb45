// What is worked out of a surface once, when it is registered: normals, concavity, and clusters of
// neighbouring triangles that can be left out together.
#pragma once

#include "rendering/types.hpp"

#include <cstddef>

namespace calot::rendering {

/// Throws std::invalid_argument, naming surface and field, for arrays of different lengths, indices out of
/// range, no triangle, or a coordinate that is not finite.
void check(const Surface&);

/// Unit normals, each the mean of its triangles' weighted by area.
std::vector<std::array<float, 3>> vertex_normals(const Surface&);

/// For each vertex, how concave the surface is seen from outside: -1 a ridge, +1 a crease. It is the mean
/// height of the neighbours above the tangent plane over their distance squared (half the mean curvature), in
/// units of 1 / `scale`, smoothed over the mesh.
std::vector<float> concavity(const Surface&, const std::vector<std::array<float, 3>>& normals,
                             double scale = 0.012);

/// Triangles that lie together.
struct Cluster {
    std::size_t first = 0, count = 0; // triangles in ClusteredTriangles::triangles
    std::array<float, 3> centre{};
    float radius = 0;
    float longest_edge = 0;
};

struct ClusteredTriangles {
    std::vector<std::array<std::uint32_t, 3>> triangles; // reordered
    std::vector<Cluster> clusters;
};

/// Orders triangles along a Morton curve and cuts them into clusters of `size`.
ClusteredTriangles cluster(const Surface&, std::size_t size = 96);

/// Centre, radius and longest edge of a cluster for the present vertices.
void update_bounds(Cluster&, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                   const std::vector<std::array<float, 3>>& vertices);

} // namespace calot::rendering
