// Contacts inside the solve: non-penetration with the other side's compliance and Coulomb friction with
// stick, by an active set (semi-smooth Newton) whose forces are linear in the rod's displacement. A segment
// is rigid, so a contact moves with one of its nodes and the segment's turn: its stiffness stays within that
// segment's block and the coupling to one neighbour.
#include "direct_rod.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_direct {

namespace {

// m/N, of any contact, in all directions: 1 um under 10 N. Rigid walls are met this closely.
constexpr double least_compliance = 1e-7;
// Overlap that is there at a tick's start is taken back by this share of it, and no faster than the recovery
// speed.
constexpr double taken_back = 0.25;
// A friction bound follows the normal force until it is this close, relative and N.
constexpr double same_force = 0.05, small_force = 1e-3;
// Passes in which friction's direction and bound are still followed.
constexpr int friction_passes = 3;
// From these passes on a contact no longer changes between stick and slip, or opens: an end to cycles.
constexpr int last_switch = 6, closing_only = 6;

inline Vec<double> vec(const Vec3& a) {
    return {a.x, a.y, a.z};
}
inline Vec3 vec3(const Vec<double>& a) {
    return {a.x, a.y, a.z};
}
inline Vec3 times(const Sym<double>& s, const Vec3& a) {
    return vec3(rod_direct::times(s, vec(a)));
}
inline void add_outer(Sym<double>& s, double k, const Vec3& n) {
    s.xx += k * n.x * n.x, s.xy += k * n.x * n.y, s.xz += k * n.x * n.z;
    s.yy += k * n.y * n.y, s.yz += k * n.y * n.z, s.zz += k * n.z * n.z;
}
// -[arm] x, which makes a turn a displacement.
inline Mat<double> turn_matrix(const Vec3& arm) {
    return {{0, arm.z, -arm.y, -arm.z, 0, arm.x, arm.y, -arm.x, 0}};
}

} // namespace

Vec3 DirectRod::point(int j, double along) const {
    return (1.0 - along) * position(j) + along * position(j + 1);
}

// From the segment's near node to a point at the present iterate.
Vec3 DirectRod::arm(int j, double along, const Vec3& lever) const {
    const double t = near_node(j) == j ? along : along - 1.0;
    return (t * length_[at(j)]) * third_axis(frame(j)) + lever;
}

Vec3 DirectRod::displacement(int node, int segment, const Vec3& arm) const {
    return row(moved_, node) + cross(row(solver_.a, segment), arm);
}

double DirectRod::gap_now(const ContactRow& r) const {
    Vec3 p = point(r.segment, r.along);
    if (r.other >= 0) p -= point(r.other, r.other_along);
    return r.gap + dot(r.normal, p - r.centre - r.motion);
}

// Slip of the surfaces since the tick's start, and what they had when they last stuck; tangential.
Vec3 DirectRod::slip(const ContactRow& r) const {
    Vec3 s = point(r.segment, r.along) - r.start + cross(row(turn_, r.segment), r.lever) - r.motion;
    if (r.other >= 0)
        s -= point(r.other, r.other_along) - r.other_start + cross(row(turn_, r.other), r.other_lever);
    s += r.anchor;
    return s - dot(s, r.normal) * r.normal;
}

void DirectRod::prepare_contacts() {
    contact_count_ = std::min(now_.contacts.size(), impulse_.size());
    row_count_ = 0;
    for (std::size_t k = 0; k < contact_count_; ++k) {
        const Contact& c = now_.contacts[k];
        impulse_[k] = {};
        // What lies in the sleeve is not in the patient.
        if (c.segment + 1 < on_axis_) continue;
        ContactRow& r = rows_[row_count_++];
        r = {};
        r.index = static_cast<int>(k);
        r.segment = c.segment, r.node = near_node(c.segment), r.along = c.along;
        r.normal = c.normal, r.lever = -radius_[at(c.segment)] * c.normal;
        r.gap = c.gap, r.friction = c.friction * friction_[at(c.segment)];
        r.centre = c.centre, r.motion = c.motion;
        const auto start = [&](int j, double t) { return (1.0 - t) * row(x0_, j) + t * row(x0_, j + 1); };
        r.start = start(c.segment, c.along);
        const auto& m = c.compliance;
        r.compliance = {m[0], 0.5 * (m[1] + m[3]), 0.5 * (m[2] + m[6]), m[4], 0.5 * (m[5] + m[7]), m[8]};
        Vec3 between = r.start;
        if (c.other_segment >= 0) {
            const int o = c.other_segment;
            r.other = o, r.other_along = c.other_along;
            r.other_lever = radius_[at(o)] * c.normal;
            r.other_start = start(o, c.other_along);
            between -= r.other_start;
            // Until it is solved for with the other segment's own displacement, that gives way by its nodes'
            // masses.
            const double t = c.other_along;
            const double give =
                (1.0 - t) * (1.0 - t) * inverse_inertia_[at(o)] + t * t * inverse_inertia_[at(o) + 1];
            r.compliance.xx += give, r.compliance.yy += give, r.compliance.zz += give;
        }
        const double before = r.gap + dot(r.normal, between - r.centre);
        if (before < 0.0) r.bound = before + std::min(recovery_speed_ * now_.dt, -taken_back * before);
        const ContactMemory* known = nullptr;
        for (std::size_t s = 0; s < memory_count_ && known == nullptr; ++s) {
            // Contacts mostly keep their order from tick to tick.
            const ContactMemory& candidate = memory_[(k + s) % memory_count_];
            if (candidate.id == c.id) known = &candidate;
        }
        if (known != nullptr) {
            r.anchor = known->anchor - dot(known->anchor, r.normal) * r.normal;
            r.f_n = std::max(0.0, dot(known->f, r.normal));
            r.reaction = known->f;
            r.touch = known->slips ? Touch::slip : Touch::stick;
            const Vec3 across = known->f - dot(known->f, r.normal) * r.normal;
            r.heading = norm(across) > 0.0 ? normalized(across) : Vec3{};
        } else {
            const double gap = gap_now(r);
            if (gap < r.bound) {
                r.touch = Touch::slip;
                const double give =
                    inverse_inertia_[at(r.node)] + dot(r.normal, times(r.compliance, r.normal));
                if (give > 0.0) r.f_n = (r.bound - gap) / give;
            }
        }
        if (r.touch == Touch::slip) {
            const Vec3 s = slip(r);
            r.slid = norm(s);
            if (r.slid > least_compliance * r.friction * r.f_n) r.heading = (-1.0 / r.slid) * s;
        }
    }
}

// The contact's force as a linear function of its displacement from the present iterate.
void DirectRod::law(ContactRow& r) const {
    r.stiffness = {};
    r.force = {};
    if (r.touch == Touch::open) return;
    Vec3 shift{};
    if (r.other >= 0) {
        // The other segment's displacement at the last solve, were its reaction not there.
        const double t = r.other_along;
        const double give =
            (1.0 - t) * (1.0 - t) * inverse_inertia_[at(r.other)] + t * t * inverse_inertia_[at(r.other) + 1];
        shift = -r.other_moved - give * r.reaction;
    }
    const double gap = gap_now(r) + dot(r.normal, shift) - r.bound;
    Vec3 across = slip(r) + shift;
    across -= dot(across, r.normal) * r.normal;
    if (r.touch == Touch::stick) {
        Sym<double> c = r.compliance;
        c.xx += least_compliance, c.yy += least_compliance, c.zz += least_compliance;
        double minors[3];
        r.stiffness = inverse(c, minors);
        r.force = -times(r.stiffness, gap * r.normal + across);
        return;
    }
    const double bound = r.friction * r.f_n;
    const double c = least_compliance + dot(r.normal, times(r.compliance, r.normal));
    const double beside = bound > 0.0 ? bound * dot(r.normal, times(r.compliance, r.heading)) : 0.0;
    add_outer(r.stiffness, 1.0 / c, r.normal);
    r.force = (-(gap + beside) / c) * r.normal;
    if (!(bound > 0.0)) return;
    // As the surfaces slide another way friction turns with them.
    const double turning = bound / std::max(r.slid, least_compliance * bound);
    const Vec3 side = cross(r.normal, r.heading);
    add_outer(r.stiffness, turning, side);
    r.force += bound * r.heading - (turning * dot(side, across)) * side;
}

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
        ContactRow& r = rows_[k];
        law(r);
        r.arm = arm(r.segment, r.along, r.lever);
        if (r.touch == Touch::open) continue;
        Touched& t = touched(r.segment);
        const Mat<double> turn = turn_matrix(r.arm), coupling = rod_direct::times(r.stiffness, turn);
        t.stiffness = t.stiffness + r.stiffness;
        t.coupling = t.coupling + coupling;
        t.turning = t.turning + symmetric_transposed_times(turn, coupling);
        t.force += r.force;
        t.torque += cross(r.arm, r.force);
        if (r.other < 0) continue;
        Touched& o = touched(r.other);
        o.force -= r.reaction;
        o.torque -= cross(arm(r.other, r.other_along, r.other_lever), r.reaction);
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
    if (now_.tip.mode == EndMode::clamped) set_node(free_, m_, now_.tip.position - position(m_));
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
        // On the axis sideways forces act on nothing.
        if (j + 1 <= mouth)
            for (int c : {0, 3, 5})
                s.v[c][at(j)] += s.w[at(j)];
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
    if (now_.base.mode != EndMode::clamped) {
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

// What each contact does at the solution. True if the next pass would use other laws.
bool DirectRod::judge_contacts(int pass) {
    bool changes = false;
    for (std::size_t k = 0; k < row_count_; ++k) {
        ContactRow& r = rows_[k];
        const Vec3 moved = displacement(r.node, r.segment, r.arm);
        Vec3 other{};
        if (r.other >= 0) {
            other = displacement(near_node(r.other), r.other, arm(r.other, r.other_along, r.other_lever));
            r.other_moved = other;
        }
        r.f = r.force - times(r.stiffness, moved);
        const double gap = gap_now(r) + dot(r.normal, moved - other), f_n = dot(r.f, r.normal);
        Vec3 slid = slip(r) + moved - other;
        slid -= dot(slid, r.normal) * r.normal;
        const auto slide = [&](const Vec3& fallback) {
            r.slid = norm(slid);
            const Vec3 heading = r.slid > least_compliance * r.friction * r.f_n && r.slid > 0.0
                                     ? (-1.0 / r.slid) * slid
                                     : fallback;
            const double turned = dot(heading, r.heading);
            r.heading = heading;
            return turned;
        };
        if (r.other >= 0) {
            if (norm(r.f - r.reaction) > same_force * norm(r.f) + small_force) changes = true;
            r.reaction = r.f;
        }
        if (r.touch == Touch::open) {
            if (gap >= r.bound) continue;
            const double give = inverse_inertia_[at(r.node)] + dot(r.normal, times(r.compliance, r.normal));
            r.f_n = give > 0.0 ? (r.bound - gap) / give : 0.0;
            r.touch = Touch::slip;
            slide({});
            changes = true;
            continue;
        }
        if (f_n <= 0.0 && pass < closing_only) {
            r.touch = Touch::open;
            r.f_n = 0.0;
            changes = true;
            continue;
        }
        const double bound_before = r.friction * r.f_n;
        r.f_n = std::max(0.0, f_n);
        if (r.friction == 0.0) continue;
        if (r.touch == Touch::stick) {
            const Vec3 across = r.f - f_n * r.normal;
            const double size = norm(across);
            if (size <= r.friction * r.f_n) continue;
            r.touch = Touch::slip;
            slide(across / size);
            if (pass < last_switch) changes = true;
            continue;
        }
        if (dot(slid, r.heading) > 0.0 || r.heading == Vec3{}) {
            r.touch = Touch::stick;
            if (pass < last_switch) changes = true;
            continue;
        }
        const double turned = slide(r.heading);
        const double off = std::fabs(r.friction * r.f_n - bound_before);
        if (pass < friction_passes &&
            (off > same_force * bound_before + small_force || (turned < 0.99 && bound_before > small_force)))
            changes = true;
    }
    return changes;
}

void DirectRod::finish_contacts() {
    memory_count_ = 0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const ContactRow& r = rows_[k];
        const auto index = static_cast<std::size_t>(r.index);
        impulse_[index] = now_.dt * r.f;
        if (r.touch == Touch::open) continue;
        // Friction is carried by what the surfaces' own compliance has given way.
        const Vec3 across = r.f - dot(r.f, r.normal) * r.normal;
        memory_[memory_count_++] = {now_.contacts[index].id, -least_compliance * across, r.f,
                                    r.touch == Touch::slip};
    }
    now_.contacts = {};
}

} // namespace calot::rod_direct
