// A dynamic, inextensible and unshearable rod, implicit in time, solved directly in linear time.
#pragma once

#include "chain_solver.hpp"
#include "contact.hpp"
#include "frame_math.hpp"

#include <calot/rod_model.hpp>

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace calot::rod_direct {

/// What is taken of a step: all, or a part of it.
struct StepPart : RodStep {
    double share = 1.0; ///< of the contacts' motion and compliance: they are of a step longer by its inverse
    double from = 0.0;  ///< of the step, is over: as much of the contacts' motion
    double delay = 1.0; ///< how old the contacts' normals are, in such parts
};

/// Where the time of one step went, seconds, and how much of it there was.
struct StepTimes {
    double assembly = 0, solve = 0, contacts = 0;
    int linearisations = 0, solves = 0;
};

/// N mass points joined by N-1 rigid segments, each with a material frame whose third axis is its direction.
/// A step is implicit Euler: rotation increments and section forces of all segments are solved for at once,
/// with the contacts' forces. Not thread-safe; step() allocates nothing.
class DirectRod {
  public:
    static constexpr std::string_view cost_names[] = {"assembly", "solve", "contacts"};
    static constexpr double default_parameters[] = {0.2}; ///< m/s, of taking overlap back

    /// `parameters`: as the plugin's table has them. The description is complete and usable.
    explicit DirectRod(const RodDescription& description,
                       std::span<const double> parameters = default_parameters);

    /// Between steps; allocates nothing. Of the right sizes and usable.
    void set_properties(const RodProperties& properties);

    /// Positions (3N) and frames (4(N-1), unit), interleaved, at rest. Frames are turned the least so that
    /// their third axes are the segments' directions; nodes beyond the first are then laid out from the
    /// first with the segments' lengths.
    void reset_to(std::span<const double> positions, std::span<const double> frames);

    /// Advances by one step, or less where `farthest` ends it. False: no finite result was found, the rod
    /// stays where it was, without velocity.
    bool step(const RodStep& input);

    int nodes() const { return n_; }
    int segments() const { return m_; }

    Vec3 position(int i) const { return {x_[0][at(i)], x_[1][at(i)], x_[2][at(i)]}; }
    Vec3 velocity(int i) const { return {v_[0][at(i)], v_[1][at(i)], v_[2][at(i)]}; }
    Quat frame(int j) const {
        return {q_[0][at(j + 1)], q_[1][at(j + 1)], q_[2][at(j + 1)], q_[3][at(j + 1)]};
    }
    /// World frame, rad/s, at the end of the last tick.
    Vec3 angular_velocity(int j) const {
        return in_world(frame(j), {spin_[0][at(j)], spin_[1][at(j)], spin_[2][at(j)]});
    }

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
    StepTimes costs() const { return times_; }
    void measure_costs(bool on) { timing_ = on; }
    double cost(std::size_t part) const {
        return part == 0 ? times_.assembly : part == 1 ? times_.solve : times_.contacts;
    }

    /// Everything that steers the future, as scalars; the same build resumes to the same bits.
    std::size_t state_size() const;
    void save(std::span<double> state) const;
    /// False, and nothing changed, if the size is wrong or a value is not finite.
    bool load(std::span<const double> state);

  private:
    using Array = std::vector<double>;
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    // direct_rod.cpp
    void update_joints();
    void come_to_rest();
    StepPart part_of(const RodStep& whole, double from, double share) const;
    bool try_step(const StepPart& input);
    bool step_in_parts(const RodStep& input);
    void end_step();
    void begin(const StepPart& input);
    bool solve_tick();
    double fastest() const;
    double farthest_moved() const;
    void advance(double share);
    void lay_out();
    void finish();
    void end_stage(double further);
    bool all_finite() const;
    void set_frame(int slot, const Quat& q);
    Quat frame_slot(int slot) const {
        return {q_[0][at(slot)], q_[1][at(slot)], q_[2][at(slot)], q_[3][at(slot)]};
    }
    void set_node(Array* to, int i, const Vec3& p) {
        to[0][at(i)] = p.x, to[1][at(i)] = p.y, to[2][at(i)] = p.z;
    }
    Vec3 row(const Array* from, int i) const { return {from[0][at(i)], from[1][at(i)], from[2][at(i)]}; }

    // assembly.cpp
    void viscous_offsets();
    void joints();
    void assemble(bool with_geometry);

    // ends.cpp
    void hold_ends();
    void update_guide();
    void add_ends();
    void add_coupling();
    bool judge_caps();
    bool is_cap_passed() const;
    void report_ends();

    // contacts.cpp
    void prepare_contacts();
    double other_give(const ContactRow& row) const;
    void begin_passes();
    Vec3 force_at(const ContactRow& row, const Vec3& moved, bool is_closed, Sym<double>* stiffness) const;
    void linearise(ContactRow& row, bool is_closed) const;
    bool judge_contacts();
    double contact_share(double curvature) const;
    double way_energy() const;
    double worst_overlap() const;
    void take(double share);
    bool solve_contacts(bool is_first, int most_passes);
    Vec3 film_force(const ContactRow& row) const;
    void finish_contacts();
    Vec3 slip(const ContactRow& row) const;
    double gap_now(const ContactRow& row) const;
    Vec3 node_displacement(int i) const { return row(moved_, i); }
    /// The end of a segment that is nearer to the solver's start.
    int near_node(int segment) const { return segment <= solver_.middle() ? segment : segment + 1; }
    Vec3 point(int segment, double along) const;
    Vec3 displacement(int segment, double along, const Vec3& across, const Vec3& lever) const;
    Vec3 arm(int segment, double along) const;

    // contact_system.cpp
    struct Touched;
    Touched& touched(int segment);
    void gather_contacts();
    void complete_system();
    void displace();

    // state.cpp
    template<class Rod, class F>
    static void visit_state(Rod& rod, F f);

    int n_ = 0, m_ = 0;
    double recovery_speed_ = 0.2;

    // Nodes: N values. x0, v: at the tick's start; b: force on the node at the present iterate but for the
    // section forces; free: displacement by it alone; moved: displacement that was solved for;
    // taken: what the passes came to.
    Array x_[3], v_[3], x0_[3], b_[3], free_[3], moved_[3], taken_moved_[3], mass_, node_drag_, inertia_,
        inverse_inertia_;
    // Segments: N-1 values. turn: rotation since the tick's start, world; turn_guess: what it were without
    // torques.
    Array spin_[3], force_[3], turn_[3], turn_guess_[3], direction_[3], taken_turn_[3], length_, transverse_,
        polar_;
    Array h_[6], g_[3]; // of the rod alone
    Array mass_per_length_, radius_, bending_1_, bending_2_, torsion_, bending_damping_, torsion_damping_,
        drag_, friction_;
    // Frames: the base's cross-section, then N-1 segments, then the tip's cross-section: joint i lies between
    // i and i + 1.
    Array q_[4];
    // Joints: N values: stiffness per angle (N m/rad), rest angles, viscous times; with viscosity: stiffness
    // and offset of this tick; moment in the world on segment i-1, its negative on segment i.
    Array k_[3], rest_[3], viscosity_[3], kv_[3], offset_[3], moment_[3], joint_k_[6], cell_;
    Array rest_darboux_;

    ChainSolver solver_;
    StepPart now_;
    double left_overlap_ = 0; ///< m; what contacts do not bear where the passes ended
    double elapsed_ = 0;      ///< s
    bool viscous_ = false;
    bool base_was_clamped_ = false, tip_was_clamped_ = false;
    bool is_calm_ = true;         ///< the last tick was: one linearisation, small turns
    double stage_ = 1e-3;         ///< s, of the implicit step; the tick or a share of it
    Quat base_clamp_, tip_clamp_; ///< the clamps' orientations at the stage's end
    Vec3 tip_place_;
    double advance_ = 0, roll_ = 0;
    Vec3 base_force_, base_torque_, tip_force_, tip_torque_;
    // What the joints' cells were made for.
    bool base_cells_ = false, tip_cells_ = false;

    int on_axis_ = 0; ///< nodes [0, on_axis_) lie on the guide's axis
    struct Mouth {
        int joint = -1;
        double k[2] = {}, rest[2] = {};
    } mouth_;               ///< the joint whose cell is partly in the sleeve, and what it is outside
    double mouth_push_ = 0; ///< N; what a bent rod pushes itself out of the sleeve with
    double coupling_force_ = 0, coupling_torque_ = 0;
    double axial_cap_ = 0, roll_cap_ = 0;        ///< -1, 0, 1: which bound the coupling's spring is at
    int axial_releases_ = 0, roll_releases_ = 0; ///< from it, in this tick

    std::size_t contact_count_ = 0, row_count_ = 0, memory_count_ = 0;
    std::vector<ContactRow> rows_;
    std::vector<Vec3> impulse_;
    std::vector<ContactMemory> memory_;
    // Sums over the contacts of a segment: stiffness K, K A, A^T K A, force and torque. Their node is the one
    // towards the rod's nearer end.
    struct Touched {
        int segment = 0;
        Sym<double> stiffness{}, turning{};
        Mat<double> coupling{};
        Vec3 force, torque;
    };
    std::vector<Touched> touched_;
    std::size_t touched_count_ = 0;
    std::vector<int> touched_slot_; // of each segment, or -1

    Array saved_;
    bool timing_ = false;
    StepTimes times_;
};

} // namespace calot::rod_direct
