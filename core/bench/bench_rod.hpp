#pragma once

#include "host/instance.hpp"

#include <calot/abi/rod.h>
#include <calot/math.hpp>

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace calot::bench {

/// What a reference problem can be asked with. What is not given, the problem chooses. SI units.
struct RodOptions {
    std::string model;
    std::optional<int> nodes;
    std::optional<double> dt, bending, torsion, length, radius, mass_per_length;
    std::optional<double> load; ///< N for tip forces, N m for moments and torques
    std::optional<double> friction, angle;
    std::uint64_t seed = 1;
    std::optional<double> duration;    ///< s, of soaks
    std::optional<double> patience;    ///< s by the clock, of soaks: then it ends, and the rows say so
    std::string anatomy = "reference"; ///< of soaks: the name of a folder in assets/anatomy
    std::string endoscope;             ///< of soaks: a datasheet's file or name; empty: the usual one
    bool is_short = false;             ///< as a test of this program can wait for: fewer cases of the same
};

/// Makes an instance of the model at hand, created and initialised.
using MakeInstance = std::function<host::Instance()>;

/// A uniform rod: the numbers of a problem, complete.
struct UniformRod {
    int nodes = 100;
    double dt = 1e-3;
    double bending = 0.033, torsion = 0.44; ///< N m^2, a gastroscope's shaft
    double length = 1.0, radius = 0.0063;   ///< m
    double mass_per_length = 0.2;           ///< kg/m

    /// `defaults` with what the options give.
    static UniformRod of(const RodOptions& options, UniformRod defaults);
    static UniformRod of(const RodOptions& options) { return of(options, UniformRod{}); }
    /// For a problem that ends at rest. What it does not depend on, and is not given, is chosen so that it
    /// comes to rest in a sensible number of steps: mass per length, so that the lowest mode has at least 1
    /// rad/s, and dt, 1 ms or a tenth of the lowest mode's time.
    static UniformRod at_rest(const RodOptions& options, UniformRod defaults);
    static UniformRod at_rest(const RodOptions& options) { return at_rest(options, UniformRod{}); }
    /// Angular frequency of the lowest mode when clamped at one end: 3.516 sqrt(EI / (rhoA L^4)).
    double lowest_frequency() const;
};

/// Positions along a straight line from `base`, in the direction of the third axis of `orientation`.
std::vector<double> straight_line(const UniformRod& rod, const Vec3& base, const Quat& orientation);
/// The same frame for each segment.
std::vector<double> same_frames(const UniformRod& rod, const Quat& orientation);

/// Third axis to +x, second axis to +y.
inline const Quat along_x{0.70710678118654752, 0, 0.70710678118654752, 0};

/// A rod model behind the contract, driven step by step. Throws host::PluginError if a call fails.
class BenchRod {
  public:
    struct Setup {
        UniformRod rod;
        std::vector<double> position;     ///< 3N
        std::vector<double> frame;        ///< 4(N-1) or empty
        std::vector<double> rest_darboux; ///< 3(N-1) or empty
        double drag = 0;                  ///< 1/s: external drag over mass
        double bending_damping = 0;       ///< s
        double torsion_damping = 0;       ///< s
        double friction = 1;              ///< factor of each segment
        std::optional<calot_guide> guide;
        std::uint32_t max_contacts = 0;
    };
    BenchRod(const MakeInstance& make, Setup setup);

    calot_rod_input input{}; ///< of the next step; contacts are given to step()
    void clamp_base(const Vec3& position, const Quat& orientation);
    void clamp_tip(const Vec3& position, const Quat& orientation);
    void load_base(const Vec3& force, const Vec3& torque);
    void load_tip(const Vec3& force, const Vec3& torque);
    /// Drag over mass, 1/s, from now on.
    void set_drag(double drag);

    void step(std::span<const calot_contact> contacts = {});
    /// One step in as many parts as the rod takes it in: `find` tells the contacts of the state that a part
    /// begins with, which hold until a node has gone `farthest` (m). Impulses are then the last part's.
    void step_in_parts(const std::function<std::span<const calot_contact>()>& find, double farthest);
    /// Reads the present state without a step.
    void refresh();
    /// Steps until nothing moves faster than `speed` (m/s) for 20 steps and a third of the lowest mode's
    /// time, at most for `longest` seconds, though at least a hundred steps. Whether it came to rest.
    bool settle(double speed, double longest);

    int nodes() const { return setup_.rod.nodes; }
    const UniformRod& rod() const { return setup_.rod; }
    Vec3 position(int i) const { return vec3(&position_[3 * static_cast<std::size_t>(i)]); }
    Vec3 velocity(int i) const { return vec3(&velocity_[3 * static_cast<std::size_t>(i)]); }
    Quat frame(int j) const { return quat(&frame_[4 * static_cast<std::size_t>(j)]); }
    Vec3 angular_velocity(int j) const { return vec3(&angular_velocity_[3 * static_cast<std::size_t>(j)]); }
    Vec3 impulse(std::size_t k) const { return vec3(&impulse_[3 * k]); }
    std::vector<Vec3> positions() const; ///< of all nodes
    double top_speed() const;
    double arc_length() const;
    double energy() const;
    const calot_rod_output& output() const { return output_; }
    double seconds() const { return static_cast<double>(input.tick) * setup_.rod.dt; }

    /// The calot.cost/1 extension, or null.
    const calot_cost* cost() const;
    host::Instance& instance() { return instance_; }

  private:
    void take_part(std::span<const calot_contact> contacts);
    void check(calot_status status, const char* function) const;
    const calot_rod& functions() const { return *static_cast<const calot_rod*>(instance_.abi()->kind); }
    void* self() const { return instance_.abi()->self; }

    host::Instance instance_;
    Setup setup_;
    mutable calot_error error_{};
    calot_rod_output output_{};
    std::vector<double> position_, velocity_, frame_, angular_velocity_, impulse_, drag_;
};

/// Angle by which a cross-section at the loaded end is turned about the axis against one at the clamp, the
/// sum of the turns from frame to frame. A segment's frame is that of its middle, so half a segment is added
/// at either end.
double end_twist(const BenchRod& rod, const Quat& clamp);

} // namespace calot::bench
