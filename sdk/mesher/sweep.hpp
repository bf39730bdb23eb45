#pragma once

#include "shape.hpp"

#include <memory>
#include <vector>

namespace calot::mesher {

/// One knot of a sweep: a point of the centreline and the cross-section there. The section is made of four
/// quarter ellipses with the radii along +u, -u, +v, -v; u and v are turned about the tangent by `roll`
/// (radians).
struct Knot {
    Vec at;
    double plus_u = 1, minus_u = 1, plus_v = 1, minus_v = 1;
    double roll = 0;
};

/// Where a point lies along a sweep.
struct SweepPlace {
    double value;  ///< the sweep's field
    double s;      ///< arc length of the foot on the centreline, mm
    double phi;    ///< angle about the centreline from +u towards +v, in radii, -pi to pi
    double radius; ///< mean radius of the section at the foot, mm
};

enum class Cap { round, flat };

/// A tube along a spline (C2 cubic through the knots over chord length; radii and roll monotone cubic between
/// knots). With `up`, v is the part of it perpendicular to the tangent; without, the frame is transported
/// without twist from the first knot on. The radii should stay below the bend's radius: inside a tighter bend
/// the field may jump.
class Sweep final : public Shape {
  public:
    Sweep(const std::vector<Knot>& knots, bool has_up, Vec up, Cap start, Cap end);

    double value(Vec p) const override { return place(p).value; }
    SweepPlace place(Vec p) const;
    double length() const { return samples_.back().s; }
    /// Point of the centreline at an arc length.
    Vec point(double s) const;
    /// False when `up` lies within 10 degrees of the tangent somewhere.
    bool frame_ok() const { return frame_ok_; }

  private:
    struct Sample {
        Vec at, tangent; // tangent: derivative over the segment parameter's unit, of unit length
        Vec u;
        double s, radii[4], slope;
    };
    struct Group {
        std::size_t first, last; // segments first to last - 1
        Vec centre;
        double radius, largest; // sphere around the centreline part; largest radius of a section
    };
    SweepPlace on_segment(Vec p, std::size_t i) const;
    SweepPlace section(const Sample& at, Vec p, double overshoot, Cap cap, bool beyond) const;
    void build_groups();

    std::vector<Sample> samples_;
    std::vector<Group> groups_;
    Cap start_, end_;
    bool frame_ok_ = true;
};

} // namespace calot::mesher
