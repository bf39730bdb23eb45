// The stretchable rod of CoRdE (Spillmann & Teschner, SCA 2007), explicit in everything.
#pragma once

#include <calot/rod_model.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace calot::rod_corde {

/// What the plugin's parameters set; 0 lets the rod choose.
struct Settings {
    double stretch_modulus = 0;      ///< Pa, E_s; 0: the highest that the substep of bending and twist bears
    double parallel_penalty = 0;     ///< N, kappa; 0: likewise
    double internal_friction = 2e-5; ///< s, of stretch and of frames against their edges: force = K tau rate
    double recovery_speed = 0.2;     ///< m/s, the fastest at which an overlap that was given is taken back
};

/// N mass points, N-1 material frames between them. A frame is tied to its edge by CoRdE's penalty, lengths
/// are springs. Leapfrog with substeps; contacts are springs with Coulomb friction. Not thread-safe; step()
/// allocates nothing.
class CordeRod {
  public:
    CordeRod(const RodDescription& description, std::span<const double> parameters);
    CordeRod(const RodDescription& description, const Settings& settings);

    void set_properties(const RodProperties& properties);
    void step(const calot_rod_input& input);
    bool is_finite() const;
    void stop();

    int nodes() const { return n_; }
    int substeps() const { return substeps_; }
    Vec3 position(int i) const { return {x_[i], y_[i], z_[i]}; }
    Vec3 velocity(int i) const { return {vx_[i], vy_[i], vz_[i]}; }
    Quat frame(int j) const { return {qw_[j], qx_[j], qy_[j], qz_[j]}; }
    /// World frame, rad/s.
    Vec3 angular_velocity(int j) const { return rotate(frame(j), {o1_[j], o2_[j], o3_[j]}); }
    std::span<const Vec3> contact_impulses() const { return {impulse_.data(), contact_count_}; }
    Vec3 base_force() const { return base_force_; }
    Vec3 base_torque() const { return base_torque_; }
    Vec3 tip_force() const { return tip_force_; }
    Vec3 tip_torque() const { return tip_torque_; }
    double insertion() const;
    double base_roll() const { return roll_; }
    RodEnergies energies() const;
    /// J, in the springs of length and of the parallel constraint; counted with bending in energies().
    double constraint_energy() const;
    double arc_length() const;
    /// N, K_s = E_s pi r^2 of a segment, as used.
    double stretch_stiffness(int j) const { return stretch_[j]; }

    std::size_t state_size() const;
    void save(std::span<double> state) const;
    bool load(std::span<const double> state);

  private:
    using Array = std::vector<double>;
    struct Contact;
    struct Memory {
        std::uint64_t id = 0;
        Vec3 stick;        // m, from the point where the surfaces stick
        double offset = 0; // m, not positive: overlap that carries no force
        double force = 0;  // N, normal
    };

    void update_joints();
    void choose_substeps();
    void update_guide();
    void hold_to_axis();
    void joint_moments();
    Vec3 joint_moment(int joint, const Quat& a, const Quat& b) const;
    void forces(double progress);
    void sleeve_forces();
    void kick(double h);
    void drift(double h, double progress);
    void drive_base(double h, double progress);
    void limit_speed();
    template<class Rod, class F>
    static void visit_state(Rod& rod, F f);

    // contacts.cpp
    void prepare_contacts(const calot_rod_input& input);
    void contact_forces(double progress);
    void remember_contacts();

    int n_ = 0, substeps_ = 1;
    double dt_ = 1e-3;
    Settings settings_;
    calot_guide guide_{};
    RodProperties properties_;

    // Nodes.
    Array x_, y_, z_, vx_, vy_, vz_, fx_, fy_, fz_, mass_, w_, slow_;
    // Segments: frames, angular velocity and torque in the frame, inertia across and along.
    Array qw_, qx_, qy_, qz_, o1_, o2_, o3_, t1_, t2_, t3_, length_, across_, along_, slow_spin_, stretch_,
        penalty_;
    Array px_, py_, pz_; // force on the base-side node; N+1 values, segment j at j+1, zero on either side
    // Joints: joint i lies at node i between segments i-1 and i.
    Array k1_, k2_, k3_, rest1_, rest2_, rest3_, cell_, per_cell_, gx_, gy_, gz_;
    // Internal friction: N m s of a joint's bending and twisting, N s/m of an edge's length, N m s of a frame
    // against its edge.
    Array bend_friction_, twist_friction_, stretch_friction_, shear_friction_;
    Array rest_darboux_;

    calot_rod_end base_{}, tip_{};
    Vec3 gravity_, base_from_, tip_from_;
    Quat base_clamp_, tip_clamp_, base_clamp_from_, tip_clamp_from_;
    double roll_ = 0;
    Vec3 base_force_, base_torque_, tip_force_, tip_torque_;
    int on_axis_ = 0;
    double mouth_stiffness_ = 0;

    std::size_t contact_count_ = 0, row_count_ = 0, memory_count_ = 0;
    std::vector<Contact> rows_;
    std::vector<Memory> memory_;
    std::vector<Vec3> impulse_;
    std::vector<int> touching_; // contacts of each node
};

/// One contact, prepared for a step.
struct CordeRod::Contact {
    std::size_t index = 0; // in the list given
    std::uint64_t id = 0;
    int segment = 0, other = -1;
    double wa = 0, wb = 0, other_wa = 0, other_wb = 0;
    Vec3 normal, e1, e2; // e1 along the rod, e2 about it
    Vec3 centre, motion; // at the query; of the other side over the step
    double gap = 0, friction = 0, radius = 0, other_radius = 0;
    double c_n = 0, c_1 = 0, c_2 = 0, c_n1 = 0, c_n2 = 0, c_12 = 0; // m/N, the springs' own included
    double damping_n = 0, damping_t = 0, film_limit = 0;            // N s/m
    double offset = 0, stick_1 = 0, stick_2 = 0, f_n = 0;
    Vec3 impulse;
};

} // namespace calot::rod_corde
