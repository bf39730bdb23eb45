// Contacts inside the solve: non-penetration with the other side's compliance and Coulomb friction with
// stick, by semi-smooth Newton passes with an exact line search. A segment is rigid, so a contact moves with
// one of its nodes and the segment's turn: its stiffness stays within that segment's block and the coupling
// to one neighbour.
#include "contact_math.hpp"
#include "direct_rod.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace calot::rod_direct {

namespace {

using Clock = std::chrono::steady_clock;

// m/N, of any contact, in all directions: 1 um under 10 N. Rigid walls are met this closely.
constexpr double least_give = 1e-7;
// Overlap that is there at a tick's start is taken back by this share of it, and no faster than the recovery
// speed.
constexpr double taken_back = 0.25;
// Deep overlap falls by a factor e in this time.
constexpr double deep_recovery = 4e-3; // s
// What a pass may leave: overlap of an open contact (m); a closed one's pull, and friction off its law, by a
// share of the force or by what moves its node this far (m) in a tick.
constexpr double small_overlap = 1e-6, small_share = 0.05, small_way = 1e-7;
// Normals are of a pose one tick or more ago. A rod pressed with F into a groove of radius R swings across it
// as a pendulum of stiffness F / R; the delay t makes this an undamped growth, F t / R of negative damping. A
// film between the surfaces takes that for R from 3 mm, across the rod only: 0.1 m/s sideways, at steps of 1
// ms, cost 5 % of F.
constexpr double film_per_step = 500.0; // 1/m
// What most_friction keeps of itself while the normal force is less.
constexpr double kept = 0.8;

} // namespace

Vec3 DirectRod::point(int j, double along) const {
    return (1.0 - along) * position(j) + along * position(j + 1);
}

// From the segment's near node to a point of its centreline at the present iterate.
Vec3 DirectRod::arm(int j, double along) const {
    const double t = near_node(j) == j ? along : along - 1.0;
    return (t * length_[at(j)]) * axis_z(frame(j));
}

// Of a surface point, at the solution.
Vec3 DirectRod::displacement(int j, double along, const Vec3& across, const Vec3& lever) const {
    const Vec3 turn = row(solver_.a, j);
    return row(moved_, near_node(j)) + cross(turn, arm(j, along)) + dot(lever, turn) * across;
}

double DirectRod::gap_now(const ContactRow& r) const {
    Vec3 p = point(r.segment, r.along);
    if (r.other >= 0) p -= point(r.other, r.other_along);
    return r.gap + dot(r.normal, p - r.centre - r.motion);
}

// Slip of the surfaces since the tick's start, and what they had when they last stuck; tangential.
Vec3 DirectRod::slip(const ContactRow& r) const {
    Vec3 s = point(r.segment, r.along) - r.start + dot(r.lever, row(turn_, r.segment)) * r.across - r.motion;
    if (r.other >= 0)
        s -= point(r.other, r.other_along) - r.other_start +
             dot(r.other_lever, row(turn_, r.other)) * r.across;
    s += r.anchor;
    return s - dot(s, r.normal) * r.normal;
}

void DirectRod::prepare_contacts() {
    contact_count_ = std::min(now_.contacts.size(), impulse_.size());
    row_count_ = 0;
    for (std::size_t k = 0; k < contact_count_; ++k) {
        const RodContact& c = now_.contacts[k];
        if (now_.from == 0.0) impulse_[k] = {};
        // What lies in the sleeve is not in the patient.
        if (c.segment + 1 < on_axis_) continue;
        ContactRow& r = rows_[row_count_++];
        r = {};
        r.index = static_cast<int>(k);
        r.segment = c.segment, r.node = near_node(c.segment), r.along = c.along;
        r.normal = c.normal;
        r.gap = c.gap, r.friction = c.friction * friction_[at(c.segment)];
        r.centre = c.centre + now_.from * c.motion, r.motion = now_.share * c.motion;
        const auto start = [&](int j, double t) { return (1.0 - t) * row(x0_, j) + t * row(x0_, j + 1); };
        r.start = start(c.segment, c.along);
        auto m = c.compliance;
        for (double& v : m)
            v *= now_.share;
        const Vec3 given{m[0] * c.normal.x + m[1] * c.normal.y + m[2] * c.normal.z,
                         m[3] * c.normal.x + m[4] * c.normal.y + m[5] * c.normal.z,
                         m[6] * c.normal.x + m[7] * c.normal.y + m[8] * c.normal.z};
        const double along = std::max(0.0, dot(c.normal, given));
        r.give = least_give + along;
        r.give_across = least_give + std::max(0.0, 0.5 * (m[0] + m[4] + m[8] - along));
        Vec3 between = r.start;
        if (c.other_segment >= 0) {
            const int o = c.other_segment;
            r.other = o, r.other_along = c.other_along;
            r.other_start = start(o, c.other_along);
            between -= r.other_start;
            r.give += other_give(r), r.give_across += other_give(r);
        }
        const Vec3 axis = axis_z(frame(c.segment));
        r.across = normalized(cross(r.normal, axis), {});
        const auto lever = [&](double radius, const Vec3& t) {
            return dot(t, cross(radius * r.normal, r.across)) * t;
        };
        r.lever = lever(-radius_[at(c.segment)], axis);
        if (r.other >= 0) r.other_lever = lever(radius_[at(r.other)], axis_z(frame(r.other)));
        // What earlier parts will have moved the other side by at the tick's end.
        if (now_.from > 0.0) r.gap += dot(given, impulse_[k]) / now_.dt;
        const double before = r.gap + dot(r.normal, between - r.centre);
        if (before < 0.0)
            r.bound =
                before + std::min(std::max(recovery_speed_ * now_.dt, -before * now_.dt / deep_recovery),
                                  -taken_back * before);
        for (std::size_t s = 0; s < memory_count_; ++s) {
            // Contacts mostly keep their order from tick to tick.
            const ContactMemory& known = memory_[(k + s) % memory_count_];
            if (known.id != c.id) continue;
            r.anchor = known.anchor - dot(known.anchor, r.normal) * r.normal;
            r.given = known.f;
            r.was_normal = std::max(0.0, dot(known.f, r.normal));
            r.most_friction = r.friction * known.most_normal;
            break;
        }
    }
}

// How the other segment of a self-contact gives way, until that is solved for: by its nodes' masses.
double DirectRod::other_give(const ContactRow& r) const {
    const double t = r.other_along;
    return (1.0 - t) * (1.0 - t) * inverse_inertia_[at(r.other)] + t * t * inverse_inertia_[at(r.other) + 1];
}

void DirectRod::begin_passes() {
    for (auto* group : {taken_moved_, taken_turn_})
        for (int i = 0; i < 3; ++i)
            std::fill(group[i].begin(), group[i].end(), 0.0);
    for (std::size_t k = 0; k < row_count_; ++k) {
        ContactRow& r = rows_[k];
        r.arm = arm(r.segment, r.along);
        r.gap_0 = gap_now(r) - r.bound;
        r.slip_0 = slip(r);
        r.across_0 = dot(r.across, point(r.segment, r.along) - r.start - r.motion);
        if (r.other >= 0) r.across_0 -= dot(r.across, point(r.other, r.other_along) - r.other_start);
        r.moved = r.other_moved = {};
        linearise(r, r.was_normal > 0.0);
    }
}

// A contact's force where its surface point has moved by `moved`, and how it changes there. Friction is
// min(bound, coefficient times normal force) against the slip: what of it changes with the normal force has
// no potential and is left out of the stiffness. `is_closed`: it is taken as closed, whatever its gap.
Vec3 DirectRod::force_at(const ContactRow& r, const Vec3& moved, bool is_closed,
                         Sym<double>* stiffness) const {
    Vec3 by = moved;
    if (r.other >= 0) by -= r.other_moved + other_give(r) * r.given;
    const double gap = r.gap_0 + dot(r.normal, by);
    if (stiffness != nullptr) *stiffness = {};
    if (gap >= 0.0 && !is_closed) return {};
    const double normal = -gap / r.give;
    Vec3 f = normal * r.normal;
    if (stiffness != nullptr) add_outer(*stiffness, 1.0 / r.give, r.normal);
    const double most =
        is_closed ? r.most_friction : std::min(r.most_friction, r.friction * std::max(0.0, normal));
    if (!(most > 0.0)) return f;
    Vec3 slid = r.slip_0 + by;
    slid -= dot(slid, r.normal) * r.normal;
    const double size = norm(slid), sticks = most * r.give_across;
    if (size <= sticks) {
        if (stiffness != nullptr) {
            const double k = 1.0 / r.give_across;
            add_outer(*stiffness, -k, r.normal);
            stiffness->xx += k, stiffness->yy += k, stiffness->zz += k;
        }
        return f - (1.0 / r.give_across) * slid;
    }
    // As the surfaces slide another way friction turns with them.
    if (stiffness != nullptr) add_outer(*stiffness, most / size, (1.0 / size) * cross(r.normal, slid));
    return f - (most / size) * slid;
}

// At the displacements that were taken.
Vec3 DirectRod::film_force(const ContactRow& r) const {
    const Vec3 moved = row(taken_moved_, r.node) + cross(row(taken_turn_, r.segment), r.arm);
    return (-r.film * (r.across_0 + dot(r.across, moved))) * r.across;
}

void DirectRod::linearise(ContactRow& r, bool is_closed) const {
    const Vec3 f = force_at(r, r.moved, is_closed, &r.stiffness);
    r.force = f + times(r.stiffness, r.moved);
    if (r.other >= 0) return;
    r.film = now_.delay * film_per_step * (is_closed ? r.was_normal : std::max(0.0, dot(f, r.normal)));
}

// What each contact does at the solution. True if its law there is another than the one that was solved with.
bool DirectRod::judge_contacts() {
    bool differs = false;
    for (std::size_t k = 0; k < row_count_; ++k) {
        ContactRow& r = rows_[k];
        const double small_force = small_way * inertia_[at(r.node)];
        r.next = displacement(r.segment, r.along, r.across, r.lever);
        r.f = r.force - times(r.stiffness, r.next);
        if (r.other >= 0) {
            if (norm(r.f - r.given) > small_share * norm(r.f) + small_force) differs = true;
            r.other_moved = displacement(r.other, r.other_along, r.across, r.other_lever);
            r.given = r.f;
        }
        const Vec3 right = force_at(r, r.next, false, nullptr);
        const double f_n = dot(r.f, r.normal), right_n = dot(right, r.normal);
        const Vec3 off = right - r.f - (right_n - f_n) * r.normal;
        if (f_n == 0.0 ? right_n > small_overlap / r.give : f_n < -small_force) differs = true;
        const double bound = std::min(r.most_friction, r.friction * std::max(0.0, right_n));
        if (norm(off) > small_share * bound + small_force) differs = true;
    }
    return differs;
}

// How far to go from the former pass's displacements to this one's: to where the contacts' energy and the
// rod's are least. Their slope along the way is piecewise linear and, but for friction that falls with the
// normal force, rising.
double DirectRod::contact_share(double curvature) const {
    const auto slope = [&](double t) {
        double sum = -(1.0 - t) * curvature;
        for (std::size_t k = 0; k < row_count_; ++k) {
            const ContactRow& r = rows_[k];
            const Vec3 way = r.next - r.moved;
            sum += dot(way, r.f - force_at(r, r.moved + t * way, false, nullptr));
        }
        return sum;
    };
    double low = 0.0, high = 1.0;
    if (!(curvature > 0.0) || slope(1.0) <= 1e-12) return 1.0;
    for (int i = 0; i < 12; ++i) {
        const double middle = 0.5 * (low + high);
        (slope(middle) > 0.0 ? high : low) = middle;
    }
    // Some way must be made, even where the bound of friction spoils the picture.
    return std::max(low, 0.05);
}

// Twice the energy, of the rod without contacts, of the way from `taken` to the solution.
double DirectRod::way_energy() const {
    double sum = 0.0;
    const auto way = [&](const Array* to, const Array* from, int i) { return row(to, i) - row(from, i); };
    const auto times_sym = [&](const Array* s, int i, const Vec3& a) {
        const std::size_t e = at(i);
        return Vec3{s[0][e] * a.x + s[1][e] * a.y + s[2][e] * a.z,
                    s[1][e] * a.x + s[3][e] * a.y + s[4][e] * a.z,
                    s[2][e] * a.x + s[4][e] * a.y + s[5][e] * a.z};
    };
    for (int i = 0; i < n_; ++i) {
        const Vec3 p = way(moved_, taken_moved_, i);
        const bool is_base = i == 0 && now_.base.mode == RodEndMode::coupled;
        sum += (is_base ? 1.0 / solver_.w[0] : inertia_[at(i)]) * dot(p, p);
    }
    Vec3 last{};
    for (int j = 0; j < m_; ++j) {
        const Vec3 a = way(solver_.a, taken_turn_, j);
        sum += dot(a, times_sym(h_, j, a));
        if (j > 0) sum -= 2.0 * dot(last, times_sym(solver_.k, j, a) - cross(row(solver_.c, j), a));
        last = a;
    }
    return sum;
}

// Beyond what the forces of the last solve have the surfaces give way, where the passes have come to.
double DirectRod::worst_overlap() const {
    double worst = 0.0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const ContactRow& r = rows_[k];
        if (r.other >= 0) continue;
        const double gap = r.gap_0 + dot(r.normal, r.moved), borne = std::max(0.0, dot(r.f, r.normal));
        worst = std::max(worst, -gap - r.give * borne);
    }
    return worst;
}

void DirectRod::take(double share) {
    const auto blend = [&](Array* to, const Array* from) {
        for (int k = 0; k < 3; ++k)
            for (std::size_t i = 0; i < to[k].size(); ++i)
                to[k][i] += share * (from[k][i] - to[k][i]);
    };
    if (share == 1.0) {
        for (int k = 0; k < 3; ++k) {
            std::copy(moved_[k].begin(), moved_[k].end(), taken_moved_[k].begin());
            std::copy(solver_.a[k].begin(), solver_.a[k].end(), taken_turn_[k].begin());
            std::copy(solver_.n[k].begin(), solver_.n[k].end(), force_[k].begin());
        }
    } else {
        blend(taken_moved_, moved_), blend(taken_turn_, solver_.a), blend(force_, solver_.n);
    }
    for (std::size_t k = 0; k < row_count_; ++k) {
        ContactRow& r = rows_[k];
        r.moved = share == 1.0 ? r.next : r.moved + share * (r.next - r.moved);
    }
}

// Passes until the contacts' laws are those that were solved with. False: not solvable.
bool DirectRod::solve_contacts(bool is_first, int most_passes) {
    begin_passes();
    for (int pass = 0;; ++pass) {
        const auto t0 = timing_ ? Clock::now() : Clock::time_point{};
        gather_contacts();
        complete_system();
        const auto t1 = timing_ ? Clock::now() : Clock::time_point{};
        if (!solver_.solve()) return false;
        ++times_.solves;
        const auto t2 = timing_ ? Clock::now() : Clock::time_point{};
        displace();
        const bool caps = judge_caps(), contacts = judge_contacts(), done = !caps && !contacts;
        const double share = done || (pass == 0 && is_first) ? 1.0 : contact_share(way_energy());
        take(share);
        // One more where the last passed the coupling's cap: it is solved for at the cap.
        const bool is_last = pass + 1 >= most_passes + (is_cap_passed() ? 1 : 0);
        left_overlap_ = done ? 0.0 : worst_overlap();
        if (!done)
            for (std::size_t k = 0; k < row_count_; ++k) {
                ContactRow& r = rows_[k];
                linearise(r, false);
                if (is_last) r.f = force_at(r, r.moved, false, nullptr);
            }
        if (timing_) {
            const double solving = std::chrono::duration<double>(t2 - t1).count();
            times_.solve += solving;
            times_.contacts += std::chrono::duration<double>(Clock::now() - t0).count() - solving;
        }
        if (done || is_last) return true;
    }
}

void DirectRod::finish_contacts() {
    memory_count_ = 0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const ContactRow& r = rows_[k];
        const auto index = static_cast<std::size_t>(r.index);
        const Vec3 film = film_force(r);
        impulse_[index] += now_.dt * (r.f + film);
        const double normal = std::max(0.0, dot(r.f, r.normal));
        const double before = r.friction > 0.0 ? kept * r.most_friction / r.friction : 0.0;
        if (normal == 0.0 && !(before > small_way * inertia_[at(r.node)])) continue;
        // Friction is carried by what the surfaces' own compliance has given way.
        const Vec3 across = r.f - dot(r.f, r.normal) * r.normal;
        memory_[memory_count_++] = {now_.contacts[index].id, normal > 0.0 ? -least_give * across : Vec3{},
                                    r.f, std::max(normal, before)};
    }
    now_.contacts = {};
}

} // namespace calot::rod_direct
