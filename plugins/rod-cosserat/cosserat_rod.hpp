// The rod of CoRdE (Spillmann & Teschner 2007) made inextensible as in NOViSE (Korzeniowski et al. 2016).
#pragma once

#include "contact.hpp"
#include "frame_math.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace calot::rod_cosserat {

/// Properties of each of the N-1 segments, SI units. As an argument of set_properties: an empty one stays as
/// it is.
struct SegmentProperties {
    std::span<const double> mass_per_length; ///< kg/m
    std::span<const double> radius;          ///< m; the polar inertia is that of a solid section, m r^2 / 2
    std::span<const double> bending_1;       ///< EI about the frame's first axis, N m^2
    std::span<const double> bending_2;       ///< EI about the frame's second axis, N m^2
    std::span<const double> torsion;         ///< GJ, N m^2
    std::span<const double>
        bending_damping; ///< s; Kelvin-Voigt time, moment = EI (u - u_rest + time du/dt). Acts up to
    ///< 5/12 of the substep of the undamped rod, some 40 us at 1 cm spacing: an explicit step bears no more
    std::span<const double> torsion_damping; ///< s; likewise for twist
    std::span<const double> drag;     ///< N s/m^2; outer drag per length; spin is slowed at the same rate
    std::span<const double> friction; ///< factor on the other side's coefficient
};

struct RodDescription {
    int nodes = 0;                ///< N, from 3
    std::vector<double> length;   ///< N-1, m, between neighbouring nodes
    SegmentProperties properties; ///< all of them; read at construction only
    int max_contacts = 256;
    double recovery_speed = 0.2; ///< m/s; the fastest a penetration is pushed out
    int iterations = 1;          ///< global lengths, then local contacts, this often in each substep
};

/// What is wrong, as the field's name and a sentence; or null.
struct Complaint {
    const char* field;
    const char* message;
    std::size_t index;
};

enum class EndMode {
    free,    ///< nothing holds it
    clamped, ///< pose prescribed; moves linearly to `position`, `orientation` within the tick
    loaded,  ///< force and torque, constant in the world
    coupled, ///< base only: one-dimensional springs along and about the guide's direction
};

/// A capped spring-damper on one coordinate, evaluated in every substep and implicitly about the axis.
struct Coupling {
    double target = 0.0;   ///< m or rad, at the tick's begin
    double velocity = 0.0; ///< m/s or rad/s of the target
    double stiffness = 0.0, damping = 0.0;
    double cap = 0.0; ///< N or N m
};

struct End {
    EndMode mode = EndMode::free;
    Vec3 position;
    Quat orientation;
    Vec3 force, torque;
    Coupling axial, roll;
};

/// A straight frictionless sleeve. Material with (x - origin) . direction < 0 lies on its axis.
struct Guide {
    bool present = false;
    Vec3 origin, direction{0, 0, 1};
};

struct StepInput {
    double dt = 1e-3;      ///< s, the tick
    double farthest = 0.0; ///< m; the step ends with the substep in which a node has gone so far; 0: never
    Vec3 gravity;          ///< m/s^2
    End base, tip;
    Guide guide;
    std::span<const double> rest_darboux; ///< 3(N-1), 1/m; empty: unchanged since the last tick
    std::span<const Contact> contacts;    ///< at most max_contacts; those beyond are ignored
};

struct Energies {
    double kinetic = 0, bending = 0, twist = 0, gravity = 0;
    double total() const { return kinetic + bending + twist + gravity; }
};

enum class StepResult { ok, invalid_input, recovered };

/// Where the time of one step went, seconds.
struct StepTimes {
    double constraints = 0, contacts = 0, total = 0;
};

/// N mass points joined by N-1 segments, each with a material frame whose third axis is the segment's
/// direction (CoRdE's parallel constraint, eliminated instead of penalised). Not thread-safe; step()
/// allocates nothing.
class CosseratRod {
  public:
    /// Throws std::invalid_argument that names the field and what is wrong with it.
    explicit CosseratRod(const RodDescription& description);

    /// Between steps; allocates nothing. A complaint: nothing has changed.
    std::optional<Complaint> set_properties(const SegmentProperties& properties);
    /// Intrinsic curvature and twist, 3(N-1) material components, 1/m. False if the size is wrong or not
    /// finite.
    bool set_rest_darboux(std::span<const double> darboux);

    /// The unloaded shape from this pose of the base's cross-section, at rest.
    void reset(Vec3 base, Quat orientation);
    /// Positions (3N) and frames (4(N-1), unit), interleaved, at rest. Frames are turned the least so that
    /// their third axes are the segments' directions. Throws std::invalid_argument.
    void reset_to(std::span<const double> positions, std::span<const double> frames);
    /// Sets the velocities; 3N interleaved, or 3(N-1) for the angular ones, of which the axial part counts.
    void set_velocities(std::span<const double> linear, std::span<const double> angular);

    /// Advances by one tick, or less where `farthest` ends it. invalid_input: nothing changed. recovered: a
    /// non-finite value appeared, the rod stays where it was, without velocity.
    StepResult step(const StepInput& input);

    int nodes() const { return n_; }
    int segments() const { return n_ - 1; }
    /// Substeps of the last tick, chosen from the stiffest node.
    int substeps() const { return substeps_; }

    Vec3 position(int i) const { return {x_[i], y_[i], z_[i]}; }
    Vec3 velocity(int i) const { return {out_vx_[i], out_vy_[i], out_vz_[i]}; }
    Quat frame(int j) const { return {qw_[j], qx_[j], qy_[j], qz_[j]}; }
    /// World frame, rad/s, at the end of the last tick.
    Vec3 angular_velocity(int j) const;
    /// Frame of the loaded end's cross-section: the last segment's, turned on by its own half length.
    Quat tip_frame() const;
    Quat base_frame() const;

    /// s that the last step took.
    double elapsed() const { return elapsed_; }
    /// N s over the last tick, on the rod; parallel to the contacts given.
    std::span<const Vec3> contact_impulses() const { return {impulse_.data(), contact_count_}; }
    /// Mean over the last tick of what the base's holder (clamp, coupling or load) exerted on the rod.
    Vec3 base_force() const { return base_force_; }
    Vec3 base_torque() const { return base_torque_; }
    Vec3 tip_force() const { return tip_force_; }
    Vec3 tip_torque() const { return tip_torque_; }
    /// Axial coordinate of the base in the guide (m) and accumulated roll about it (rad).
    double base_advance() const { return advance_; }
    double base_roll() const { return roll_; }
    Energies energies() const;
    /// Length along the centreline, m.
    double arc_length() const;
    StepTimes times() const { return times_; }
    void measure_times(bool on) { timing_ = on; }

    /// Everything that steers the future, as scalars; the same build resumes to the same bits.
    std::size_t state_size() const;
    void save(std::span<double> state) const;
    /// False, and nothing changed, if the size is wrong or a value is not finite.
    bool load(std::span<const double> state);

  private:
    using Array = std::vector<double>;

    bool acceptable(const StepInput& input) const;
    void prepare(const StepInput& input);
    void substep(double h, int index);
    bool is_far_enough(double further) const;
    double worst_growth(double h, double progress) const;
    void update_joints();
    void update_guide();
    double longest_stable(bool is_base_clamped, bool is_tip_clamped);
    void choose_substeps();
    void factor_twist(double h);
    void directions();
    void elastic_forces(double h, bool advance);
    void joint_moments(double h, bool advance);
    Vec3 joint_moment(int joint, const Quat& a, const Quat& b) const;
    void kick(double h, double fraction, double progress);
    void drift(double h, double progress);
    void hold_to_axis();
    void project_lengths(double h);
    double solve_lengths(double h);
    void limit_speed(double h);
    void twist(double h, double progress);
    void turn_frames(double h);
    void hold_end(bool base, double progress);
    void publish(double dt);
    void come_to_rest();
    bool all_finite() const;
    template<class Rod, class F>
    static void visit_state(Rod& rod, F f);

    // contacts.cpp
    bool can_touch(const Contact& contact) const;
    void prepare_contacts();
    void begin_contacts(double h, double progress);
    void solve_contacts(double h, double progress);
    void end_contacts(double h);
    void remember_contacts();
    Vec3 contact_point(const ContactRow& row) const;

    int n_ = 0, iterations_ = 1;
    double recovery_speed_ = 0.2;
    double top_speed_ = 0.0; // of any node at the tick's begin
    int substeps_ = 1;

    // Nodes: N values.
    Array x_, y_, z_, vx_, vy_, vz_, out_vx_, out_vy_, out_vz_, fx_, fy_, fz_, mass_, w_, node_drag_, slow_;
    // Segments: N-1 values.
    Array qw_, qx_, qy_, qz_, length_, inverse_length_, spin_, polar_, torque_, slow_spin_;
    Array mass_per_length_, radius_, bending_1_, bending_2_, torsion_, bending_damping_, torsion_damping_,
        drag_, friction_;
    // Segments with a zero on either side: segment j at j+1. t is the direction at the substep's start.
    Array tx_, ty_, tz_, lambda_, couple_x_, couple_y_, couple_z_;
    // Joints: N values; joint i lies at node i, between segments i-1 and i. u is the Darboux vector, k its
    // stiffness.
    Array k1_, k2_, k3_, rest1_, rest2_, rest3_, last_u1_, last_u2_, rate1_, rate2_, per_cell_,
        per_twist_cell_, viscosity_, twist_viscosity_, gx_, gy_, gz_;
    // The tri-diagonal systems.
    Array lower_, diagonal_, upper_, right_, twist_diagonal_, twist_off_, twist_unit_;

    Array rest_darboux_;
    StepInput now_;
    Quat base_clamp_, tip_clamp_, base_clamp_from_, tip_clamp_from_;
    Vec3 base_from_, tip_from_;
    double advance_ = 0, roll_ = 0;
    Vec3 base_force_, base_torque_, tip_force_, tip_torque_;

    // The guide: nodes [0, on_axis_) lie on its axis; node on_axis_ is drawn to it by mouth_stiffness_.
    int on_axis_ = 0;
    double mouth_stiffness_ = 0;
    double half_kick_ =
        0.5; // 0.5 in the first substep after a reset, when velocities and positions are of one time
    // The longest substep, and what it was found for.
    struct Choice {
        bool is_base_clamped, is_tip_clamped;
        bool operator==(const Choice&) const = default;
    };
    std::optional<Choice> chosen_;
    double longest_stable_ = 0, viscosity_cap_ = 0; // s
    double slowed_for_ = 0;                         // s, the substep that drag's factors are of
    double elapsed_ = 0;                            // s

    // Contacts of this tick, and the memory that carries stick from tick to tick.
    std::size_t contact_count_ = 0, row_count_ = 0;
    std::vector<ContactRow> rows_;
    std::vector<Vec3> impulse_;
    std::vector<ContactMemory> memory_;
    std::size_t memory_count_ = 0;

    Array saved_;
    bool timing_ = false;
    StepTimes times_;
};

} // namespace calot::rod_cosserat
