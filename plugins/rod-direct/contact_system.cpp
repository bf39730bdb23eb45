// The linear system of a pass over the contacts: what they add to the rod's own, and the nodes' displacements
// of its solution.
#include "contact_math.hpp"
#include "direct_rod.hpp"

#include <algorithm>

namespace calot::rod_direct {

namespace {

// -[arm] x, which makes a turn a displacement.
inline Mat<double> turn_matrix(const Vec3& arm) {
    return {{0, arm.z, -arm.y, -arm.z, 0, arm.x, arm.y, -arm.x, 0}};
}

} // namespace

DirectRod::Touched& DirectRod::touched(int j) {
    int& slot = touched_slot_[at(j)];
    if (slot < 0) {
        slot = static_cast<int>(touched_count_++);
        touched_[at(slot)] = {};
        touched_[at(slot)].segment = j;
    }
    return touched_[at(slot)];
}

void DirectRod::gather_contacts() {
    for (std::size_t k = 0; k < touched_count_; ++k)
        touched_slot_[at(touched_[k].segment)] = -1;
    touched_count_ = 0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const ContactRow& r = rows_[k];
        if (r.stiffness.xx + r.stiffness.yy + r.stiffness.zz == 0.0) continue;
        Touched& t = touched(r.segment);
        if (r.film > 0.0) {
            const Vec3 turned = cross(r.arm, r.across);
            const Vec3 force = (-r.film * r.across_0) * r.across;
            add_outer(t.stiffness, r.film, r.across);
            add_outer(t.turning, r.film, turned);
            for (int i = 0; i < 3; ++i)
                for (int c = 0; c < 3; ++c)
                    t.coupling.a[3 * i + c] += r.film * r.across[at(i)] * turned[at(c)];
            t.force += force;
            t.torque += cross(r.arm, force);
        }
        Mat<double> turn = turn_matrix(r.arm);
        for (int i = 0; i < 3; ++i)
            for (int c = 0; c < 3; ++c)
                turn.a[3 * i + c] += r.across[at(i)] * r.lever[at(c)];
        const Mat<double> coupling = rod_direct::times(r.stiffness, turn);
        t.stiffness = t.stiffness + r.stiffness;
        t.coupling = t.coupling + coupling;
        t.turning = t.turning + symmetric_transposed_times(turn, coupling);
        t.force += r.force;
        t.torque += cross(r.arm, r.force) + dot(r.across, r.force) * r.lever;
        if (r.other < 0) continue;
        Touched& o = touched(r.other);
        o.force -= r.given;
        o.torque -= cross(arm(r.other, r.other_along), r.given) + dot(r.across, r.given) * r.other_lever;
    }
}

// The system of this pass: the rod's own, the coupling's springs, the contacts and the sleeve's mouth.
void DirectRod::complete_system() {
    ChainSolver& s = solver_;
    for (int k = 0; k < 6; ++k)
        std::copy(h_[k].begin(), h_[k].end(), s.h[k].begin());
    std::copy(inverse_inertia_.begin(), inverse_inertia_.end(), s.w.begin());
    std::fill(s.plain.begin(), s.plain.end(), static_cast<unsigned char>(1));
    for (int k = 0; k < 3; ++k) {
        std::copy(g_[k].begin(), g_[k].end(), s.g[k].begin());
        const double *w = inverse_inertia_.data(), *b = b_[k].data();
        double* f = free_[k].data();
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i)
            f[i] = w[i] * b[i];
    }
    if (now_.tip.mode == RodEndMode::clamped) set_node(free_, m_, tip_place_ - position(m_));
    add_coupling();

    const int mouth = on_axis_ > 0 && on_axis_ < n_ ? on_axis_ - 1 : -1;
    const auto beside_full = [&](int i) {
        if (i > 0) s.plain[at(i - 1)] = 0;
        if (i < m_) s.plain[at(i)] = 0;
    };
    if (mouth >= 0) beside_full(mouth);
    for (std::size_t k = 0; k < touched_count_; ++k)
        beside_full(near_node(touched_[k].segment));
    const auto matrix = [&](int i) {
        return Sym<double>{s.full_w[0][at(i)], s.full_w[1][at(i)], s.full_w[2][at(i)],
                           s.full_w[3][at(i)], s.full_w[4][at(i)], s.full_w[5][at(i)]};
    };
    const auto set_matrix = [&](int i, const Sym<double>& w) {
        const double e[6] = {w.xx, w.xy, w.xz, w.yy, w.yz, w.zz};
        for (int k = 0; k < 6; ++k)
            s.full_w[k][at(i)] = e[k];
    };
    const auto on_axis = [&](double w) {
        const Vec3 d = now_.guide.direction;
        Sym<double> out{};
        add_outer(out, w, d);
        return out;
    };
    for (int j = 0; j < m_; ++j) {
        if (s.plain[at(j)] != 0) continue;
        for (const int i : {j, j + 1}) {
            const double w = s.w[at(i)];
            set_matrix(i, i == mouth ? on_axis(w) : Sym<double>{w, 0, 0, w, 0, w});
        }
        const double t[3] = {s.arm[0][at(j)], s.arm[1][at(j)], s.arm[2][at(j)]};
        const double e[9] = {0, t[2], -t[1], -t[2], 0, t[0], t[1], -t[0], 0};
        for (int k = 0; k < 9; ++k)
            s.e[k][at(j)] = e[k], s.z[k][at(j)] = 0.0;
    }
    for (std::size_t k = 0; k < touched_count_; ++k) {
        const Touched& t = touched_[k];
        const std::size_t j = at(t.segment);
        const int i = near_node(t.segment);
        const double w0 = s.w[at(i)];
        Sym<double> w{};
        if (w0 > 0.0) {
            Sym<double> inertia = t.stiffness;
            inertia.xx += 1.0 / w0, inertia.yy += 1.0 / w0, inertia.zz += 1.0 / w0;
            double minors[3];
            w = i == mouth ? on_axis(1.0 / dot(now_.guide.direction, times(inertia, now_.guide.direction)))
                           : inverse(inertia, minors);
            const Vec3 force = (1.0 / w0) * row(free_, i) + t.force;
            set_node(free_, i, times(w, force));
        }
        set_matrix(i, w);
        const Vec3 f = row(free_, i);
        const Mat<double> wy = rod_direct::times(w, t.coupling);
        const Vec<double> yf = transposed_times(t.coupling, vec(f));
        const Sym<double> less = symmetric_transposed_times(t.coupling, wy);
        const Sym<double> h = t.turning - less;
        const double add[6] = {h.xx, h.xy, h.xz, h.yy, h.yz, h.zz};
        for (int c = 0; c < 6; ++c)
            s.h[c][j] += add[c];
        s.g[0][j] += t.torque.x - yf.x, s.g[1][j] += t.torque.y - yf.y, s.g[2][j] += t.torque.z - yf.z;
        const double side = i == t.segment ? 1.0 : -1.0;
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) {
                s.e[3 * r + c][j] += side * wy(c, r);
                s.z[3 * r + c][j] = -side * wy(r, c);
            }
    }
    for (int j = 0; j < m_; ++j) {
        if (s.plain[at(j)] != 0) continue;
        const double diagonal = s.soft[at(j)];
        const Sym<double> sum = matrix(j) + matrix(j + 1);
        const double v[6] = {sum.xx + diagonal, sum.xy, sum.xz, sum.yy + diagonal, sum.yz, sum.zz + diagonal};
        for (int c = 0; c < 6; ++c)
            s.v[c][at(j)] = v[c];
    }
    for (int k = 0; k < 3; ++k) {
        const double *f = free_[k].data(), *n = force_[k].data(), *soft = s.soft.data();
        double* r = s.r[k].data();
#pragma GCC ivdep
        for (int j = 0; j < m_; ++j)
            r[j] = f[j] - f[j + 1] - soft[j] * std::clamp(n[j], -1e4, 1e4);
    }
}

// Nodes' displacements of the solution: the base's by its own balance, then segment by segment.
void DirectRod::displace() {
    Vec3 p{};
    if (now_.base.mode != RodEndMode::clamped) {
        const Vec3 n = row(solver_.n, 0);
        p = row(free_, 0);
        const int slot = touched_slot_[0];
        if (slot < 0) {
            p += solver_.w[0] * n;
        } else {
            const Sym<double> w{solver_.full_w[0][0], solver_.full_w[1][0], solver_.full_w[2][0],
                                solver_.full_w[3][0], solver_.full_w[4][0], solver_.full_w[5][0]};
            const Vec<double> turned = rod_direct::times(touched_[at(slot)].coupling, vec(row(solver_.a, 0)));
            p += times(w, n - vec3(turned));
        }
        if (on_axis_ > 0) p = dot(p, now_.guide.direction) * now_.guide.direction;
    }
    const double *ax = solver_.a[0].data(), *ay = solver_.a[1].data(), *az = solver_.a[2].data();
    const double *tx = direction_[0].data(), *ty = direction_[1].data(), *tz = direction_[2].data();
    for (int j = 0; j < m_; ++j) {
        set_node(moved_, j, p);
        const double l = length_[at(j)];
        p.x += l * (ay[j] * tz[j] - az[j] * ty[j]);
        p.y += l * (az[j] * tx[j] - ax[j] * tz[j]);
        p.z += l * (ax[j] * ty[j] - ay[j] * tx[j]);
    }
    set_node(moved_, m_, p);
}

} // namespace calot::rod_direct
