#pragma once

#include "description.hpp"

#include <string>
#include <vector>

namespace calot::mesher {

/// Room that two organs claim both.
struct Overlap {
    std::string first, second;
    double volume; ///< mL
    double depth;  ///< mm, about: how far one reaches into the other at the deepest place
    Vec deepest;   ///< that place, in the descriptions' frame
};

/// Compares the fields of every two organs at the points of a grid of `step` mm; the pairs that share a
/// point, deepest first. What is thinner than the step can be missed. Any thread.
std::vector<Overlap> find_overlaps(const std::vector<Organ>& organs, double step);

} // namespace calot::mesher
