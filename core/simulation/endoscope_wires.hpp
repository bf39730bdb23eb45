// One wheel and the two wires by which it pulls the bending section one way or the other.
#pragma once

namespace calot::simulation {

/// A wheel turned by `command` (as angulation, rad) stretches a wire by as much as the section lags behind,
/// less the slack between the two wires; the stretched wire gives a moment, up to what the wheel can pull.
/// Friction between wheel and section (the wires' coils rub all along the shaft) keeps the moment on the
/// section where it is while the wire's own is within `friction` of it: so the section stays bent when the
/// wheel turns back, and lags whichever way it turns. What angle a moment reaches is for the section's
/// flexural rigidity, and whatever lies in its channels and before its tip, to say.
class WirePair {
  public:
    struct Figures {
        double stiffness = 0;  // N m/rad
        double pull_limit = 0; // N m
        double friction = 0;   // N m
        double slack = 0;      // rad
    };
    WirePair() = default;
    explicit WirePair(const Figures& figures) : f_(figures) {}

    /// After `dt` seconds with the wheel at `command` and the section at `angle` (rad). `section_stiffness`
    /// (N m/rad) is that of the section itself; with it the moment is let follow so slowly that wheel and
    /// section together approach their balance at `rate` (1/s). The wires know the section's angle one tick
    /// late, and are stiffer than it by an order: faster than the section's own damping they would shake it.
    void step(double command, double angle, double section_stiffness, double rate, double dt);
    /// The balance of a free section, with the friction in its middle.
    void balance(double command, double section_stiffness);

    double moment() const { return moment_; } // N m, on the section
    double pull() const { return pull_; }     // N m, at the wheel, for each rad of angulation

  private:
    Figures f_;
    double moment_ = 0, pull_ = 0;
};

} // namespace calot::simulation
