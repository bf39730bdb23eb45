#include "simulation/endoscope_chain.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace calot::simulation {

namespace {

constexpr double usual_spacing = 0.0104; // m
constexpr std::uint32_t fewest_nodes = 20, most_nodes = 2000;

// Integral of 1/g over the shares a to b of a segment: exact for a linear g.
double compliance(const Gradient& g, double a, double b) {
    const double begin = g.at(a), end = g.at(b);
    const double ratio = end / begin - 1;
    // log(1+x)/x at x near 0
    const double factor = std::abs(ratio) < 1e-6 ? 1 - 0.5 * ratio : std::log1p(ratio) / ratio;
    return (b - a) * factor / begin;
}

// What a piece of the rod gathers from the segments that it spans.
struct Gathered {
    double length = 0, radius = 0, mass = 0, bending = 0, torsion = 0, bending_damping = 0,
           torsion_damping = 0, drag = 0, friction = 0;

    void add(const ShaftSegment& s, double a, double b) { // shares of the segment
        const double l = (b - a) * s.length;
        const double k = compliance(s.flexural_rigidity, a, b) * s.length;
        const double t = compliance(s.torsional_rigidity, a, b) * s.length;
        length += l, radius += l * s.outer_radius, mass += l * s.mass_per_length;
        bending += k, torsion += t;
        bending_damping += k * s.bending_damping, torsion_damping += t * s.torsion_damping;
        drag += l * s.drag, friction += l * s.friction_factor;
    }
    void store(ShaftChain& to) const {
        to.length.push_back(length);
        to.radius.push_back(radius / length);
        to.mass.push_back(mass / length);
        to.bending.push_back(length / bending);
        to.torsion.push_back(length / torsion);
        to.bending_damping.push_back(bending_damping / bending);
        to.torsion_damping.push_back(torsion_damping / torsion);
        to.drag.push_back(drag / length);
        to.friction.push_back(friction / length);
    }
};

Gathered gather(const EndoscopeDatasheet& sheet, double begin, double end) {
    Gathered sum;
    double at = 0;
    for (const ShaftSegment& s : sheet.segments) {
        const double a = std::max((begin - at) / s.length, 0.0), b = std::min((end - at) / s.length, 1.0);
        if (b > a) sum.add(s, a, b);
        at += s.length;
    }
    return sum;
}

} // namespace

std::uint32_t usual_nodes(const EndoscopeDatasheet& sheet) {
    const double pieces = std::round(sheet.working_length / usual_spacing);
    return static_cast<std::uint32_t>(std::clamp(pieces + 1, double{fewest_nodes}, double{most_nodes}));
}

ShaftChain divide(const EndoscopeDatasheet& sheet, std::uint32_t nodes) {
    if (nodes < fewest_nodes || nodes > most_nodes)
        throw std::invalid_argument("a shaft has 20 to 2000 nodes");
    const std::uint32_t pieces = nodes - 1;
    double total = 0;
    for (const ShaftSegment& s : sheet.segments)
        total += s.length;
    const double bending_length = sheet.bending_length(), shaft_length = total - bending_length;
    const auto bending = static_cast<std::uint32_t>(
        std::clamp(std::round(bending_length / total * pieces), 3.0, static_cast<double>(pieces - 3)));
    ShaftChain chain;
    chain.first_bending = pieces - bending;
    for (std::uint32_t i = 0; i < pieces; ++i) {
        const bool bends = i >= chain.first_bending;
        const double begin = bends ? shaft_length : 0;
        const double step = bends ? bending_length / bending : shaft_length / chain.first_bending;
        const std::uint32_t k = bends ? i - chain.first_bending : i;
        gather(sheet, begin + k * step, begin + (k + 1) * step).store(chain);
    }
    return chain;
}

} // namespace calot::simulation
