// An endoscope as a chain: how its datasheet becomes segments, how its wheels bend it, what warmth and
// instruments change, where its camera is.
#pragma once

#include "geometry/vec3.hpp"
#include "simulation/endoscope_chain.hpp"
#include "simulation/endoscope_datasheet.hpp"
#include "simulation/endoscope_wires.hpp"

#include <calot/abi/plugin.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace calot::simulation {

/// What lies in a working channel: from the handle to `reach` metres along the working length.
struct ChannelContent {
    double flexural_rigidity = 0; // N m2, added to the shaft's
    double mass_per_length = 0;   // kg/m, likewise
    double reach = 0;             // m; 0: the channel is empty
};

class Endoscope {
  public:
    /// `nodes` from 20 to 2000. Throws std::invalid_argument.
    Endoscope(const EndoscopeDatasheet& sheet, std::uint32_t nodes);

    std::uint32_t nodes() const { return static_cast<std::uint32_t>(room_.length.size() + 1); }
    std::uint32_t first_bending_segment() const { return room_.first_bending; }
    double length() const { return total_; }                         // m
    std::span<const double> lengths() const { return room_.length; } // N-1, m
    std::span<const double> radii() const { return room_.radius; }   // N-1, m
    std::size_t channels() const { return content_.size(); }
    calot_rod_segments segments() const; // as they are now; spans live as long as this

    /// What lies in a channel from now on; the segments follow at the next condition(). An instrument slides
    /// in its channel, so it adds nothing to the torsional rigidity. Real-time. Throws std::out_of_range.
    void set_channel(std::size_t channel, const ChannelContent& content);
    /// Segments from `first_inside` on have body temperature: before the first condition().
    void start_warm(std::size_t first_inside);
    /// Lets `dt` seconds pass: segments from `first_inside` on warm up, the others cool down; with the twist
    /// of `frame` (4(N-1)), GJ is that of its direction; with the channels' contents EI and mass. True when
    /// segments() changed by more than two thousandths, so that the rod is to be told. Real-time.
    bool condition(std::size_t first_inside, std::span<const double> frame, double dt);

    /// Turns the wheels (rad; up (+), left (+)) for `dt` seconds, at most at their fastest, with the bending
    /// section as it is in `frame`. A braked wheel does not move. Real-time.
    void steer(const double wheel[2], const std::uint32_t brake[2], std::span<const double> frame, double dt);
    /// The balance of a free bending section, friction and slack in their middle.
    void set_bending(const double wheel[2]);
    /// Angulation of the bending section in `frame`, rad: up (+), left (+).
    std::array<double, 2> angulation(std::span<const double> frame) const;
    /// 3(N-1), 1/m: curvatures at which the wires' moments are in balance with the section's rigidity.
    /// Bending up is a turn about -x, left about +y.
    std::span<const double> rest_darboux() const { return rest_darboux_; }
    /// N m that the wires exert on the section, up (+), left (+).
    std::array<double, 2> wire_moment() const { return {wires_[0].moment(), wires_[1].moment()}; }
    /// N m at the wheels that hold the wires (up, left).
    std::array<double, 2> wheel_torque() const;

    /// The camera, at the last node, looking along the last segment. `position` 3N, `frame` 4(N-1).
    calot_pose camera(std::span<const double> position, std::span<const double> frame) const;
    calot_twist camera_twist(std::span<const double> velocity, std::span<const double> angular) const;

    /// Lays the nodes on the line: from `insertion` metres along `path` (from the guide's exit on) backwards,
    /// a segment's length from one to the next, and on into the guide. Returns 3N coordinates. Throws
    /// std::invalid_argument when the path or the endoscope is shorter than the insertion.
    std::vector<double> laid_along(const calot_guide& guide, std::span<const geometry::Vec3> path,
                                   double insertion) const;
    /// Frames for such nodes without twist, the base turned by `rotation` from y nearest to world -y. 4(N-1).
    std::vector<double> frames_along(std::span<const double> position, double rotation) const;

  private:
    double section_stiffness() const;
    void update_rest();
    double twist_side(std::span<const double> frame, std::size_t segment) const;

    ShaftChain room_; // at room temperature, channels empty
    Angulation angulation_;
    Warmth warmth_;
    double torque_asymmetry_ = 0;
    double total_ = 0;
    double bent_length_ = 0;  // m, of the bending section
    double joint_length_ = 0; // m, of the segments whose rest curvature bends it
    double rate_ = 0;         // 1/s, of wheel and section
    std::vector<ChannelContent> content_;

    std::vector<double> warm_; // 0 room to 1 body, by segment
    std::vector<double> added_bending_, added_mass_;
    std::vector<double> mass_, bending_, torsion_; // as the rod knows them
    std::vector<double> rest_darboux_;
    std::array<double, 2> wheel_{}, command_{};
    std::array<WirePair, 2> wires_;
};

} // namespace calot::simulation
