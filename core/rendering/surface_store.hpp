// Surfaces on the graphics card, and the choice of what a view needs of them.
#pragma once

#include "rendering/appearance.hpp"
#include "rendering/gl_objects.hpp"
#include "rendering/surface_mesh.hpp"
#include "rendering/types.hpp"

#include <Eigen/Core>

#include <span>

namespace calot::rendering {

/// What a camera can see at most: a cone around its axis.
struct ViewCone {
    Eigen::Vector3d eye{0, 0, 0};
    Eigen::Vector3d axis{0, 0, 1};
    double half_angle = 1.2; // rad, up to pi
    double reach = 1.0;      // m
    double split_angle = 0;  // rad: clusters with edges that span more are put apart for subdivision; 0: none
};

/// Part of a surface to draw, with indices `first`, `count` into the stream of this view.
struct DrawItem {
    std::size_t surface = 0;
    std::size_t first = 0, count = 0;
    bool split = false;
    Style style = Style::Solid;
    Eigen::Matrix3f rotation;
    Eigen::Vector3f origin;
};

class SurfaceStore {
  public:
    /// Needs a current context, for this and all below.
    explicit SurfaceStore(std::vector<Appearance> appearances);

    /// Throws std::invalid_argument (see check(const Surface&) and find_appearance()).
    SurfaceId add(const Surface&);

    /// Moves vertices first, first + 1, ... of a surface; normals may be empty (unchanged).
    /// Throws std::out_of_range for an unknown id or a range past the end.
    void update_vertices(SurfaceId, std::size_t first, std::span<const std::array<float, 3>> vertices,
                         std::span<const std::array<float, 3>> normals);

    /// Uploads the indices of the clusters in the cone, nearest first, and returns what to draw of them.
    std::vector<DrawItem> select(const ViewCone&, const std::vector<SurfaceState>& states, bool endoscope);

    void bind(const DrawItem&) const; // vertex array with the stream's indices
    std::size_t triangle_count() const;

  private:
    struct Entry {
        std::string name;
        ClusteredTriangles mesh;
        std::vector<std::array<float, 3>> vertices;
        Buffer rest, moved, normals, look;
        VertexArray array;
    };
    void bind_attributes(Entry&);

    std::vector<Appearance> appearances_;
    std::vector<Entry> entries_;
    Buffer stream_;
    std::vector<std::uint32_t> indices_; // reused from frame to frame
    std::vector<std::pair<float, std::uint32_t>> whole_, split_;
};

} // namespace calot::rendering
