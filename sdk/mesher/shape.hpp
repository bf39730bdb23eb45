#pragma once

#include "vec.hpp"

#include <memory>
#include <vector>

namespace calot::mesher {

/// A solid as a field: negative inside, positive outside, close to the distance in mm near the surface.
/// Immutable; any thread.
class Shape {
  public:
    virtual ~Shape() = default;
    virtual double value(Vec p) const = 0;
    /// Holds the solid; infinite for half-spaces.
    const Box& bounds() const { return bounds_; }

  protected:
    Box bounds_;
};

using ShapePtr = std::shared_ptr<const Shape>;

ShapePtr make_ellipsoid(Vec centre, Vec radii, Vec rotate_degrees, double exponent);
ShapePtr make_capsule(Vec from, Vec to, double radius_from, double radius_to);
ShapePtr make_box(Vec centre, Vec size, double round, Vec rotate_degrees);
/// Solid on the side that the normal points away from.
ShapePtr make_half_space(Vec point, Vec normal);

/// Joins meet in fillets of width `blend` (mm; 0: sharp): a cubic polynomial minimum, C2 across the fillet.
ShapePtr make_union(std::vector<ShapePtr> of, double blend);
ShapePtr make_intersection(std::vector<ShapePtr> of, double blend);
/// The first without the others.
ShapePtr make_difference(std::vector<ShapePtr> of, double blend);
/// The wall between the surface and surfaces `inwards` and `outwards` of it.
ShapePtr make_shell(ShapePtr of, double inwards, double outwards);
ShapePtr make_offset(ShapePtr of, double by);
ShapePtr make_placed(ShapePtr of, Vec move, Vec rotate_degrees, Vec about, double scale);

} // namespace calot::mesher
