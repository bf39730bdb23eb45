// A serial chain of rigid bodies on Simbody, behind plain numbers: Simbody's headers do not compile as C++20
// and crash with NDEBUG, so chain.cpp alone sees them.
#pragma once

#include <memory>

namespace calot::rod_multibody {

/// One body as it is now, in the world; its origin is the end nearer to the base, its z axis runs along it.
struct BodyMotion {
    double orientation[4]; ///< unit quaternion w, x, y, z
    double origin[3];      ///< m
    double turning[3];     ///< rad/s
    double velocity[3];    ///< m/s, of the origin
};

/// Solid cylinders; the first moves freely, each other turns about the end of the one before it (a ball
/// joint). Motions are 6 numbers for the first body (turning and velocity of its origin, in the world) and 3
/// for each other (its turning against the body before it, in that one's frame). Simbody allocates now and
/// then.
class Chain {
  public:
    struct Body {
        double length, mass, radius; ///< m, kg, m
    };
    /// `count` bodies.
    Chain(int count, const Body* bodies);
    ~Chain();
    Chain(const Chain&) = delete;
    Chain& operator=(const Chain&) = delete;

    int motions() const; ///< 6 + 3 (count - 1)
    /// Places it: the first body's origin and orientations (4 for each body) in the world, and its motion.
    void place(const double* origin, const double* orientations, const double* motion);
    /// Everything below is of the last place or advance.
    const BodyMotion& body(int k) const;
    const double* motion() const;
    /// Its coordinates (a position and quaternions, 7 + 4 (count - 1)), with the motion all that there is to
    /// keep.
    int coordinates() const;
    void read(double* coordinates) const;
    void restore(const double* coordinates, const double* motion);
    /// For a body's momentum about its origin: angular, linear.
    void momentum(int k, double* six) const;
    double kinetic_energy() const;

    /// Coriolis forces less what `wrenches` (6 for each body: torque about its origin, force; world) and
    /// `joint_moments` (one for each motion) do, as forces on the motions.
    void residual(const double* joint_moments, const double* wrenches, double* out) const;
    /// Solves (M + S) x = right over all motions by the articulated-body recursion, O(count). M is the
    /// chain's mass matrix; S adds `at_joint` (9, row-major, for each body from the second on) to the motions
    /// of joints and `at_body` (36, row-major, for each) to the bodies' spatial inertia about their origins.
    void solve(const double* at_joint, const double* at_body, const double* right, double* x) const;
    /// What the last solve's x does to a body: turning, and velocity of its origin (6, world).
    const double* body_change(int k) const;
    /// motion += change, then the chain moves with it for h seconds.
    void advance(double h, const double* change);

  private:
    struct Inside;
    std::unique_ptr<Inside> in_;
};

} // namespace calot::rod_multibody
