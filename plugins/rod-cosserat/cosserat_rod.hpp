// The rod of CoRdE (Spillmann & Teschner 2007) made inextensible as in NOViSE (Korzeniowski et al. 2016).
#pragma once

#include "contact.hpp"

#include <calot/rod_model.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace calot::rod_cosserat {

/// Where the time of one step went, seconds.
struct StepTimes {
    double constraints = 0, contacts = 0, total = 0;
};

/// N mass points joined by N-1 segments, each with a material frame whose third axis is the segment's
/// direction (CoRdE's parallel constraint, eliminated instead of penalised). Not thread-safe; step()
/// allocates nothing.
class CosseratRod {
  public:
    static constexpr std::string_view cost_names[] = {"constraints", "contacts"};
    static constexpr double default_parameters[] = {
        1, 0.2}; ///< rounds in a substep; m/s, of taking overlap back

    /// `parameters`: as the plugin's table has them. The description is complete and usable.
    explicit CosseratRod(const RodDescription& description,
                         std::span<const double> parameters = default_parameters);

    /// Between steps; allocates nothing. Of the right sizes and usable.
    void set_properties(const RodProperties& properties);

    /// The unloaded shape from this pose of the base's cross-section, at rest.
    void reset(Vec3 base, Quat orientation);
    /// Positions (3N) and frames (4(N-1), unit), interleaved, at rest. Frames are turned the least so that
    /// their third axes are the segments' directions.
    void reset_to(std::span<const double> positions, std::span<const double> frames);
    /// Sets the velocities; 3N interleaved, or 3(N-1) for the angular ones, of which the axial part counts.
    void set_velocities(std::span<const double> linear, std::span<const double> angular);

    /// Advances by one step, or less where `farthest` ends it. False: no finite result was found, the rod
    /// stays where it was, without velocity.
    bool step(const RodStep& input);

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
    /// Accumulated about the guide, rad.
    double base_roll() const { return roll_; }
    RodEnergies energies() const;
    /// Length along the centreline, m.
    double arc_length() const;
    StepTimes times() const { return times_; }
    void measure_costs(bool on) { timing_ = on; }
    double cost(std::size_t part) const { return part == 0 ? times_.constraints : times_.contacts; }

    /// Everything that steers the future, as scalars; the same build resumes to the same bits.
    std::size_t state_size() const;
    void save(std::span<double> state) const;
    /// False, and nothing changed, if the size is wrong or a value is not finite.
    bool load(std::span<const double> state);

  private:
    using Array = std::vector<double>;

    void prepare(const RodStep& input);
    void substep(double h, int index);
    bool is_far_enough(double further) const;
    double worst_growth(double h, double progress) const;
    void update_joints();
    void update_guide();
    double longest_stable(bool is_base_clamped, bool is_tip_clamped);
    double stable_under_tension() const;
    void choose_substeps();
    void note_tension(double h, int substeps);
    void factor_twist(double h);
    void directions();
    void elastic_moments(double h, bool advance);
    void twist_moments(double ahead, std::span<const double> spin);
    void elastic_forces();
    void joint_moments(double h, bool advance);
    Vec3 joint_moment(int joint, const Quat& a, const Quat& b) const;
    void kick(double h, double fraction, double progress);
    void drift(double h, double progress);
    void hold_to_axis();
    void project_lengths(double h);
    double solve_lengths(double h);
    bool solve_tensions();
    bool keep_lengths(Array& vx, Array& vy, Array& vz);
    void limit_speed(double h);
    double twist(double h, double progress, std::span<double> spin) const;
    void turn_frames(double h);
    void hold_end(bool base, double progress);
    void publish(double dt);
    void come_to_rest();
    bool all_finite() const;
    template<class Rod, class F>
    static void visit_state(Rod& rod, F f);

    // contacts.cpp
    bool can_touch(const RodContact& contact) const;
    void prepare_contacts();
    void prepare_response(ContactRow& row);
    void move_along_normal(const ContactRow& row, double way, double rate);
    void begin_contacts(double h, double progress);
    void solve_contacts(double h, double progress);
    void end_contacts(double h);
    void add_contact_kick(double time);
    void remember_contacts();
    Vec3 contact_point(const ContactRow& row) const;

    int n_ = 0, iterations_ = 1;
    double recovery_speed_ = 0.2;
    double top_speed_ = 0.0; // of any node at the tick's begin
    int substeps_ = 1;

    // Nodes: N values.
    Array x_, y_, z_, vx_, vy_, vz_, out_vx_, out_vy_, out_vz_, fx_, fy_, fz_, mass_, w_, node_drag_, slow_;
    // Segments: N-1 values.
    Array qw_, qx_, qy_, qz_, length_, inverse_length_, spin_, next_spin_, polar_, torque_, slow_spin_;
    Array mass_per_length_, radius_, bending_1_, bending_2_, torsion_, bending_damping_, torsion_damping_,
        drag_, friction_;
    // Segments with a zero on either side: segment j at j+1. t is the direction at the substep's start;
    // pulled_ sums lambda_ over the tick.
    Array tx_, ty_, tz_, lambda_, pulled_, couple_x_, couple_y_, couple_z_;
    // Joints: N values; joint i lies at node i, between segments i-1 and i. u is the Darboux vector, k its
    // stiffness.
    Array k1_, k2_, k3_, rest1_, rest2_, rest3_, last_u1_, last_u2_, rate1_, rate2_, per_cell_,
        per_twist_cell_, viscosity_, twist_viscosity_, gx_, gy_, gz_;
    // The tri-diagonal systems.
    Array lower_, diagonal_, upper_, right_, pivot_, twist_diagonal_, twist_off_, twist_unit_;

    Array rest_darboux_;
    RodStep now_;
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
    double tension_stiffness_ =
        0; // 1/s^2, of the last tick: the most that tension adds to a node's squared frequency
    double last_substep_ = 0; // s
    double slowed_for_ = 0;   // s, the substep that drag's factors are of
    double elapsed_ = 0;      // s

    // Contacts of this tick, and the memory that carries stick from tick to tick.
    std::size_t contact_count_ = 0, row_count_ = 0;
    std::vector<ContactRow> rows_;
    static constexpr int most_responses = 4;
    std::array<Response, most_responses> response_;
    int responses_ = 0;
    std::vector<Vec3> impulse_;
    std::vector<ContactMemory> memory_;
    std::size_t memory_count_ = 0;

    Array saved_;
    bool timing_ = false;
    StepTimes times_;
};

} // namespace calot::rod_cosserat
