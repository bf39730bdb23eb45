#pragma once

#include <vector>

namespace calot::bench {

/// The way in which the rod's tip is driven against a body in `press`: along one axis, by a spring and
/// damper.
struct PressScene {
    double tool_mass = 0, drive_stiffness = 0, drive_damping = 0, drive_limit = 0; ///< kg, N/m, N s/m, N
    double body_mass = 0, body_stiffness = 0, body_damping = 0;
    double gap = 0, depth = 0; ///< m: of the tool before the body; of the drive beyond the body's rest
    static constexpr double length = 2.2; ///< s

    /// Where the drive wants the tool, from 0, and how fast: in, held, three times out and in at 5 Hz, held,
    /// out.
    double target(double t) const;
    double target_velocity(double t) const;
};

/// What happens by rights: tool and body as one system of two masses that touch without bouncing, in steps of
/// 2 us (Moreau's time stepping: whatever velocity would part the gap's sign is taken away by an impulse
/// between the two). Samples are 1 / `rate` apart from time 0.
struct PressReference {
    std::vector<double> tool, force; ///< m, N (mean since the sample before)
};
PressReference press_reference(const PressScene& scene, double rate);

/// A lumped deformable body behind the contact law: a mass on a spring and damper that steps once every three
/// ticks, with the impulses of those three, and is seen three ticks later. In between, its surface is
/// foretold from what is seen by the same linear law and the impulses since, tick by tick.
class PressBody {
  public:
    PressBody(const PressScene& scene, double tick);
    double surface() const { return now_.x; } ///< m, at the tick's begin, beyond its rest
    double free_surface() const;              ///< m, at the tick's end without an impulse in it
    double compliance() const;                ///< m/(N s), at the tick's end
    void end_tick(double impulse);            ///< N s, on the body

  private:
    struct State {
        double x = 0, v = 0;
    };
    State stepped(State s, double dt, double impulse) const;

    PressScene scene_;
    double tick_;
    State seen_, now_;          // at the last third tick but one; at this tick
    std::vector<double> since_; // impulses since `seen_`
};

} // namespace calot::bench
