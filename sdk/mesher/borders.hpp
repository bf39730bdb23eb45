#pragma once

#include "shape.hpp"
#include "surface.hpp"

#include <functional>

namespace calot::mesher {

/// Makes the curve in which `border`'s surface meets the surface of `solid` run along edges, so that a region
/// ends in a smooth line: near vertices slide onto the curve, edges that still cross it are split there.
/// Edges whose middle `leave` accepts are left alone.
void cut_along(Surface& surface, const Shape& solid, const Shape& border,
               const std::function<bool(Vec)>& leave);

} // namespace calot::mesher
