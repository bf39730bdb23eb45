// The closed loop: from what the screen shows and the hands feel to how fast the hands move.
#pragma once

#include <calot/math.hpp>
#include <calot/state.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace calot::virtual_operator {

/// What the pilot looks at. m, N; world frame.
struct Sight {
    calot_pose view{};          // camera: +z looks forward, +y is up and +x left on the screen
    double insertion_force = 0; // N on the hand, + outwards of the patient
    std::span<const Vec3> path; // marked way; may be empty
    bool has_ring = false;
    Vec3 ring_centre, ring_normal; // the normal points the way to go through
    double ring_radius = 0;
};

/// How fast the hands are to move.
struct Rates {
    double insertion = 0;          // m/s
    double rotation = 0;           // rad/s
    std::array<double, 2> wheel{}; // rad/s: up, left
};

/// Where the hands have brought the controls.
struct Hands {
    double insertion = 0;          // m
    std::array<double, 2> wheel{}; // rad
};

/// How well someone steers.
struct Skill {
    double push_speed = 0.03;      // m/s, in a lumen
    double approach_speed = 0.010; // m/s, towards the ring
    double steer_gain = 1.2;       // 1/s: wheel rate for each angle between the view's axis and the aim
    double patience = 2.0;         // s without progress before drawing back
    double gentle_force = 8;       // N: from here on slower,
    double most_force = 16;        // N: and here not at all
};

class Pilot {
  public:
    void configure(const Skill& skill) { skill_ = skill; }
    void reset() { state_ = {}; }
    /// One step of `dt` seconds. Real-time.
    Rates step(const Sight& sight, const Hands& hands, double dt);

    void save(StateWriter& to) const;
    void load(StateReader& from);

  private:
    enum class Mode : std::uint32_t { follow, through, withdraw };

    struct State {
        Mode mode = Mode::follow;
        double progress = -1;    // m along the path; -1: not known yet
        double best = -1;        // m: the farthest so far that counts as progress
        double idle_seconds = 0; // since then, while pushing
        double withdraw_to = 0;  // m of insertion
        std::uint32_t tries = 0;
    };

    double find_progress(const Sight& sight) const;
    Vec3 aim(const Sight& sight, double height) const;
    double needed_bend(const Sight& sight, const Vec3& target) const;
    Rates withdraw(const Hands& hands);

    Skill skill_;
    State state_;
};

/// Point of a polyline at `along` m from its beginning; beyond an end, on its extension. Real-time.
Vec3 point_at(std::span<const Vec3> line, double along);
/// m. Real-time.
double length(std::span<const Vec3> line);
/// Angle from the view's axis to a point, as (up, left) components, rad. Real-time.
std::array<double, 2> bearing(const calot_pose& view, const Vec3& point);

} // namespace calot::virtual_operator
