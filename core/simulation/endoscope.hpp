// An endoscope as a chain: how its datasheet becomes segments, how its wheels bend it, where its camera is.
#pragma once

#include "geometry/vec3.hpp"
#include "simulation/endoscope_datasheet.hpp"

#include <calot/abi/plugin.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace calot::simulation {

class Endoscope {
  public:
    /// `nodes` from 20 to 2000. Throws std::invalid_argument.
    Endoscope(const EndoscopeDatasheet& sheet, std::uint32_t nodes);

    std::uint32_t nodes() const { return static_cast<std::uint32_t>(length_.size() + 1); }
    std::uint32_t first_bending_segment() const { return first_bending_; }
    double length() const { return total_; }                    // m
    std::span<const double> lengths() const { return length_; } // N-1, m
    std::span<const double> radii() const { return radius_; }   // N-1, m
    calot_rod_segments segments() const;                        // spans live as long as this

    /// Turns the wheels (rad; up (+), left (+)) for `dt` seconds: angulation follows behind the backlash of
    /// the wires, at most at its fastest. A braked wheel does not move. Real-time.
    void steer(const double wheel[2], const std::uint32_t brake[2], double dt);
    /// As after steering for ever, with the backlash in its middle.
    void set_bending(const double wheel[2]);
    /// Angulation, rad: up (+), left (+).
    const std::array<double, 2>& bending() const { return bending_; }
    /// 3(N-1), 1/m: rest curvatures for the angulation. Bending up is a turn about -x, left about +y.
    std::span<const double> rest_darboux() const { return rest_darboux_; }

    /// The camera, at the last node, looking along the last segment. `position` 3N, `frame` 4(N-1).
    calot_pose camera(std::span<const double> position, std::span<const double> frame) const;
    calot_twist camera_twist(std::span<const double> velocity, std::span<const double> angular) const;

    /// N m at the wheels that holds the bending section against what straightens it (up, left): the mean
    /// elastic moment there, times the wheels' ratio.
    std::array<double, 2> wheel_torque(std::span<const double> frame) const;

    /// Lays the nodes on the line: from `insertion` metres along `path` (from the guide's exit on) backwards,
    /// a segment's length from one to the next, and on into the guide. Returns 3N coordinates. Throws
    /// std::invalid_argument when the path is shorter than the insertion.
    std::vector<double> laid_along(const calot_guide& guide, std::span<const geometry::Vec3> path,
                                   double insertion) const;
    /// Frames for such nodes without twist, the base turned by `rotation` from y nearest to world -y. 4(N-1).
    std::vector<double> frames_along(std::span<const double> position, double rotation) const;

  private:
    void update_rest();

    std::vector<double> length_, radius_, mass_, bending_x_, torsion_, bending_damping_, torsion_damping_,
        drag_, friction_;
    std::vector<double> rest_darboux_;
    std::uint32_t first_bending_ = 0;
    double total_ = 0;
    Angulation angulation_;
    std::array<double, 2> wheel_{}, bending_{};
};

} // namespace calot::simulation
