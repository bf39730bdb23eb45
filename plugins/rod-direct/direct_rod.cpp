#include "direct_rod.hpp"

#include <algorithm>
#include <chrono>

namespace calot::rod_direct {

namespace {

// Inextensible up to this share of what one tick's force moves two nodes by; it tends to the force of the
// last tick, so nothing is left of it at rest. A straight rod held at both ends has a solution by it.
constexpr double softness = 1e-9;
// Nothing on an endoscope moves this fast; it bounds what a bad input can do.
constexpr double speed_limit = 20.0; // m/s
// While contacts may close and are not looked up anew: they are up to two ticks old, and in 6 mm a wall
// turns. A shaft that is let go at 10 J would come to 10 m/s; what surrounds a real one takes that up.
constexpr double speed_limit_in_contact = 3.0; // m/s
// The largest turn of a segment that the first guess makes, and that one linearisation may, rad.
constexpr double most_guessed = 0.3, most_turned = 0.6;
// A linearisation that turns a segment by more than this against the guess is followed by another. What one
// leaves is about the square of it, and the next tick sees that.
constexpr double again_above = 0.02;
// Where nothing touches the rod a tick is a stage of implicit Euler of this share of it, gone on with to the
// tick's end at the same rates: the theta method, whose numerical damping ratio is (theta - 1/2) w h instead
// of w h / 2. Contacts would rebound by it, and fast turns are not for it.
constexpr double stage_share = 0.65, calm_turn = 0.005, longest_staged = 2e-3; // -, rad in a tick, s
// A torque whose axis is fixed in space has no potential: its part of the Jacobian is skew and left out. One
// linearisation then lets it drive a strongly bent rod out of its plane; with such a torque there are more.
constexpr double again_above_torque = 1e-10;
constexpr int most_with_torque = 12;
// A step that is to end early takes at most this share of it, at least this time, and is found in so many
// attempts.
constexpr double most_partial = 0.8, shortest_part = 2e-5; // -, s
constexpr int most_attempts = 4;
// A step whose passes come to no end, and leave more overlap than this that nothing bears, is taken in so
// many parts.
constexpr double most_left = 1e-5; // m
constexpr int parts = 4;
constexpr int most_linearisations = 5, most_passes = 16, later_passes = 8;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

} // namespace

DirectRod::DirectRod(const RodDescription& d, std::span<const double> parameters)
    : n_(d.nodes), m_(d.nodes - 1), recovery_speed_(parameters[0]), rest_darboux_(d.rest_darboux),
      solver_(d.nodes - 1) {
    const auto n = at(n_), m = at(m_);
    for (auto* group :
         {x_, v_, x0_, b_, free_, moved_, taken_moved_, k_, rest_, viscosity_, kv_, offset_, moment_})
        for (int i = 0; i < 3; ++i)
            group[i].assign(n, 0.0);
    for (auto* group : {spin_, force_, turn_, turn_guess_, direction_, taken_turn_, g_})
        for (int i = 0; i < 3; ++i)
            group[i].assign(m, 0.0);
    for (int i = 0; i < 6; ++i)
        joint_k_[i].assign(n, 0.0), h_[i].assign(m, 0.0);
    for (int i = 0; i < 4; ++i)
        q_[i].assign(n + 1, i == 0 ? 1.0 : 0.0);
    for (Array* a : {&mass_, &node_drag_, &inertia_, &inverse_inertia_, &cell_})
        a->assign(n, 0.0);
    for (Array* a : {&length_, &transverse_, &polar_})
        a->assign(m, 0.0);
    for (Array* a : {&mass_per_length_, &radius_, &bending_1_, &bending_2_, &torsion_, &bending_damping_,
                     &torsion_damping_, &drag_, &friction_})
        a->assign(m, 1.0);
    touched_.resize(m);
    touched_slot_.assign(m, -1);
    const auto contacts = at(d.max_contacts);
    rows_.resize(contacts);
    impulse_.resize(contacts);
    memory_.resize(contacts);
    length_ = d.length;
    set_properties(d.properties);
    saved_.resize(state_size());
    reset_to(d.position, d.frame);
}

void DirectRod::set_properties(const RodProperties& given) {
    mass_per_length_ = given.mass_per_length, radius_ = given.radius;
    bending_1_ = given.bending_x, bending_2_ = given.bending_y, torsion_ = given.torsion;
    bending_damping_ = given.bending_damping, torsion_damping_ = given.torsion_damping;
    drag_ = given.drag, friction_ = given.friction;
    std::fill(mass_.begin(), mass_.end(), 0.0);
    std::fill(node_drag_.begin(), node_drag_.end(), 0.0);
    for (std::size_t j = 0; j < at(m_); ++j) {
        const double l = length_[j], mass = l * mass_per_length_[j];
        for (std::size_t i : {j, j + 1})
            mass_[i] += 0.5 * mass, node_drag_[i] += 0.5 * l * drag_[j];
        transverse_[j] = 0.25 * mass * radius_[j] * radius_[j];
        polar_[j] = 0.5 * mass * radius_[j] * radius_[j];
    }
    update_joints();
}

void DirectRod::set_frame(int slot, const Quat& q) {
    q_[0][at(slot)] = q.w, q_[1][at(slot)] = q.x, q_[2][at(slot)] = q.y, q_[3][at(slot)] = q.z;
}

void DirectRod::reset_to(std::span<const double> p, std::span<const double> frames) {
    set_node(x_, 0, vec3(p.data()));
    for (int j = 0; j < m_; ++j) {
        const Vec3 e = vec3(&p[3 * at(j) + 3]) - vec3(&p[3 * at(j)]);
        const Quat given = quat(&frames[4 * at(j)]);
        const Quat unit = normalized(given);
        set_frame(j + 1, normalized(between(axis_z(unit), normalized(e)) * unit));
    }
    lay_out();
    come_to_rest();
}

void DirectRod::come_to_rest() {
    for (auto* group : {v_, spin_, force_, turn_})
        for (int i = 0; i < 3; ++i)
            std::fill(group[i].begin(), group[i].end(), 0.0);
    memory_count_ = contact_count_ = row_count_ = 0;
    advance_ = roll_ = 0.0;
    base_was_clamped_ = tip_was_clamped_ = false;
    is_calm_ = true;
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
    coupling_force_ = coupling_torque_ = 0.0;
    axial_cap_ = roll_cap_ = 0.0;
    set_frame(0, frame(0)), set_frame(n_, frame(m_ - 1));
    now_ = {};
}

void DirectRod::lay_out() {
    const double *qw = q_[0].data() + 1, *qx = q_[1].data() + 1, *qy = q_[2].data() + 1,
                 *qz = q_[3].data() + 1;
    double x = x_[0][0], y = x_[1][0], z = x_[2][0];
    for (int j = 0; j < m_; ++j) {
        const double l = length_[at(j)];
        x += l * 2.0 * (qx[j] * qz[j] + qw[j] * qy[j]);
        y += l * 2.0 * (qy[j] * qz[j] - qw[j] * qx[j]);
        z += l * ((qw[j] * qw[j] - qy[j] * qy[j]) + (qz[j] * qz[j] - qx[j] * qx[j]));
        x_[0][at(j) + 1] = x, x_[1][at(j) + 1] = y, x_[2][at(j) + 1] = z;
    }
}

// Where the rod were at the tick's end without forces, its ends where they are prescribed.
void DirectRod::begin(const StepPart& input) {
    now_ = input;
    axial_releases_ = roll_releases_ = 0;
    const bool base = now_.base.mode == RodEndMode::clamped, tip = now_.tip.mode == RodEndMode::clamped;
    bool stale = base != base_cells_ || tip != tip_cells_;
    if (!input.rest_darboux.empty() &&
        !std::equal(input.rest_darboux.begin(), input.rest_darboux.end(), rest_darboux_.begin())) {
        std::copy(input.rest_darboux.begin(), input.rest_darboux.end(), rest_darboux_.begin());
        stale = true;
    }
    base_cells_ = base, tip_cells_ = tip;
    if (stale) update_joints();
    update_guide();
    const bool is_smooth = is_calm_ && now_.dt <= longest_staged && now_.contacts.empty() &&
                           !now_.guide.present && base == base_was_clamped_ && tip == tip_was_clamped_;
    const double share = is_smooth ? stage_share : 1.0, h = share * now_.dt;
    stage_ = h;
    base_clamp_ = share == 1.0 ? now_.base.orientation : blend(frame_slot(0), now_.base.orientation, share);
    tip_clamp_ = share == 1.0 ? now_.tip.orientation : blend(frame_slot(n_), now_.tip.orientation, share);
    tip_place_ = position(m_) + share * (now_.tip.position - position(m_));
    for (int k = 0; k < 3; ++k)
        std::copy(x_[k].begin(), x_[k].end(), x0_[k].begin());
    for (int i = 0; i < n_; ++i) {
        inertia_[at(i)] = (mass_[at(i)] / h + node_drag_[at(i)]) / h;
        inverse_inertia_[at(i)] = 1.0 / inertia_[at(i)];
    }
    if (base) inverse_inertia_[0] = 0.0;
    if (tip) inverse_inertia_[at(m_)] = 0.0;
    for (int j = 0; j < m_; ++j)
        solver_.soft[at(j)] = softness * (1.0 / inertia_[at(j)] + 1.0 / inertia_[at(j) + 1]);

    // Viscous strain rates are against the cross-sections as they were.
    if (!base_was_clamped_) set_frame(0, base ? now_.base.orientation : frame(0));
    if (!tip_was_clamped_) set_frame(n_, tip ? now_.tip.orientation : frame(m_ - 1));
    viscous_offsets();

    for (int j = 0; j < m_; ++j) {
        const Vec3 guess = h * angular_velocity(j);
        const double size = norm(guess);
        const Vec3 turn = size > most_guessed ? (most_guessed / size) * guess : guess;
        set_node(turn_guess_, j, guess);
        set_node(turn_, j, turn);
        set_frame(j + 1, normalized(turned_by(turn) * frame(j)));
    }
    hold_ends();
    set_node(x_, 0, position(0) + (base ? share * (now_.base.position - position(0)) : h * velocity(0)));
    lay_out();
}

// Takes a share of the solved increments.
void DirectRod::advance(double share) {
    double *qw = q_[0].data() + 1, *qx = q_[1].data() + 1, *qy = q_[2].data() + 1, *qz = q_[3].data() + 1;
    const double *ax = taken_turn_[0].data(), *ay = taken_turn_[1].data(), *az = taken_turn_[2].data();
    double *ux = turn_[0].data(), *uy = turn_[1].data(), *uz = turn_[2].data();
    const double half = 0.5 * share;
#pragma GCC ivdep
    for (int j = 0; j < m_; ++j) {
        const double w = qw[j], x = qx[j], y = qy[j], z = qz[j];
        const double a = half * ax[j], b = half * ay[j], c = half * az[j];
        const double nw = w - a * x - b * y - c * z, nx = x + a * w + b * z - c * y,
                     ny = y - a * z + b * w + c * x, nz = z + a * y - b * x + c * w;
        const double unit = 1.0 / std::sqrt(nw * nw + nx * nx + ny * ny + nz * nz);
        qw[j] = nw * unit, qx[j] = nx * unit, qy[j] = ny * unit, qz[j] = nz * unit;
        ux[j] += share * ax[j], uy[j] += share * ay[j], uz[j] += share * az[j];
    }
    const bool is_held = now_.base.mode == RodEndMode::clamped || on_axis_ > 0;
    Vec3 centre{};
    double mass = 0.0;
    if (!is_held)
        for (int i = 0; i < n_; ++i)
            centre += mass_[at(i)] * (position(i) + share * row(taken_moved_, i)), mass += mass_[at(i)];
    set_node(x_, 0, position(0) + share * row(taken_moved_, 0));
    hold_ends();
    lay_out();
    if (is_held) return;
    // What the turns' second order moved the nodes by beside the solution shall not move the whole.
    for (int i = 0; i < n_; ++i)
        centre -= mass_[at(i)] * position(i);
    centre *= 1.0 / mass;
    for (int k = 0; k < 3; ++k)
        for (double& x : x_[k])
            x += centre[at(k)];
}

bool DirectRod::solve_tick() {
    bool with_geometry = true;
    const auto has_torque = [](const RodEnd& e) {
        return e.mode == RodEndMode::loaded && norm(e.torque) > 0.0;
    };
    const bool torque = has_torque(now_.base) || has_torque(now_.tip);
    const int rounds = torque ? most_with_torque : most_linearisations;
    const double again = torque ? again_above_torque : again_above;
    for (int round = 0; round < rounds; ++round) {
        const auto start = timing_ ? Clock::now() : Clock::time_point{};
        assemble(with_geometry);
        add_ends();
        if (timing_) times_.assembly += seconds_since(start);
        ++times_.linearisations;
        const int passes = round == 0 ? most_passes : later_passes;
        bool solved = solve_contacts(round == 0, passes);
        if (!solved && with_geometry) {
            with_geometry = false;
            assemble(false);
            add_ends();
            solved = solve_contacts(round == 0, passes);
        }
        if (!solved) return false;
        double most = 0.0;
        const double *ax = taken_turn_[0].data(), *ay = taken_turn_[1].data(), *az = taken_turn_[2].data();
        for (int j = 0; j < m_; ++j)
            most = std::max(most, ax[j] * ax[j] + ay[j] * ay[j] + az[j] * az[j]);
        most = std::sqrt(most);
        advance(most > most_turned ? most_turned / most : 1.0);
        is_calm_ = !torque && round == 0 && most < again_above;
        if (!(most > again)) break;
    }
    for (int j = 0; j < m_; ++j)
        is_calm_ = is_calm_ && norm(row(turn_, j)) < calm_turn;
    return all_finite();
}

bool DirectRod::all_finite() const {
    double sum = 0.0;
    for (const auto* group : {x_, force_, turn_})
        for (int i = 0; i < 3; ++i)
            for (double v : group[i])
                sum += v * 0.0;
    for (const auto& q : q_)
        for (double v : q)
            sum += v * 0.0;
    return sum == 0.0;
}

// Of a step that has come to `from`, as much more; the ends go from where they are to their targets.
StepPart DirectRod::part_of(const RodStep& whole, double from, double share) const {
    StepPart part{whole, share, from};
    part.dt = share * whole.dt;
    for (RodCoupling* c : {&part.base.axial, &part.base.roll})
        c->target += from * whole.dt * c->velocity;
    const double of_rest = share / (1.0 - from);
    if (of_rest >= 1.0) return part;
    const auto shorten = [&](RodEnd& end, const Vec3& place, const Quat& turn) {
        if (end.mode != RodEndMode::clamped) return;
        end.position = place + of_rest * (end.position - place);
        end.orientation = blend(turn, end.orientation, of_rest);
    };
    shorten(part.base, position(0), frame_slot(0));
    shorten(part.tip, position(m_), frame_slot(n_));
    return part;
}

bool DirectRod::step(const RodStep& input) {
    times_ = {};
    save(saved_);
    bool is_solved = false;
    const double farthest = input.farthest > 0.0 ? input.farthest : 1e9;
    double share = std::min(1.0, farthest / std::max(1e-12, fastest() * input.dt));
    for (int attempt = 0;; ++attempt) {
        // No small rest is left: it were a step of its own.
        if (share > most_partial) share = 1.0;
        share = std::max(share, std::min(1.0, shortest_part / input.dt));
        is_solved = try_step(share < 1.0 ? part_of(input, 0.0, share) : StepPart{input});
        const double moved = is_solved ? farthest_moved() : 0.0;
        if (moved <= 1.25 * farthest || share * input.dt <= shortest_part || attempt + 1 == most_attempts)
            break;
        load(saved_);
        share *= std::clamp(0.9 * farthest / moved, 0.1, 0.7);
    }
    elapsed_ = now_.dt;
    if (share == 1.0 && !(is_solved && left_overlap_ < most_left)) {
        load(saved_);
        elapsed_ = input.dt;
        is_solved = step_in_parts(input);
    } else if (is_solved) {
        end_step();
    }
    if (!is_solved) {
        load(saved_);
        for (auto* group : {v_, spin_, force_})
            for (int i = 0; i < 3; ++i)
                std::fill(group[i].begin(), group[i].end(), 0.0);
        memory_count_ = row_count_ = 0;
        is_calm_ = false;
        base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
        std::fill(impulse_.begin(), impulse_.end(), Vec3{});
        now_.contacts = {};
    }
    return is_solved;
}

// Where the passes come to no end: from one part to the next less changes.
bool DirectRod::step_in_parts(const RodStep& input) {
    Vec3 base_force, base_torque, tip_force, tip_torque;
    const double share = 1.0 / parts;
    for (int i = 0; i < parts; ++i) {
        StepPart part = part_of(input, i * share, share);
        part.delay = parts;
        if (!try_step(part)) return false;
        end_step();
        base_force += share * base_force_, base_torque += share * base_torque_;
        tip_force += share * tip_force_, tip_torque += share * tip_torque_;
    }
    base_force_ = base_force, base_torque_ = base_torque;
    tip_force_ = tip_force, tip_torque_ = tip_torque;
    return true;
}

void DirectRod::end_step() {
    report_ends();
    finish();
    finish_contacts();
}

bool DirectRod::try_step(const StepPart& input) {
    begin(input);
    prepare_contacts();
    return solve_tick();
}

double DirectRod::fastest() const {
    double most = 0.0;
    for (int i = 0; i < n_; ++i)
        most = std::max(most, dot(velocity(i), velocity(i)));
    return std::sqrt(most);
}

// Of a node, since the tick's start.
double DirectRod::farthest_moved() const {
    double most = 0.0;
    for (int i = 0; i < n_; ++i) {
        const Vec3 way = position(i) - row(x0_, i);
        most = std::max(most, dot(way, way));
    }
    return std::sqrt(most);
}

void DirectRod::finish() {
    const double per_h = 1.0 / stage_, further = now_.dt / stage_;
    if (further > 1.0) {
        end_stage(further);
        return;
    }
    if (now_.guide.present) {
        roll_ += dot(row(turn_, 0), now_.guide.direction);
        advance_ = dot(position(0) - now_.guide.origin, now_.guide.direction);
    }
    const double limit = row_count_ > 0 && !(now_.farthest > 0.0) ? speed_limit_in_contact : speed_limit;
    for (int i = 0; i < n_; ++i) {
        const Vec3 v = per_h * (position(i) - row(x0_, i));
        const double size = norm(v);
        set_node(v_, i, size > limit ? (limit / size) * v : v);
    }
    for (int j = 0; j < m_; ++j)
        set_node(spin_, j, in_frame(frame(j), per_h * row(turn_, j)));
    base_was_clamped_ = now_.base.mode == RodEndMode::clamped;
    tip_was_clamped_ = now_.tip.mode == RodEndMode::clamped;
}

// From the stage to the tick's end: the stage's velocities are the tick's mean.
void DirectRod::end_stage(double further) {
    const double per_h = 1.0 / stage_;
    const bool is_held = now_.base.mode == RodEndMode::clamped;
    Vec3 centre{};
    double mass = 0.0;
    for (int i = 0; i < n_; ++i) {
        const Vec3 way = position(i) - row(x0_, i), v = row(v_, i);
        set_node(v_, i, v + further * (per_h * way - v));
        if (is_held) continue;
        centre += mass_[at(i)] * (row(x0_, i) + further * way), mass += mass_[at(i)];
    }
    for (int j = 0; j < m_; ++j) {
        const Vec3 turn = row(turn_, j), before = row(spin_, j);
        set_node(spin_, j, before + further * (in_frame(frame(j), per_h * turn) - before));
        set_frame(j + 1, normalized(turned_by((further - 1.0) * turn) * frame(j)));
    }
    base_clamp_ = now_.base.orientation, tip_clamp_ = now_.tip.orientation;
    hold_ends();
    set_node(x_, 0, row(x0_, 0) + further * (position(0) - row(x0_, 0)));
    lay_out();
    if (is_held) return;
    for (int i = 0; i < n_; ++i)
        centre -= mass_[at(i)] * position(i);
    for (int k = 0; k < 3; ++k)
        for (double& x : x_[k])
            x += centre[at(k)] / mass;
}

RodEnergies DirectRod::energies() const {
    RodEnergies e;
    for (int i = 0; i < n_; ++i) {
        const Vec3 v = velocity(i);
        e.kinetic += 0.5 * mass_[at(i)] * dot(v, v);
        // What lies in the sleeve has no weight: its height is the mouth's.
        e.gravity -= mass_[at(i)] * dot(now_.gravity, i < on_axis_ ? now_.guide.origin : position(i));
        const Vec3 phi = turn_vector(conjugate(frame_slot(i)) * frame_slot(i + 1));
        const double d1 = phi.x - rest_[0][at(i)], d2 = phi.y - rest_[1][at(i)], d3 = phi.z - rest_[2][at(i)];
        e.bending += 0.5 * (k_[0][at(i)] * d1 * d1 + k_[1][at(i)] * d2 * d2);
        e.twist += 0.5 * k_[2][at(i)] * d3 * d3;
    }
    for (int j = 0; j < m_; ++j)
        e.kinetic += 0.5 * (transverse_[at(j)] *
                                (spin_[0][at(j)] * spin_[0][at(j)] + spin_[1][at(j)] * spin_[1][at(j)]) +
                            polar_[at(j)] * spin_[2][at(j)] * spin_[2][at(j)]);
    return e;
}

} // namespace calot::rod_direct
