#pragma once

#include "sweep.hpp"

#include <cstdint>
#include <memory>
#include <variant>

namespace calot::mesher {

using SweepPtr = std::shared_ptr<const Sweep>;

/// A relief, evaluated near a surface; 0 leaves the surface where it is, 1 is the full height.
namespace pattern {

/// Long tortuous rounded folds along a sweep with narrow grooves between them, as in the stomach.
struct Rugae {
    SweepPtr along;
    double count;  ///< folds round the circumference
    double length; ///< mm along the sweep before a fold wanders by its own width
    double groove; ///< width of the grooves: 0.5 narrow between flat folds, 1.5 rounded folds
    std::uint32_t seed;
};
/// Straight longitudinal folds along a sweep, as in an empty oesophagus; -1 to 1.
struct Folds {
    SweepPtr along;
    double count, length;
    std::uint32_t seed;
};
/// Sacculations between three bands (taeniae) and semilunar folds, as in the colon: 0 on bands and folds, 1
/// between.
struct Haustra {
    SweepPtr along;
    double spacing;     ///< mm from fold to fold
    double band;        ///< width of a taenia, degrees
    double crease;      ///< width of a fold, mm
    double first_band;  ///< angle of the first taenia, degrees
    std::uint32_t seed; ///< moves the folds of each third against each other
};
/// Half-moon folds of an insufflated colon's mucosa, each between two taeniae, the ones that go with
/// `Haustra` of the same spacing, first band and seed: 0 between folds and on taeniae, 1 in the middle of a
/// fold's edge. The edge is the chord from taenia to taenia, so that a height of half the radius makes the
/// lumen a triangle.
struct Semilunar {
    SweepPtr along;
    double spacing;    ///< mm from fold to fold
    double width;      ///< half the thickness of a fold near its edge, mm
    double first_band; ///< angle of the first taenia, degrees
    std::uint32_t seed;
};
/// Rings around a sweep (plicae circulares, spiral folds of the cystic duct): 1 on a ring.
struct Rings {
    SweepPtr along;
    double spacing, width; ///< mm
    double arc;            ///< share of the circumference that a ring covers, 0 to 1
    double pitch;          ///< turns of a helix per ring: 0 rings, 1 one spiral
    std::uint32_t seed;
};
/// Rounded lobules with grooves between them (pancreas, omental fat, spleen's notches): 0 in the grooves.
struct Lobules {
    Vec size; ///< mm along x, y, z
    std::uint32_t seed;
};
/// Layered noise, -1 to 1.
struct Noise {
    Vec wavelength; ///< mm along x, y, z
    int octaves;
    std::uint32_t seed;
};
/// A sine along a direction, -1 to 1.
struct Wave {
    Vec direction;
    double wavelength, phase; ///< mm, degrees
};

} // namespace pattern

using Pattern = std::variant<pattern::Rugae, pattern::Folds, pattern::Haustra, pattern::Semilunar,
                             pattern::Rings, pattern::Lobules, pattern::Noise, pattern::Wave>;

double relief(const Pattern& pattern, Vec p);

/// Where a relief applies: within `only`, outside `except`, fading over `fade` mm on the inner side of the
/// border.
struct Mask {
    ShapePtr only, except;
    double fade = 5;
};

/// The surface moved outwards by height times the relief (inwards for a negative height).
ShapePtr make_displaced(ShapePtr of, Pattern pattern, double height, Mask mask);

/// Space itself moved by smooth noise, so that straight things become wavy: up to about `amplitude` in each
/// direction.
ShapePtr make_warped(ShapePtr of, Vec amplitude, double wavelength, int octaves, std::uint32_t seed);

} // namespace calot::mesher
