// Contacts: springs with Coulomb friction between one body's surface and something, solved with the chain.
#include "multibody_rod.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_multibody {

namespace {

constexpr double stiffness = 2e5; // N/m: 5 N press in by 25 um
// Between two of the chain's own bodies; see assemble_contacts.
constexpr double self_stiffness = 2e4;
// See rod-cosserat's: normals are a step old.
constexpr double film = 0.25; // s/m

Vec3 applied(const double* c, const Vec3& v) {
    return {c[0] * v.x + c[1] * v.y + c[2] * v.z, c[3] * v.x + c[4] * v.y + c[5] * v.z,
            c[6] * v.x + c[7] * v.y + c[8] * v.z};
}

} // namespace

void MultibodyRod::prepare_contacts(const calot_rod_input& in) {
    const auto list = items<calot_contact>(in.contacts);
    contact_count_ = std::min(list.size(), impulse_.size());
    row_count_ = 0;
    for (std::size_t k = 0; k < contact_count_; ++k) {
        const calot_contact& c = list[k];
        impulse_[k] = {};
        Contact r;
        const auto j = static_cast<std::size_t>(c.segment);
        const bool is_self = (c.flags & CALOT_CONTACT_SELF) != 0;
        r.index = k, r.id = c.id, r.body = static_cast<int>(c.segment);
        r.along = c.t * length_[j], r.radius = properties_.radius[j];
        r.normal = normalized(vec3(c.normal)), r.gap = c.gap, r.centre = vec3(c.axis_point);
        r.friction = c.friction * properties_.friction[j];
        r.motion = is_self ? Vec3{} : vec3(c.free_position) - vec3(c.point);
        Vec3 p = end_of(r.body, r.along);
        double far = 5e-4 + norm(r.motion) + 2 * dt_ * norm(point_velocity(r.body, p));
        if (is_self) {
            const auto o = static_cast<std::size_t>(c.other_segment);
            r.other = static_cast<int>(o), r.other_along = c.other_t * length_[o],
            r.other_radius = properties_.radius[o];
            const Vec3 other = end_of(r.other, r.other_along);
            // The point given is on the other side's surface; its axis is a radius behind.
            r.centre = r.centre - (vec3(c.point) - r.other_radius * r.normal);
            far += 2 * dt_ * norm(point_velocity(r.other, other));
            p -= other;
        }
        const double gap = c.gap + dot(r.normal, p - r.centre);
        if (gap > far) continue;
        const Vec3 flat = third_axis(frame(r.body)) - dot(third_axis(frame(r.body)), r.normal) * r.normal;
        r.side = norm(flat) > 1e-6 ? cross(r.normal, normalized(flat)) : Vec3{};
        // The contract's compliance is per impulse; a force held over the step is an impulse of dt times it.
        const double own = 1 / (is_self ? self_stiffness : stiffness);
        r.k_n = 1 / (own + dt_ * std::max(0.0, dot(r.normal, applied(c.compliance, r.normal))));
        const double trace = c.compliance[0] + c.compliance[4] + c.compliance[8];
        r.k_t = 1 / (own + 0.5 * dt_ * std::max(0.0, trace - dot(r.normal, applied(c.compliance, r.normal))));
        Memory m;
        for (std::size_t s = 0; s < memory_count_; ++s)
            if (memory_[(row_count_ + s) % memory_count_].id == r.id) { // contacts mostly keep their order
                m = memory_[(row_count_ + s) % memory_count_];
                break;
            }
        r.stick = m.stick - dot(m.stick, r.normal) * r.normal;
        r.f_n = m.force, r.share = m.share;
        // An overlap that the query has found, and not the spring made, carries no force: it is taken back
        // slowly.
        r.offset = std::min({0.0, m.offset, gap + m.force / r.k_n});
        rows_[row_count_++] = r;
    }
}

// Where each contact is at the substep's end if nothing moved but the other side, and whether it will touch.
void MultibodyRod::begin_contacts(double h, double progress) {
    for (std::size_t k = 0; k < row_count_; ++k) {
        Contact& r = rows_[k];
        const Vec3 p = end_of(r.body, r.along);
        r.point = p - r.radius * r.normal;
        Vec3 between = p, speed = point_velocity(r.body, r.point);
        if (r.other >= 0) {
            const Vec3 o = end_of(r.other, r.other_along);
            r.other_point = o + r.other_radius * r.normal;
            between -= o, speed -= point_velocity(r.other, r.other_point);
        }
        r.offset = std::min(0.0, r.offset + recovery_speed_ * h);
        r.depth = r.offset - r.gap - dot(r.normal, between - r.centre - progress * r.motion);
        // What is but a little off is taken to touch: the first solve tells.
        r.touches = r.depth - h * dot(r.normal, speed) > -5e-5;
        if (!r.touches) r.stick = {};
    }
}

// Along the surface: share k_t (stick + h (v - w)) against it, v the surface's speed at the end, w the other
// side's. The share is 1 while it sticks; while it slips, the one with which the force is Coulomb's, found by
// the passes. Between two of the chain's own bodies a stiffness would couple them across the chain; each body
// bears it twice instead, which is more than both together, hence stable, and damps.
void MultibodyRod::assemble_contacts(double h) {
    for (std::size_t k = 0; k < row_count_; ++k) {
        Contact& r = rows_[k];
        if (!r.touches) continue;
        const Vec3 n = r.normal, along_surface = (h / dt_) * (r.motion - dot(r.motion, n) * n);
        r.resistance = Matrix3::outer(n, h * r.k_n);
        r.given = r.k_n * r.depth * n;
        r.resistance += Matrix3::outer(r.side, film * r.f_n);
        r.given += film * r.f_n * dot(r.side, r.motion) / dt_ * r.side;
        if (r.friction > 0) {
            Matrix3 flat = Matrix3::outer(n, -h * r.share * r.k_t);
            for (const std::size_t c : {0u, 4u, 8u})
                flat.m[c] += h * r.share * r.k_t;
            r.resistance += flat;
            r.given -= r.share * r.k_t * (r.stick - along_surface);
        }
        if (r.other < 0) {
            act(r.body, r.point, r.given, r.resistance, h);
            continue;
        }
        const Vec3 speed = point_velocity(r.body, r.point) - point_velocity(r.other, r.other_point);
        const Vec3 force = r.given - r.resistance * speed;
        Matrix3 twice = r.resistance;
        twice += r.resistance;
        push(r.body, r.point, force, twice, h);
        push(r.other, r.other_point, -force, twice, h);
    }
}

// Whether a contact is in another state than assumed, by the last solve.
bool MultibodyRod::judge_contacts(double h) {
    bool changed = false;
    for (std::size_t k = 0; k < row_count_; ++k) {
        Contact& r = rows_[k];
        Vec3 speed = point_velocity_after(r.body, r.point);
        if (r.other >= 0) speed -= point_velocity_after(r.other, r.other_point);
        const Vec3 n = r.normal;
        const double f_n = r.k_n * (r.depth - h * dot(n, speed));
        const bool touches = f_n > 0;
        if (touches != r.touches) {
            r.touches = touches, changed = true;
            r.f_n = std::max(0.0, f_n);
            continue;
        }
        if (!touches) {
            r.f_n = 0;
            continue;
        }
        const Vec3 slid = h * speed - (h / dt_) * r.motion, flat = slid - dot(slid, n) * n;
        const double trial = r.k_t * norm(r.stick + flat), most = r.friction * f_n;
        const double share = trial > most ? most / trial : 1;
        if (std::abs(share - r.share) > 0.02 * share) r.share = share, changed = true;
        r.f_n = f_n;
    }
    return changed;
}

void MultibodyRod::end_contacts(double h) {
    for (std::size_t k = 0; k < row_count_; ++k) {
        Contact& r = rows_[k];
        if (!r.touches) {
            r.f_n = 0, r.stick = {}, r.share = 1;
            continue;
        }
        Vec3 speed = point_velocity_after(r.body, r.point);
        if (r.other >= 0) speed -= point_velocity_after(r.other, r.other_point);
        const Vec3 f = r.given - r.resistance * speed;
        r.f_n = std::max(0.0, dot(r.normal, f));
        r.impulse += h * f;
        const Vec3 slid = h * speed - (h / dt_) * r.motion, flat = slid - dot(slid, r.normal) * r.normal;
        r.stick = r.share * (r.stick + flat);
        if (r.friction == 0) r.stick = {};
    }
}

void MultibodyRod::remember_contacts() {
    memory_count_ = 0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const Contact& r = rows_[k];
        impulse_[r.index] = r.impulse;
        if (r.f_n > 0 || r.offset < 0) memory_[memory_count_++] = {r.id, r.stick, r.offset, r.f_n, r.share};
    }
    row_count_ = 0;
}

} // namespace calot::rod_multibody
