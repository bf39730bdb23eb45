#include "cosserat_rod.hpp"

#include "lapack.hpp"

#include <algorithm>
#include <chrono>

namespace calot::rod_cosserat {

namespace {

// The largest share of the explicit stability limit that a substep uses; the rest is for large rotations and
// contact.
constexpr double stability_share = 0.8;
// Bending and tension together may use this share of the limit, as squared frequencies: a taut shaft lies
// still.
constexpr double taut_share = 0.9;
// Tension never makes a substep shorter than this share of what bending asks for.
constexpr double least_taut_share = 0.25;
// The longest substep, s: bounds the leapfrog's energy error where the stability limit would allow more.
constexpr double longest_substep = 1e-4;
// s, added to every bending damping: the lowest mode of a metre of endoscope loses a part in 10^5 of its
// energy in a period by it, the grid's own modes, where leapfrog energy is roughest, some per cent.
constexpr double numerical_viscosity = 1e-6;
// Bending damping acts up to this share of the undamped substep, then costs half as many substeps again.
constexpr double most_viscosity = 5.0 / 12.0;
// s, the most of torsion damping that acts. It sees how spins differ, not how the turning of segments twists
// their frames against each other, so twist that contacts shake into the shaft has to die within its time: at
// 1 ms a shaft in rough hands holds up to 2 J of it, at 5 ms 10 J, at 20 ms 40 J.
constexpr double most_twist_viscosity = 1e-3;
// Nothing on an endoscope moves this fast; it bounds what a bad input can do within a substep.
constexpr double speed_limit = 20.0; // m/s
// While contacts may close and are not looked up anew: they are up to two ticks old, and in 6 mm a wall
// turns. A shaft that is let go at 10 J would come to 10 m/s; what surrounds a real one takes that up.
constexpr double speed_limit_in_contact = 3.0; // m/s

// Of lengths and contacts in a substep, while the overlap of contacts grows.
constexpr int most_rounds = 12;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

} // namespace

CosseratRod::CosseratRod(const RodDescription& d, std::span<const double> parameters)
    : n_(d.nodes), iterations_(static_cast<int>(parameters[0])), recovery_speed_(parameters[1]),
      rest_darboux_(d.rest_darboux) {
    const auto n = static_cast<std::size_t>(n_), m = n - 1;
    for (Array* a : {&x_,         &y_,
                     &z_,         &vx_,
                     &vy_,        &vz_,
                     &out_vx_,    &out_vy_,
                     &out_vz_,    &fx_,
                     &fy_,        &fz_,
                     &mass_,      &w_,
                     &node_drag_, &slow_,
                     &k1_,        &k2_,
                     &k3_,        &rest1_,
                     &rest2_,     &rest3_,
                     &last_u1_,   &last_u2_,
                     &rate1_,     &rate2_,
                     &per_cell_,  &per_twist_cell_,
                     &viscosity_, &twist_viscosity_,
                     &gx_,        &gy_,
                     &gz_})
        a->assign(n, 0.0);
    for (Array* a : {&qw_, &qx_, &qy_, &qz_, &length_, &inverse_length_, &spin_, &next_spin_, &polar_,
                     &torque_, &slow_spin_, &twist_diagonal_, &twist_off_, &twist_unit_})
        a->assign(m, 0.0);
    for (Array* a : {&mass_per_length_, &radius_, &bending_1_, &bending_2_, &torsion_, &bending_damping_,
                     &torsion_damping_, &drag_, &friction_})
        a->assign(m, 1.0);
    for (Array* a : {&tx_, &ty_, &tz_, &lambda_, &pulled_, &couple_x_, &couple_y_, &couple_z_, &lower_,
                     &diagonal_, &upper_, &right_, &pivot_})
        a->assign(n + 1, 0.0);
    const auto contacts = static_cast<std::size_t>(d.max_contacts);
    rows_.resize(contacts);
    for (Response& u : response_)
        for (Array* a : {&u.x, &u.y, &u.z})
            a->assign(n, 0.0);
    impulse_.resize(contacts);
    memory_.resize(contacts);
    for (std::size_t j = 0; j < m; ++j) {
        length_[j] = d.length[j];
        inverse_length_[j] = 1.0 / d.length[j];
    }
    set_properties(d.properties);
    saved_.resize(state_size());
    reset_to(d.position, d.frame);
}

void CosseratRod::set_properties(const RodProperties& given) {
    mass_per_length_ = given.mass_per_length, radius_ = given.radius;
    bending_1_ = given.bending_x, bending_2_ = given.bending_y, torsion_ = given.torsion;
    bending_damping_ = given.bending_damping, torsion_damping_ = given.torsion_damping;
    drag_ = given.drag, friction_ = given.friction;
    std::fill(mass_.begin(), mass_.end(), 0.0);
    std::fill(node_drag_.begin(), node_drag_.end(), 0.0);
    for (std::size_t j = 0; j < length_.size(); ++j) {
        const double mass = mass_per_length_[j] * length_[j];
        polar_[j] = 0.5 * mass * radius_[j] * radius_[j];
        for (std::size_t i : {j, j + 1}) {
            mass_[i] += 0.5 * mass;
            node_drag_[i] += 0.5 * length_[j] * drag_[j];
        }
    }
    for (int i = 0; i < n_; ++i)
        node_drag_[i] /= mass_[i];
    chosen_.reset();
    update_joints();
}

// Joint i spans half of each neighbouring segment. Bending moment is continuous across it, so compliances add
// and rest angles add. At the ends the cell is the half of one segment: what lies between a clamp and the
// segment's middle.
void CosseratRod::update_joints() {
    const auto series = [](double la, double ka, double lb, double kb) {
        return (la + lb) / (la / ka + lb / kb);
    };
    const auto own = [&](int j) { return vec3(&rest_darboux_[3 * static_cast<std::size_t>(j)]); };
    for (int i = 0; i < n_; ++i) {
        const int a = std::max(i - 1, 0), b = std::min(i, n_ - 2);
        const double la = i > 0 ? 0.5 * length_[a] : 0.0, lb = i < n_ - 1 ? 0.5 * length_[b] : 0.0;
        k1_[i] = series(la, bending_1_[a], lb, bending_1_[b]);
        k2_[i] = series(la, bending_2_[a], lb, bending_2_[b]);
        k3_[i] = series(la, torsion_[a], lb, torsion_[b]);
        viscosity_[i] =
            numerical_viscosity + (la * bending_damping_[a] + lb * bending_damping_[b]) / (la + lb);
        twist_viscosity_[i] =
            std::min((la * torsion_damping_[a] + lb * torsion_damping_[b]) / (la + lb), most_twist_viscosity);
        per_cell_[i] = per_twist_cell_[i] = 2.0 / (la + lb);
        const Vec3 rest = 1.0 / (la + lb) * (la * own(a) + lb * own(b));
        rest1_[i] = rest.x, rest2_[i] = rest.y, rest3_[i] = rest.z;
    }
}

void CosseratRod::reset(Vec3 base, Quat orientation) {
    // The frame that follows q_a at rest is q_a turned by the rest of its joint. A half cell at the base lies
    // between the cross-section given and the first segment.
    const auto turn = [&](int i) {
        return turn_of_measure(
            {rest1_[i] / per_cell_[i], rest2_[i] / per_cell_[i], rest3_[i] / per_twist_cell_[i]});
    };
    Quat q = normalized(orientation);
    Vec3 p = base;
    base_clamp_ = q;
    for (int i = 0; i < n_; ++i) {
        x_[i] = p.x, y_[i] = p.y, z_[i] = p.z;
        q = normalized(q * turn(i));
        if (i == n_ - 1) break;
        qw_[i] = q.w, qx_[i] = q.x, qy_[i] = q.y, qz_[i] = q.z;
        p += length_[i] * third_axis(q);
    }
    tip_clamp_ = q;
    come_to_rest();
}

void CosseratRod::reset_to(std::span<const double> p, std::span<const double> frames) {
    const auto n = static_cast<std::size_t>(n_);
    for (std::size_t i = 0; i < n; ++i) {
        x_[i] = p[3 * i], y_[i] = p[3 * i + 1], z_[i] = p[3 * i + 2];
        if (i == n - 1) break;
        const Vec3 e = Vec3{p[3 * i + 3], p[3 * i + 4], p[3 * i + 5]} - position(static_cast<int>(i));
        const Quat given{frames[4 * i], frames[4 * i + 1], frames[4 * i + 2], frames[4 * i + 3]};
        const Quat unit = normalized(given);
        const Quat q = normalized(between(third_axis(unit), (1.0 / norm(e)) * e) * unit);
        qw_[i] = q.w, qx_[i] = q.x, qy_[i] = q.y, qz_[i] = q.z;
    }
    come_to_rest();
    base_clamp_ = base_frame(), tip_clamp_ = tip_frame();
}

// What both ways of resetting share.
void CosseratRod::come_to_rest() {
    for (Array* a :
         {&vx_, &vy_, &vz_, &out_vx_, &out_vy_, &out_vz_, &spin_, &rate1_, &rate2_, &last_u1_, &last_u2_})
        std::fill(a->begin(), a->end(), 0.0);
    half_kick_ = 0.5;
    tension_stiffness_ = last_substep_ = 0.0;
    memory_count_ = contact_count_ = row_count_ = 0;
    advance_ = roll_ = 0.0;
    on_axis_ = 0;
    mouth_stiffness_ = 0.0;
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
    now_ = {};
    update_joints();
    directions();
    elastic_moments(1.0, true);
    std::fill(rate1_.begin(), rate1_.end(), 0.0);
    std::fill(rate2_.begin(), rate2_.end(), 0.0);
}

void CosseratRod::set_velocities(std::span<const double> linear, std::span<const double> angular) {
    for (std::size_t i = 0; i < x_.size() && 3 * i + 2 < linear.size(); ++i) {
        out_vx_[i] = vx_[i] = linear[3 * i];
        out_vy_[i] = vy_[i] = linear[3 * i + 1];
        out_vz_[i] = vz_[i] = linear[3 * i + 2];
    }
    for (std::size_t j = 0; j < spin_.size() && 3 * j + 2 < angular.size(); ++j)
        spin_[j] = dot(vec3(&angular[3 * j]), third_axis(frame(static_cast<int>(j))));
    half_kick_ = 0.5;
}

// Substeps from the stiffest node: bending moment K phi / c acts through forces (1, -2, 1) / l, so a node's
// row of the stiffness matrix sums to at most (4, 8, 4) K / (c l^2) (Gershgorin); a leapfrog step h with the
// viscous part lagging is stable while h^2 w^2 + 2 h tau w^2 < 4. Twist is implicit and sets no limit.
double CosseratRod::longest_stable(bool base, bool tip) {
    double least = longest_substep;
    const auto squared = [&](int i) {
        double row = 0.0;
        for (int k = std::max(i - 1, 0); k <= std::min(i + 1, n_ - 1); ++k) {
            if ((k == 0 && !base) || (k == n_ - 1 && !tip)) continue;
            const double inverse =
                std::max(inverse_length_[std::max(i - 1, 0)], inverse_length_[std::min(i, n_ - 2)]);
            row += (k == i ? 4.0 : 2.0) * std::max(k1_[k], k2_[k]) * per_twist_cell_[k] * inverse * inverse;
        }
        return row / mass_[i];
    };
    const int first = base ? 1 : 0, end = tip ? n_ - 1 : n_;
    for (int i = first; i < end; ++i)
        least = std::min(least, 2.0 * stability_share / std::sqrt(squared(i)));
    viscosity_cap_ = most_viscosity * least;
    for (int i = first; i < end; ++i) {
        double tau = 0.0;
        for (int k = std::max(i - 1, 0); k <= std::min(i + 1, n_ - 1); ++k)
            tau = std::max(tau, std::min(viscosity_[k], viscosity_cap_));
        const double limit = 4.0 * stability_share * stability_share / squared(i);
        least = std::min(least, std::sqrt(tau * tau + limit) - tau);
    }
    return least;
}

// Tensions act along the directions at a substep's start, so what they add to the transverse frequency,
// squared, is explicit too: 4 T / (m l^2) in the middle of a taut rod. That is little at an endoscope's
// stiffness, where 650 N ask for shorter substeps, and much for a light rod wound about a drum.
double CosseratRod::stable_under_tension() const {
    const double bending = 4.0 * stability_share * stability_share / longest_stable_,
                 limit = 4.0 * taut_share;
    const double root = std::sqrt(bending * bending + 4.0 * limit * tension_stiffness_);
    return std::max(2.0 * limit / (bending + root), least_taut_share * longest_stable_);
}

// From the mean of this tick's tensions; compression makes nothing stiffer.
void CosseratRod::note_tension(double h, int substeps) {
    double most = 0.0;
    for (int i = on_axis_; i < n_; ++i) {
        const double before = i > 0 ? std::max(pulled_[i], 0.0) * inverse_length_[i - 1] : 0.0;
        const double after = i < n_ - 1 ? std::max(pulled_[i + 1], 0.0) * inverse_length_[i] : 0.0;
        most = std::max(most, w_[i] * (before + after));
    }
    tension_stiffness_ = 2.0 * most / (h * h * substeps);
}

void CosseratRod::choose_substeps() {
    const Choice choice{now_.base.mode == RodEndMode::clamped, now_.tip.mode == RodEndMode::clamped};
    if (chosen_ != choice) {
        longest_stable_ = longest_stable(choice.is_base_clamped, choice.is_tip_clamped);
        chosen_ = choice;
        slowed_for_ = 0.0;
    }
    const double longest = std::min(longest_stable_, stable_under_tension());
    substeps_ = std::max(1, static_cast<int>(std::ceil(now_.dt / longest - 1e-9)));
    const double h = now_.dt / substeps_;
    // Velocities are half of the last substep behind.
    if (half_kick_ == 1.0) half_kick_ = 0.5 * (1.0 + last_substep_ / h);
    last_substep_ = h;
    if (h == slowed_for_) return;
    slowed_for_ = h;
    for (int i = 0; i < n_; ++i)
        slow_[i] = std::exp(-node_drag_[i] * h);
    for (int j = 0; j < n_ - 1; ++j)
        slow_spin_[j] = std::exp(-drag_[j] / mass_per_length_[j] * h);
}

void CosseratRod::prepare(const RodStep& input) {
    now_ = input;
    if (!input.rest_darboux.empty() &&
        !std::equal(input.rest_darboux.begin(), input.rest_darboux.end(), rest_darboux_.begin())) {
        std::copy(input.rest_darboux.begin(), input.rest_darboux.end(), rest_darboux_.begin());
        update_joints();
    }
    for (int i = 0; i < n_; ++i)
        w_[i] = 1.0 / mass_[i];
    base_from_ = position(0), tip_from_ = position(n_ - 1);
    base_clamp_from_ = base_clamp_, tip_clamp_from_ = tip_clamp_;
    if (input.base.mode == RodEndMode::clamped) w_[0] = 0.0;
    if (input.tip.mode == RodEndMode::clamped) w_[n_ - 1] = 0.0;
    update_guide();
    choose_substeps();
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
}

bool CosseratRod::step(const RodStep& input) {
    const auto start = Clock::now();
    times_ = {};
    save(saved_);
    prepare(input);
    const double h = input.dt / substeps_;
    factor_twist(h);
    prepare_contacts();
    elastic_moments(h, false);
    std::fill(pulled_.begin(), pulled_.end(), 0.0);
    int done = 0;
    while (done < substeps_) {
        substep(h, done++);
        if (input.farthest > 0.0 && is_far_enough((done + 1.0) / done)) break;
    }
    elapsed_ = done * h;
    if (!all_finite()) {
        load(saved_);
        for (Array* a : {&vx_, &vy_, &vz_, &spin_, &rate1_, &rate2_, &out_vx_, &out_vy_, &out_vz_})
            std::fill(a->begin(), a->end(), 0.0);
        memory_count_ = 0;
        base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
        std::fill(impulse_.begin(), impulse_.end(), Vec3{});
        return false;
    }
    remember_contacts();
    note_tension(h, done);
    publish(h);
    const double share = 1.0 / done;
    base_force_ = share * base_force_, base_torque_ = share * base_torque_;
    tip_force_ = share * tip_force_, tip_torque_ = share * tip_torque_;
    times_.total = seconds_since(start);
    return true;
}

// Whether with `further` times the way since the tick's start a node would be beyond what is allowed.
bool CosseratRod::is_far_enough(double further) const {
    const double *x = saved_.data(), *y = x + n_, *z = y + n_; // as the state begins
    double most = 0.0;
    for (int i = 0; i < n_; ++i) {
        const double dx = x_[i] - x[i], dy = y_[i] - y[i], dz = z_[i] - z[i];
        most = std::max(most, dx * dx + dy * dy + dz * dz);
    }
    return further * further * most > now_.farthest * now_.farthest;
}

void CosseratRod::substep(double h, int index) {
    const double progress = (index + 1.0) / substeps_;
    if (row_count_ > 0) begin_contacts(h, progress);
    base_torque_ += twist(h, progress, next_spin_) * now_.guide.direction;
    spin_.swap(next_spin_);
    twist_moments(h, spin_);
    elastic_forces();
    kick(h, half_kick_, progress);
    half_kick_ = 1.0;
    drift(h, progress);
    for (int k = 0; k < most_rounds; ++k) {
        const auto t0 = timing_ ? Clock::now() : Clock::time_point{};
        project_lengths(h);
        if (timing_) times_.constraints += seconds_since(t0);
        if (row_count_ == 0) break;
        const auto t1 = timing_ ? Clock::now() : Clock::time_point{};
        solve_contacts(h, progress);
        if (timing_) times_.contacts += seconds_since(t1);
        if (k + 1 >= iterations_ && worst_growth(h, progress) < 0.4 * recovery_speed_ * h) break;
    }
    limit_speed(h);
    if (row_count_ > 0) end_contacts(h);
    turn_frames(h);
    elastic_moments(h, true);
}

// Bounds speeds, of surfaces too, and keeps the positions that go with them.
void CosseratRod::limit_speed(double h) {
    const double limit = row_count_ > 0 && !(now_.farthest > 0.0) ? speed_limit_in_contact : speed_limit;
    const double *vx = vx_.data(), *vy = vy_.data(), *vz = vz_.data(), *radius = radius_.data();
    double *spin = spin_.data(), surface = 0.0, top = 0.0;
#pragma omp simd reduction(max : surface)
    for (int j = 0; j < n_ - 1; ++j)
        surface = std::max(surface, std::fabs(spin[j] * radius[j]));
    if (surface > limit)
        for (int j = 0; j < n_ - 1; ++j)
            spin[j] = std::clamp(spin[j], -limit / radius[j], limit / radius[j]);
#pragma omp simd reduction(max : top)
    for (int i = 0; i < n_; ++i)
        top = std::max(top, vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i]);
    if (!(top > limit * limit)) return;
    for (int i = 0; i < n_; ++i) {
        const double v = norm(Vec3{vx_[i], vy_[i], vz_[i]});
        if (v <= limit) continue;
        const double keep = limit / v, back = (keep - 1.0) * h;
        x_[i] += back * vx_[i], y_[i] += back * vy_[i], z_[i] += back * vz_[i];
        vx_[i] *= keep, vy_[i] *= keep, vz_[i] *= keep;
    }
}

bool CosseratRod::all_finite() const {
    double sum = 0.0;
    for (const Array* a :
         {&x_, &y_, &z_, &vx_, &vy_, &vz_, &qw_, &qx_, &qy_, &qz_, &spin_, &fx_, &fy_, &fz_, &torque_})
        for (double v : *a)
            sum += v * 0.0;
    return sum == 0.0;
}

// Leapfrog velocities are half a substep behind the positions. What is shown is brought to the same time:
// half a kick, contacts' last forces included (what rests between walls has no speed), then made compatible
// with the lengths, as RATTLE does (Andersen 1983).
void CosseratRod::publish(double h) {
    twist(h, 1.0, next_spin_);
    twist_moments(h, next_spin_);
    elastic_forces();
    for (int i = 0; i < n_; ++i) {
        const double s = 0.5 * h * w_[i];
        out_vx_[i] = vx_[i] + s * fx_[i], out_vy_[i] = vy_[i] + s * fy_[i], out_vz_[i] = vz_[i] + s * fz_[i];
    }
    add_contact_kick(0.5 * h);
    keep_lengths(out_vx_, out_vy_, out_vz_);
}

Vec3 CosseratRod::angular_velocity(int j) const {
    const Vec3 t{tx_[j + 1], ty_[j + 1], tz_[j + 1]};
    return inverse_length_[j] * cross(t, velocity(j + 1) - velocity(j)) + spin_[j] * t;
}

// Half a cell past the last segment's middle the frame has turned by u l / 2, u = rest + moment / K.
Quat CosseratRod::tip_frame() const {
    if (now_.tip.mode == RodEndMode::clamped) return tip_clamp_;
    const int i = n_ - 1, j = n_ - 2;
    const Quat q = frame(j);
    Vec3 m{};
    if (now_.tip.mode == RodEndMode::loaded) m = rotate(conjugate(q), now_.tip.torque);
    const double c = 1.0 / per_cell_[i];
    const Vec3 half{c * (rest1_[i] + m.x / k1_[i]), c * (rest2_[i] + m.y / k2_[i]),
                    c * (rest3_[i] + m.z / k3_[i])};
    return normalized(q * turn_of_measure(half));
}

Quat CosseratRod::base_frame() const {
    if (now_.base.mode == RodEndMode::clamped) return base_clamp_;
    const Quat q = frame(0);
    Vec3 m{};
    if (now_.base.mode == RodEndMode::loaded) m = rotate(conjugate(q), -now_.base.torque);
    const double c = 1.0 / per_cell_[0];
    const Vec3 half{c * (rest1_[0] + m.x / k1_[0]), c * (rest2_[0] + m.y / k2_[0]),
                    c * (rest3_[0] + m.z / k3_[0])};
    return normalized(q * conjugate(turn_of_measure(half)));
}

double CosseratRod::arc_length() const {
    double sum = 0.0;
    for (int j = 0; j < n_ - 1; ++j)
        sum += norm(position(j + 1) - position(j));
    return sum;
}

RodEnergies CosseratRod::energies() const {
    RodEnergies e;
    for (int i = 0; i < n_; ++i) {
        const Vec3 v = velocity(i);
        e.kinetic += 0.5 * mass_[i] * dot(v, v);
        // What lies in the sleeve has no weight: its height is the mouth's.
        e.gravity -= mass_[i] * dot(now_.gravity, i < on_axis_ ? now_.guide.origin : position(i));
    }
    for (int j = 0; j < n_ - 1; ++j)
        e.kinetic += 0.5 * polar_[j] * spin_[j] * spin_[j];
    for (int i = 0; i < n_; ++i) {
        Quat a, b;
        if (i == 0 && now_.base.mode == RodEndMode::clamped)
            a = base_clamp_, b = frame(0);
        else if (i == n_ - 1 && now_.tip.mode == RodEndMode::clamped)
            a = frame(i - 1), b = tip_clamp_;
        else if (i == 0 || i == n_ - 1)
            continue;
        else
            a = frame(i - 1), b = frame(i);
        const Quat p = conjugate(a) * b;
        const double s = (p.w < 0.0 ? -1.0 : 1.0) * turn_factor(std::fabs(p.w)), s1 = s * per_cell_[i],
                     s3 = s * per_twist_cell_[i];
        const double d1 = s1 * p.x - rest1_[i], d2 = s1 * p.y - rest2_[i], d3 = s3 * p.z - rest3_[i];
        e.bending += (k1_[i] * d1 * d1 + k2_[i] * d2 * d2) / per_cell_[i];
        e.twist += k3_[i] * d3 * d3 / per_twist_cell_[i];
    }
    return e;
}

} // namespace calot::rod_cosserat
