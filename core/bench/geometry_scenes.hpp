// Surfaces and shafts made by formula, for `calot bench geometry`.
#pragma once

#include "geometry/chain_contacts.hpp"
#include "geometry/triangle_scene.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace calot::bench {

/// A closed surface, outward; arrays as geometry::OrganSurface takes them.
struct Surface {
    std::vector<double> vertices;
    std::vector<std::uint32_t> triangles;

    std::size_t triangle_count() const { return triangles.size() / 3; }
    geometry::Vec3 corner(std::size_t triangle, int k) const;
    geometry::TriangleScene scene() const;
};

/// The wall of a tube along a line: a lumen with folds, and the outside a wall's thickness farther out.
struct FoldedTube {
    enum class Kind {
        stomach, ///< 12 x 12 x 24 cm, folds along it
        colon    ///< 1.2 m in five bends, haustra of 30 mm between three rows of semilunar folds
    };
    explicit FoldedTube(Kind kind) : kind_(kind) {}

    /// Of about 2 x 2 x `rings` x `sides` triangles; `swell` (m) moves the wall outwards where it is widest.
    Surface wall(std::uint32_t rings, std::uint32_t sides, double swell = 0) const;
    /// Nodes 10 mm apart along the lumen's wall, x, then y, then z. They rest on the folds; `along` (m) is
    /// how far the shaft has slid.
    std::vector<double> shaft_on_wall(std::size_t nodes, double radius, double along) const;

  private:
    geometry::Vec3 inside(double s, double turn, double swell) const;
    geometry::Vec3 outside(double s, double turn, double swell) const;
    Kind kind_;
};

} // namespace calot::bench
