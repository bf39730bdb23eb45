// Contacts, one after the other, each with its own node masses: non-penetration with the other side's
// compliance, then Coulomb friction with stick. Displacement-level and implicit within the substep (as
// Macklin et al. 2019 do).
#include "cosserat_rod.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_cosserat {

namespace {

Vec3 applied(const std::array<double, 9>& c, Vec3 v) {
    return {c[0] * v.x + c[1] * v.y + c[2] * v.z, c[3] * v.x + c[4] * v.y + c[5] * v.z,
            c[6] * v.x + c[7] * v.y + c[8] * v.z};
}

// Normals are of a pose one tick or more ago. A rod pressed with F into a groove of radius R swings across it
// as a pendulum of stiffness F / R; the delay t makes this an undamped growth, F t / R of negative damping. A
// film between the surfaces takes F t / R for t = 1.5 ms and R = 6 mm, across the rod only: 0.1 m/s sideways
// cost 2.5 % of F.
constexpr double film = 0.25; // s/m

// Deep overlap falls by a factor e in this time.
constexpr double deep_recovery = 1e-3; // s
// What yields is foretold, and found some hundredths of a millimetre elsewhere when it has been computed: a
// tip without any overlap would lose it and hit it at every other tick. So overlap with it falls more slowly.
constexpr double soft_recovery = 10e-3; // s

// A contact whose normal is within 60 degrees of the shaft's direction pushes along the shaft, and what gives
// way is all of it: a node alone is a hundred times lighter, and lengths would take back in the next substep
// nearly all that the node was moved.
constexpr double end_on = 0.5;
// At least this share of its nodes' own mobility is taken for such a contact's: a straight shaft clamped at
// its other end has none.
constexpr double least_mobility = 1.0 / 200.0;

} // namespace

inline Vec3 CosseratRod::contact_point(const ContactRow& r) const {
    Vec3 p = r.wa * position(r.a) + r.wb * position(r.b);
    if (r.other_a >= 0) p -= r.other_wa * position(r.other_a) + r.other_wb * position(r.other_b);
    return p;
}

// Whether a contact may close within the tick: half a millimetre, and twice as far as its nodes go at their
// speed, are left for what speeds them up; and where the shaft snaps, as far as its fastest node goes.
bool CosseratRod::can_touch(const RodContact& c) const {
    const auto point = [&](int j, double t) { return (1.0 - t) * position(j) + t * position(j + 1); };
    const auto reach = [&](int j) {
        const double a = vx_[j] * vx_[j] + vy_[j] * vy_[j] + vz_[j] * vz_[j];
        const double b = vx_[j + 1] * vx_[j + 1] + vy_[j + 1] * vy_[j + 1] + vz_[j + 1] * vz_[j + 1];
        return 2.0 * now_.dt * std::sqrt(std::max(a, b));
    };
    Vec3 p = point(c.segment, c.along);
    double far = 5e-4 + norm(c.motion) + std::max(reach(c.segment), now_.dt * top_speed_);
    if (c.other_segment >= 0) {
        p -= point(c.other_segment, c.other_along);
        far += reach(c.other_segment);
    }
    return c.gap + dot(c.normal, p - c.centre) < far;
}

void CosseratRod::prepare_contacts() {
    contact_count_ = std::min(now_.contacts.size(), impulse_.size());
    row_count_ = 0;
    responses_ = 0;
    double top = 0.0;
    for (int i = 0; i < n_; ++i)
        top = std::max(top, vx_[i] * vx_[i] + vy_[i] * vy_[i] + vz_[i] * vz_[i]);
    top_speed_ = std::sqrt(top);
    for (std::size_t k = 0; k < contact_count_; ++k) {
        const RodContact& c = now_.contacts[k];
        impulse_[k] = {};
        if (!can_touch(c)) continue;
        ContactRow& r = rows_[row_count_++];
        r = {};
        r.index = static_cast<int>(k);
        r.a = c.segment, r.b = c.segment + 1;
        r.wa = 1.0 - c.along, r.wb = c.along;
        r.normal = c.normal;
        r.gap = c.gap, r.friction = c.friction * friction_[c.segment], r.motion = c.motion,
        r.centre = c.centre;
        const Vec3 t{tx_[r.b], ty_[r.b], tz_[r.b]};
        const Vec3 flat = t - dot(t, c.normal) * c.normal;
        const double l = norm(flat);
        if (l > 1e-6)
            r.e1 = (1.0 / l) * flat;
        else {
            const Vec3 any = std::fabs(c.normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
            const Vec3 side = cross(c.normal, any);
            r.e1 = (1.0 / norm(side)) * side;
        }
        r.e2 = cross(r.normal, r.e1);
        r.lever = -radius_[c.segment] * dot(r.e2, cross(t, r.normal));
        double inverse = r.wa * r.wa * w_[r.a] + r.wb * r.wb * w_[r.b];
        double spin = r.lever * r.lever / polar_[c.segment];
        if (c.other_segment >= 0) {
            const int o = c.other_segment;
            r.other_a = o, r.other_b = o + 1;
            r.other_wa = 1.0 - c.other_along, r.other_wb = c.other_along;
            const Vec3 to{tx_[o + 1], ty_[o + 1], tz_[o + 1]};
            r.other_lever = -radius_[o] * dot(r.e2, cross(to, r.normal));
            inverse += r.other_wa * r.other_wa * w_[o] + r.other_wb * r.other_wb * w_[o + 1];
            spin += r.other_lever * r.other_lever / polar_[o];
        }
        r.inverse_mass = r.inverse_mass_n = inverse;
        r.inverse_mass_2 = inverse + spin;
        if (c.other_segment < 0 && std::fabs(dot(t, c.normal)) > end_on && responses_ < most_responses)
            prepare_response(r);
        const Vec3 cn = applied(c.compliance, r.normal), c1 = applied(c.compliance, r.e1),
                   c2 = applied(c.compliance, r.e2);
        r.c_n = std::max(0.0, dot(r.normal, cn)), r.c_1 = std::max(0.0, dot(r.e1, c1)),
        r.c_2 = std::max(0.0, dot(r.e2, c2));
        r.c_n1 = dot(r.normal, c1), r.c_n2 = dot(r.normal, c2), r.c_12 = dot(r.e1, c2);
        for (std::size_t s = 0; s < memory_count_; ++s) {
            // Contacts mostly keep their order from tick to tick.
            const ContactMemory& m = memory_[(k + s) % memory_count_];
            if (m.id != c.id) continue;
            r.stick_1 = dot(m.stick, r.e1), r.stick_2 = dot(m.stick, r.e2);
            break;
        }
    }
}

// How all nodes move under a unit force along the contact's normal, lengths kept.
void CosseratRod::prepare_response(ContactRow& r) {
    Response& u = response_[static_cast<std::size_t>(responses_)];
    for (Array* a : {&u.x, &u.y, &u.z})
        std::fill(a->begin(), a->end(), 0.0);
    const auto put = [&](int i, double weight) {
        const double s = weight * w_[i];
        u.x[i] = s * r.normal.x, u.y[i] = s * r.normal.y, u.z[i] = s * r.normal.z;
    };
    put(r.a, r.wa), put(r.b, r.wb);
    if (!keep_lengths(u.x, u.y, u.z)) return;
    u.base_tension = lambda_[1], u.tip_tension = lambda_[n_ - 1];
    const auto along = [&](int i) { return u.x[i] * r.normal.x + u.y[i] * r.normal.y + u.z[i] * r.normal.z; };
    const double mobility = r.wa * along(r.a) + r.wb * along(r.b);
    r.inverse_mass_n = std::max(mobility, least_mobility * r.inverse_mass);
    r.response = responses_++;
}

// Moves positions by `way` and velocities by `rate` times what a unit force along the normal gives.
void CosseratRod::move_along_normal(const ContactRow& r, double way, double rate) {
    if (r.response >= 0) {
        const Response& u = response_[static_cast<std::size_t>(r.response)];
        double *x = x_.data(), *y = y_.data(), *z = z_.data(), *vx = vx_.data(), *vy = vy_.data(),
               *vz = vz_.data();
        const double *ux = u.x.data(), *uy = u.y.data(), *uz = u.z.data();
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i) {
            x[i] += way * ux[i], y[i] += way * uy[i], z[i] += way * uz[i];
            vx[i] += rate * ux[i], vy[i] += rate * uy[i], vz[i] += rate * uz[i];
        }
        return;
    }
    const auto move = [&](int i, double weight) {
        const double a = way * weight * w_[i], b = rate * weight * w_[i];
        x_[i] += a * r.normal.x, y_[i] += a * r.normal.y, z_[i] += a * r.normal.z;
        vx_[i] += b * r.normal.x, vy_[i] += b * r.normal.y, vz_[i] += b * r.normal.z;
    };
    move(r.a, r.wa), move(r.b, r.wb);
    if (r.other_a >= 0) move(r.other_a, -r.other_wa), move(r.other_b, -r.other_wb);
}

// The other side goes linearly through the tick: as it would without contact, and by what the impulses so far
// will have moved it at the tick's end. So a steady force finds a steady surface in every substep.
//
// Overlap that is there already is taken back slowly, or where it is deep a share of it each tick, and by
// positions alone: that gives nothing any speed. What the substep then asks for is that the overlap does not
// grow.
void CosseratRod::begin_contacts(double h, double progress) {
    for (std::size_t k = 0; k < row_count_; ++k) {
        ContactRow& r = rows_[k];
        const double before = progress - 1.0 / substeps_;
        const double gap = r.gap + dot(r.normal, contact_point(r) - r.centre - before * r.motion) + r.given;
        r.bound = std::min(0.0, gap);
        if (gap < 0.0 && r.inverse_mass > 0.0) {
            const double speed =
                r.c_n < 0.0 ? -gap / soft_recovery : std::max(recovery_speed_, -gap / deep_recovery);
            const double back = std::min(speed * h, -gap);
            move_along_normal(r, back / r.inverse_mass_n, 0.0);
            r.bound += back;
        }
        r.start = contact_point(r);
        r.f_n = r.f_1 = r.f_2 = r.f_film = 0.0;
        r.slips = false;
    }
}

void CosseratRod::solve_contacts(double h, double progress) {
    const double h2 = h * h, share = h / now_.dt;
    for (std::size_t k = 0; k < row_count_; ++k) {
        ContactRow& r = rows_[k];
        const auto push = [&](Vec3 f) {
            const auto move = [&](int i, double weight) {
                const double s = h * weight * w_[i];
                vx_[i] += s * f.x, vy_[i] += s * f.y, vz_[i] += s * f.z;
                x_[i] += h * s * f.x, y_[i] += h * s * f.y, z_[i] += h * s * f.z;
            };
            move(r.a, r.wa), move(r.b, r.wb);
            if (r.other_a >= 0) move(r.other_a, -r.other_wa), move(r.other_b, -r.other_wb);
        };
        const Vec3 p = contact_point(r);
        const double gap = r.gap + dot(r.normal, p - r.centre - progress * r.motion) - r.bound + r.given +
                           share * (r.c_n * r.f_n + r.c_n1 * r.f_1 + r.c_n2 * (r.f_2 + r.f_film));
        const double stiff = h2 * r.inverse_mass_n + share * r.c_n;
        if (!(stiff > 0.0)) continue;
        const double f_n = std::max(0.0, r.f_n - gap / stiff);
        if (f_n == 0.0 && r.f_n == 0.0) continue;
        move_along_normal(r, h2 * (f_n - r.f_n), h * (f_n - r.f_n));
        r.f_n = f_n;

        const Vec3 slid = contact_point(r) - r.start - (1.0 / substeps_) * r.motion;
        const double roll =
            h * r.lever * spin_[r.a] + (r.other_a >= 0 ? h * r.other_lever * spin_[r.other_a] : 0.0);
        const double s1 = r.stick_1 + dot(r.e1, slid) +
                          share * (r.c_1 * r.f_1 + r.c_n1 * r.f_n + r.c_12 * (r.f_2 + r.f_film));
        const double s2 = r.stick_2 + dot(r.e2, slid) + roll +
                          share * (r.c_2 * (r.f_2 + r.f_film) + r.c_n2 * r.f_n + r.c_12 * r.f_1);
        double f_1 = r.f_1 - s1 / (h2 * r.inverse_mass + share * r.c_1);
        double f_2 = r.f_2 - s2 / (h2 * r.inverse_mass_2 + share * r.c_2);
        const double size = std::sqrt(f_1 * f_1 + f_2 * f_2), most = r.friction * r.f_n;
        r.slips = size > most;
        if (r.slips) f_1 *= most / size, f_2 *= most / size;
        push((f_1 - r.f_1) * r.e1 + (f_2 - r.f_2) * r.e2);
        const double turn = h * (f_2 - r.f_2);
        spin_[r.a] += turn * r.lever / polar_[r.a];
        if (r.other_a >= 0) spin_[r.other_a] += turn * r.other_lever / polar_[r.other_a];
        r.f_1 = f_1, r.f_2 = f_2;

        // Film: F = f_n film (e2 . v), implicit in v.
        const auto across = [&](int i) { return r.e2.x * vx_[i] + r.e2.y * vy_[i] + r.e2.z * vz_[i]; };
        double rate = r.wa * across(r.a) + r.wb * across(r.b);
        if (r.other_a >= 0) rate -= r.other_wa * across(r.other_a) + r.other_wb * across(r.other_b);
        rate -= dot(r.e2, r.motion) / now_.dt;
        // What earlier rounds gave is taken back in the same go: the film is as strong in any number of them.
        const double c = film * r.f_n, hw = h * r.inverse_mass;
        const double f_film = c * (hw * r.f_film - rate) / (1.0 + c * hw);
        push((f_film - r.f_film) * r.e2);
        r.f_film = f_film;
    }
}

// How far the overlap of a contact grows in this substep, m. One round leaves some where the shaft is wedged
// between walls that face each other.
double CosseratRod::worst_growth(double h, double progress) const {
    const double share = h / now_.dt;
    double worst = 0.0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const ContactRow& r = rows_[k];
        const double gap = r.gap + dot(r.normal, contact_point(r) - r.centre - progress * r.motion) -
                           r.bound + r.given +
                           share * (r.c_n * r.f_n + r.c_n1 * r.f_1 + r.c_n2 * (r.f_2 + r.f_film));
        worst = std::max(worst, -gap);
    }
    return worst;
}

// Books the impulse, and moves the point of stick: it stays while the contact sticks; while it slips it goes
// along; without contact there is none.
void CosseratRod::end_contacts(double h) {
    const double share = h / now_.dt;
    for (std::size_t k = 0; k < row_count_; ++k) {
        ContactRow& r = rows_[k];
        if (r.f_n <= 0.0) {
            r.stick_1 = r.stick_2 = 0.0;
            continue;
        }
        const double f_2 = r.f_2 + r.f_film;
        const Vec3 f = r.f_n * r.normal + r.f_1 * r.e1 + f_2 * r.e2;
        r.impulse += h * f;
        r.given += share * (r.c_n * r.f_n + r.c_n1 * r.f_1 + r.c_n2 * f_2);
        if (now_.base.mode == RodEndMode::clamped && r.a == 0) base_force_ += -r.wa * f;
        if (now_.tip.mode == RodEndMode::clamped && r.b == n_ - 1) tip_force_ += -r.wb * f;
        if (r.response >= 0) {
            const Response& u = response_[static_cast<std::size_t>(r.response)];
            const auto direction = [&](int s) { return Vec3{tx_[s], ty_[s], tz_[s]}; };
            if (now_.base.mode == RodEndMode::clamped)
                base_force_ += -(r.f_n * u.base_tension) * direction(1);
            if (now_.tip.mode == RodEndMode::clamped)
                tip_force_ += (r.f_n * u.tip_tension) * direction(n_ - 1);
        }
        if (r.slips) {
            r.stick_1 = r.stick_2 = 0.0;
            continue;
        }
        const Vec3 slid = contact_point(r) - r.start - (1.0 / substeps_) * r.motion;
        r.stick_1 += dot(r.e1, slid) + share * (r.c_1 * r.f_1 + r.c_n1 * r.f_n + r.c_12 * f_2);
        r.stick_2 += dot(r.e2, slid) + h * r.lever * spin_[r.a] +
                     (r.other_a >= 0 ? h * r.other_lever * spin_[r.other_a] : 0.0) +
                     share * (r.c_2 * f_2 + r.c_n2 * r.f_n + r.c_12 * r.f_1);
    }
}

// What the last substep's forces give the published velocities in this time. Of an end-on contact the nodes'
// own share suffices: lengths spread it.
void CosseratRod::add_contact_kick(double time) {
    for (std::size_t k = 0; k < row_count_; ++k) {
        const ContactRow& r = rows_[k];
        if (r.f_n <= 0.0) continue;
        const Vec3 p = time * (r.f_n * r.normal + r.f_1 * r.e1 + (r.f_2 + r.f_film) * r.e2);
        const auto kick = [&](int i, double weight) {
            const double s = weight * w_[i];
            out_vx_[i] += s * p.x, out_vy_[i] += s * p.y, out_vz_[i] += s * p.z;
        };
        kick(r.a, r.wa), kick(r.b, r.wb);
        if (r.other_a >= 0) kick(r.other_a, -r.other_wa), kick(r.other_b, -r.other_wb);
    }
}

void CosseratRod::remember_contacts() {
    std::size_t count = 0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const ContactRow& r = rows_[k];
        const auto index = static_cast<std::size_t>(r.index);
        impulse_[index] = r.impulse;
        if (r.f_n > 0.0) memory_[count++] = {now_.contacts[index].id, r.stick_1 * r.e1 + r.stick_2 * r.e2};
    }
    memory_count_ = count;
    now_.contacts = {};
}

} // namespace calot::rod_cosserat
