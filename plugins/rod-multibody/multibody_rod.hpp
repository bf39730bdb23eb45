// A rod as a chain of rigid bodies with bending and twisting springs between them, on Simbody.
#pragma once

#include "chain.hpp"

#include <calot/rod_model.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace calot::rod_multibody {

/// N-1 rigid cylinders, ball joints between them with springs EI/l and GJ/l, half cells at clamps. Linearly
/// implicit Euler steps: springs, friction, drag, what holds the ends and contacts are all solved with the
/// step's end in one recursion along the chain. Not thread-safe. step() may allocate (Simbody does).
class MultibodyRod {
  public:
    /// Parameters: substeps of a step, and the fastest speed at which overlap is taken back (m/s).
    MultibodyRod(const RodDescription& description, std::span<const double> parameters);

    void set_properties(const RodProperties& properties);
    void step(const calot_rod_input& input);
    bool is_finite() const;
    void stop();

    int nodes() const { return n_; }
    Vec3 position(int i) const;
    Vec3 velocity(int i) const;
    Quat frame(int j) const { return quat(chain_->body(j).orientation); }
    Vec3 angular_velocity(int j) const { return vec3(chain_->body(j).turning); }
    std::span<const Vec3> contact_impulses() const { return {impulse_.data(), contact_count_}; }
    Vec3 base_force() const { return base_force_; }
    Vec3 base_torque() const { return base_torque_; }
    Vec3 tip_force() const { return tip_force_; }
    Vec3 tip_torque() const { return tip_torque_; }
    double insertion() const;
    double base_roll() const { return roll_; }
    RodEnergies energies() const;

    std::size_t state_size() const;
    void save(std::span<double> state) const;
    bool load(std::span<const double> state);

  private:
    struct Contact;
    struct Memory {
        std::uint64_t id = 0;
        Vec3 stick;        // m
        double offset = 0; // m, not positive: overlap that carries no force
        double force = 0;  // N
        double share = 1;  // see Contact
    };
    struct Matrix3 {
        std::array<double, 9> m{};
        static Matrix3 outer(const Vec3& a, double scale);
        void operator+=(const Matrix3& o);
        Vec3 operator*(const Vec3& v) const;
    };

    void build();
    void update_joints();
    /// On the second frame, in the first one's, and its derivative by the turning between them.
    Vec3 joint_moment(int joint, const Quat& a, const Quat& b, Matrix3* stiffness, Matrix3* damping) const;
    Vec3 end_of(int body, double along) const;
    Vec3 point_velocity(int body, const Vec3& point) const;
    Vec3 point_velocity_after(int body, const Vec3& point) const;
    void push(int body, const Vec3& point, const Vec3& force, const Matrix3& resistance, double h);
    void act(int body, const Vec3& point, const Vec3& given, const Matrix3& resistance, double h);
    void turn(int body, const Vec3& given, const Matrix3& resistance, double h);
    void substep(double h, double progress);
    void assemble(double h, double progress);
    void assemble_base(double h, double progress);
    void assemble_tip(double h, double progress);
    void assemble_guide(double h);
    void assemble_contacts(double h);
    void limit_speed();
    bool judge_base();
    void prepare_contacts(const calot_rod_input& input);
    void begin_contacts(double h, double progress);
    bool judge_contacts(double h);
    void end_contacts(double h);
    void remember_contacts();
    template<class Rod, class F>
    static void visit_state(Rod& rod, F f);

    int n_ = 0, bodies_ = 0, substeps_ = 1;
    double dt_ = 1e-3, recovery_speed_ = 0.2;
    std::vector<double> length_, rest_darboux_;
    RodProperties properties_;
    calot_guide guide_{};
    std::unique_ptr<Chain> chain_;

    // Joints: N values; joint i lies at node i, between bodies i-1 and i, and at the ends between a body and
    // its clamp.
    std::vector<double> k1_, k2_, k3_, damping_12_, damping_3_, rest1_, rest2_, rest3_, cell_;
    // One substep's system.
    std::vector<double> joint_moments_, wrenches_, at_joint_, at_body_, right_, change_;

    calot_rod_end base_{}, tip_{};
    Vec3 gravity_, base_from_, tip_from_;
    Quat base_clamp_, tip_clamp_, base_clamp_from_, tip_clamp_from_;
    double roll_ = 0;
    bool has_overflowed_ = false; // in the last step
    Vec3 base_force_, base_torque_, tip_force_, tip_torque_;
    // What an end's holder does in this substep: given - resistance times the speed at its end.
    struct Held {
        Vec3 force, torque;
        Matrix3 resistance, turning_resistance;
    } base_held_, tip_held_;
    // The coupling's forces that are at their limit: their signs, else 0.
    double axial_limit_ = 0, roll_limit_ = 0;

    std::size_t contact_count_ = 0, row_count_ = 0, memory_count_ = 0;
    std::vector<Contact> rows_;
    std::vector<Memory> memory_;
    std::vector<Vec3> impulse_;
};

/// One contact in a step.
struct MultibodyRod::Contact {
    std::size_t index = 0;
    std::uint64_t id = 0;
    int body = 0, other = -1;
    double along = 0, other_along = 0; // m from the body's origin
    Vec3 normal, side, centre, motion; // side: across the rod, along the surface
    double gap = 0, friction = 0, radius = 0, other_radius = 0;
    double k_n = 0, k_t = 0; // N/m, the other side's compliance included
    double offset = 0, depth = 0;
    Vec3 stick; // m, from the point where the surfaces stick
    bool touches = false;
    double share = 1; // of k_t that acts: less than 1 while it slips
    double f_n = 0;
    Vec3 given, point, other_point;
    Matrix3 resistance;
    Vec3 impulse;
};

} // namespace calot::rod_multibody
