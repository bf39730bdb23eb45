// Ends: clamps, loads, the coupling, and the sleeve before the patient.
#include "direct_rod.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_direct {

namespace {

// An endoscope bent to 25 mm at its mouth pushes itself out with about as much.
constexpr double sleeve_limit = 30.0; // N
// How often the coupling may leave its cap in a tick.
constexpr int most_releases = 3;
// The least part of a cell that bends at the sleeve's mouth.
constexpr double least_cell = 1e-3;

// The force at the tick's end, as force - stiffness * displacement.
struct Spring {
    double force, stiffness;
};

Spring at_end(const RodCoupling& c, double at, double start, double h, double capped) {
    const double rate = (at - start) / h;
    const double force = c.stiffness * (c.target + c.velocity * h - at) + c.damping * (c.velocity - rate);
    const double stiffness = c.stiffness + c.damping / h;
    if (capped != 0.0) return {capped * c.cap, 0.0};
    return {force, stiffness};
}

} // namespace

// Cells of the joints, the length over which each bends: half of either neighbour. At a clamp the sum of the
// moments is a trapezoid rule whose error of second order, h^2/12 times the moment's slope, would be the
// greatest of all; end weights take it away, Gregory's 3/8, 7/6, 23/24 of second order. They are taken 1.1
// times as far from 1/2, 1, 1 as Gregory's: so what is left has one sign at any load, and falls with the
// square of the spacing (with exactly Gregory's it is half as large, and passes zero here and there).
void DirectRod::update_joints() {
    const auto stiffness = [&](const Array& k, double a, int i, double b, int j) {
        // Moments are continuous, compliances add.
        const double compliance = (a > 0.0 ? a / k[at(i)] : 0.0) + (b > 0.0 ? b / k[at(j)] : 0.0);
        return compliance > 0.0 ? 1.0 / compliance : 0.0;
    };
    constexpr double beyond = 1.1, first = beyond / 8.0, second = beyond / 24.0;
    viscous_ = false;
    mouth_.joint = -1;
    for (int i = 0; i < n_; ++i) {
        const int left = std::max(i - 1, 0), right = std::min(i, m_ - 1);
        double a = i > 0 ? 0.5 * length_[at(left)] : 0.0, b = i < m_ ? 0.5 * length_[at(right)] : 0.0;
        if (base_cells_) {
            a += (i == 1 ? first : i == 2 ? -second : 0.0) * length_[at(left)];
            b += (i == 0 ? -first : i == 1 ? second : 0.0) * length_[at(right)];
        } else if (i == 0) {
            b = 0.0;
        }
        if (tip_cells_) {
            a += (i == m_ ? -first : i == m_ - 1 ? second : 0.0) * length_[at(left)];
            b += (i == m_ - 1 ? first : i == m_ - 2 ? -second : 0.0) * length_[at(right)];
        } else if (i == m_) {
            a = 0.0;
        }
        const std::size_t s = at(i);
        k_[0][s] = stiffness(bending_1_, a, left, b, right);
        k_[1][s] = stiffness(bending_2_, a, left, b, right);
        k_[2][s] = stiffness(torsion_, a, left, b, right);
        cell_[s] = a + b;
        for (int c = 0; c < 3; ++c)
            rest_[c][s] = a * rest_darboux_[3 * at(left) + at(c)] + b * rest_darboux_[3 * at(right) + at(c)];
        const double share = a + b > 0.0 ? 1.0 / (a + b) : 0.0;
        viscosity_[0][s] = viscosity_[1][s] =
            share * (a * bending_damping_[at(left)] + b * bending_damping_[at(right)]);
        viscosity_[2][s] = share * (a * torsion_damping_[at(left)] + b * torsion_damping_[at(right)]);
        viscous_ = viscous_ || viscosity_[0][s] > 0.0 || viscosity_[2][s] > 0.0;
    }
}

// Which nodes lie in the sleeve, and how much of the joint's cell at its mouth does not: c = clamp(a + l/2,
// 0, l) at axial coordinate a. So the clamp moves continuously with the mouth. A bent rod pushes itself out
// of it with EI (u^2 - u_0^2) / 2 (Bigoni et al. 2015), the change of bending energy as the clamp moves.
void DirectRod::update_guide() {
    if (mouth_.joint >= 0)
        for (int a = 0; a < 2; ++a)
            k_[a][at(mouth_.joint)] = mouth_.k[a], rest_[a][at(mouth_.joint)] = mouth_.rest[a];
    mouth_.joint = -1;
    on_axis_ = 0;
    mouth_push_ = 0.0;
    if (!now_.guide.present) return;
    const Vec3 d = now_.guide.direction, o = now_.guide.origin;
    const auto axial = [&](int i) { return dot(position(i) - o, d); };
    while (on_axis_ < n_ && axial(on_axis_) < 0.5 * length_[at(std::max(on_axis_ - 1, 0))])
        ++on_axis_;
    if (now_.base.mode == RodEndMode::coupled) on_axis_ = std::max(on_axis_, 2);
    for (int i = 0; i < on_axis_; ++i) {
        const Vec3 p = position(i);
        set_node(x_, i, o + dot(p - o, d) * d);
        set_node(v_, i, dot(row(v_, i), d) * d);
    }
    for (int j = 0; j + 1 < on_axis_; ++j) {
        set_frame(j + 1, normalized(between(axis_z(frame(j)), d) * frame(j)));
        spin_[0][at(j)] = spin_[1][at(j)] = 0.0;
    }
    const int i = on_axis_ - 1;
    if (i < 1 || i >= m_) return;
    const std::size_t s = at(i);
    const double full = cell_[s], c = std::clamp(axial(i) + 0.5 * length_[s], least_cell * full, full);
    const Vec3 phi = turn_vector(conjugate(frame(i - 1)) * frame(i));
    const double longer = full / c, shorter = c / full;
    double out = 0.0;
    mouth_ = {i, {k_[0][s], k_[1][s]}, {rest_[0][s], rest_[1][s]}};
    for (int a = 0; a < 2; ++a) {
        const double k = k_[a][s] * full, u0 = rest_[a][s] / full;
        k_[a][s] *= longer;
        rest_[a][s] *= shorter;
        const double u = (a == 0 ? phi.x : phi.y) / c;
        out += 0.5 * k * (u * u - u0 * u0);
    }
    mouth_push_ = std::clamp(out, -sleeve_limit, sleeve_limit);
}

// The frames of the ends' cross-sections: a clamp's, or, where no joint is, the segment's.
void DirectRod::hold_ends() {
    set_frame(0, now_.base.mode == RodEndMode::clamped ? base_clamp_ : frame(0));
    set_frame(n_, now_.tip.mode == RodEndMode::clamped ? tip_clamp_ : frame(m_ - 1));
}

// What the ends add to the rod's own part of the system.
void DirectRod::add_ends() {
    const auto add = [](Array* to, int i, const Vec3& v) {
        to[0][at(i)] += v.x, to[1][at(i)] += v.y, to[2][at(i)] += v.z;
    };
    if (now_.base.mode == RodEndMode::loaded) add(b_, 0, now_.base.force), add(g_, 0, now_.base.torque);
    if (now_.tip.mode == RodEndMode::loaded)
        add(b_, n_ - 1, now_.tip.force), add(g_, m_ - 1, now_.tip.torque);
    if (mouth_push_ != 0.0) add(b_, on_axis_ - 1, mouth_push_ * now_.guide.direction);
}

// The coupling's springs on the base, as far as they are not at their caps.
void DirectRod::add_coupling() {
    if (now_.base.mode != RodEndMode::coupled) return;
    const Vec3 d = now_.guide.direction;
    const double h = now_.dt;
    const Spring s = at_end(now_.base.axial, dot(position(0) - now_.guide.origin, d),
                            dot(row(x0_, 0) - now_.guide.origin, d), h, axial_cap_);
    solver_.w[0] = 1.0 / (inertia_[0] + s.stiffness);
    set_node(free_, 0, solver_.w[0] * (row(b_, 0) + s.force * d));
    const double turned = dot(row(turn_, 0), d);
    const Spring t = at_end(now_.base.roll, roll_ + turned, roll_, h, roll_cap_);
    const double e[3] = {d.x, d.y, d.z};
    int k = 0;
    for (int r = 0; r < 3; ++r) {
        solver_.g[r][0] += t.force * e[r];
        for (int c = r; c < 3; ++c, ++k)
            solver_.h[k][0] += t.stiffness * e[r] * e[c];
    }
}

bool DirectRod::is_cap_passed() const {
    return now_.base.mode == RodEndMode::coupled && (std::fabs(coupling_force_) > now_.base.axial.cap ||
                                                     std::fabs(coupling_torque_) > now_.base.roll.cap);
}

// Whether a spring of the coupling passes its cap, or comes back below it, at the solution.
bool DirectRod::judge_caps() {
    if (now_.base.mode != RodEndMode::coupled) return false;
    const Vec3 d = now_.guide.direction;
    const double h = now_.dt;
    const auto judge = [&](const RodCoupling& c, double at, double start, double more, double& cap,
                           double& force, int& releases) {
        const Spring s = at_end(c, at, start, h, 0.0);
        const double free = s.force - s.stiffness * more;
        force = cap != 0.0 ? cap * c.cap : free;
        double next = free > c.cap ? 1.0 : free < -c.cap ? -1.0 : 0.0;
        // Back and forth between passes: at the cap, which is never passed, for the rest of the tick.
        if (next == 0.0 && cap != 0.0 && ++releases > most_releases) next = cap;
        const bool changes = next != cap;
        cap = next;
        return changes;
    };
    const Vec3 a{solver_.a[0][0], solver_.a[1][0], solver_.a[2][0]};
    const bool axial = judge(now_.base.axial, dot(position(0) - now_.guide.origin, d),
                             dot(row(x0_, 0) - now_.guide.origin, d), dot(node_displacement(0), d),
                             axial_cap_, coupling_force_, axial_releases_);
    const bool roll = judge(now_.base.roll, roll_ + dot(row(turn_, 0), d), roll_, dot(a, d), roll_cap_,
                            coupling_torque_, roll_releases_);
    return axial || roll;
}

// What the holders exert, at the tick's end: the rest of the end node's balance, and the joint's moment.
void DirectRod::report_ends() {
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
    const double per_h = 1.0 / stage_;
    const auto lacking = [&](int i) {
        const Vec3 v = row(v_, i), moved = per_h * (position(i) - row(x0_, i));
        return mass_[at(i)] * (per_h * (moved - v) - now_.gravity) + node_drag_[at(i)] * moved;
    };
    const auto section = [&](int j) { return row(force_, j); };
    const auto turned_moment = [&](int joint, int j) { // by the last increment of segment j
        const std::size_t i = at(joint);
        const Vec3 a = row(taken_turn_, j);
        return Vec3{joint_k_[0][i] * a.x + joint_k_[1][i] * a.y + joint_k_[2][i] * a.z,
                    joint_k_[1][i] * a.x + joint_k_[3][i] * a.y + joint_k_[4][i] * a.z,
                    joint_k_[2][i] * a.x + joint_k_[4][i] * a.y + joint_k_[5][i] * a.z};
    };
    const auto contact = [&](int i) { // what contacts put on this node
        Vec3 f;
        for (std::size_t k = 0; k < row_count_; ++k) {
            if (rows_[k].node == i) f += rows_[k].f + film_force(rows_[k]);
            if (rows_[k].other >= 0 && near_node(rows_[k].other) == i) f -= rows_[k].given;
        }
        return f;
    };
    switch (now_.base.mode) {
    case RodEndMode::clamped:
        base_force_ = lacking(0) - section(0) - contact(0);
        base_torque_ = -(row(moment_, 0) + turned_moment(0, 0));
        break;
    case RodEndMode::loaded:
        base_force_ = now_.base.force, base_torque_ = now_.base.torque;
        break;
    case RodEndMode::coupled:
        base_force_ = coupling_force_ * now_.guide.direction;
        base_torque_ = coupling_torque_ * now_.guide.direction;
        break;
    case RodEndMode::free:
        break;
    }
    if (now_.tip.mode == RodEndMode::clamped) {
        tip_force_ = lacking(n_ - 1) + section(m_ - 1) - contact(n_ - 1);
        tip_torque_ = row(moment_, m_) - turned_moment(m_, m_ - 1);
    } else if (now_.tip.mode == RodEndMode::loaded) {
        tip_force_ = now_.tip.force, tip_torque_ = now_.tip.torque;
    }
}

} // namespace calot::rod_direct
