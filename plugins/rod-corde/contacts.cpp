// Contacts by penalty: a spring and a damper along the normal, and a spring that sticks until Coulomb's limit
// along the surface, in series with the other side's compliance.
#include "corde_rod.hpp"

#include <cmath>

namespace calot::rod_corde {

namespace {

// A contact's spring as a share of 1/(h^2 w), w the inverse mass that it meets, and its damping ratio.
// Together with what stability_share leaves they keep the explicit step stable.
constexpr double spring_share = 0.15;
constexpr double damping_ratio = 0.5;
// Normals are of a pose one step or more ago. A rod pressed with F into a groove of radius R swings across it
// as a pendulum of stiffness F / R; the delay t makes this an undamped growth, F t / R of negative damping. A
// film between the surfaces takes F t / R for t = 1.5 ms and R = 6 mm, across the rod only.
constexpr double film = 0.25; // s/m

Vec3 applied(const double* c, const Vec3& v) {
    return {c[0] * v.x + c[1] * v.y + c[2] * v.z, c[3] * v.x + c[4] * v.y + c[5] * v.z,
            c[6] * v.x + c[7] * v.y + c[8] * v.z};
}

} // namespace

void CordeRod::prepare_contacts(const calot_rod_input& in) {
    const auto list = items<calot_contact>(in.contacts);
    contact_count_ = std::min(list.size(), impulse_.size());
    row_count_ = 0;
    std::fill(touching_.begin(), touching_.end(), 0);
    const auto point = [&](int j, double t) { return (1.0 - t) * position(j) + t * position(j + 1); };
    const auto reach = [&](int j) { return 2.0 * dt_ * std::max(norm(velocity(j)), norm(velocity(j + 1))); };
    for (std::size_t k = 0; k < contact_count_; ++k) {
        const calot_contact& c = list[k];
        impulse_[k] = {};
        const int j = static_cast<int>(c.segment);
        const bool is_self = (c.flags & CALOT_CONTACT_SELF) != 0;
        const int o = is_self ? static_cast<int>(c.other_segment) : -1;
        Contact r;
        r.index = k, r.id = c.id, r.segment = j, r.other = o;
        r.wa = 1.0 - c.t, r.wb = c.t, r.radius = properties_.radius[j];
        r.normal = normalized(vec3(c.normal)), r.gap = c.gap, r.centre = vec3(c.axis_point);
        r.friction = c.friction * properties_.friction[j];
        r.motion = is_self ? Vec3{} : vec3(c.free_position) - vec3(c.point);
        Vec3 p = point(j, c.t);
        double far = 5e-4 + norm(r.motion) + reach(j);
        if (is_self) {
            r.other_wa = 1.0 - c.other_t, r.other_wb = c.other_t, r.other_radius = properties_.radius[o];
            // The point given is on the other side's surface; its axis is a radius behind.
            p -= point(o, c.other_t);
            r.centre = r.centre - (vec3(c.point) - r.other_radius * r.normal);
            far += reach(o);
        }
        const double gap = c.gap + dot(r.normal, p - r.centre);
        if (gap > far) continue;
        const Vec3 t = third_axis(frame(j)), flat = t - dot(t, r.normal) * r.normal;
        if (norm(flat) > 1e-6)
            r.e1 = normalized(flat);
        else
            r.e1 = normalized(cross(r.normal, std::abs(r.normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
        r.e2 = cross(r.normal, r.e1);
        ++touching_[j], ++touching_[j + 1];
        if (is_self) ++touching_[o], ++touching_[o + 1];
        const std::size_t at = row_count_++;
        rows_[at] = r;
    }
    const double h = dt_ / substeps_;
    for (std::size_t k = 0; k < row_count_; ++k) {
        Contact& r = rows_[k];
        const calot_contact& c = list[r.index];
        const int j = r.segment, o = r.other;
        // The surface's inverse mass: the points', and for its tangential motion the frame's about its
        // centre.
        double n = 0, t = 0;
        int shared = 1;
        const auto side = [&](int s, double a, double b, double radius) {
            const double points = a * a * w_[s] + b * b * w_[s + 1];
            n += points, t += points + radius * radius / std::min(across_[s], along_[s]);
            shared = std::max({shared, touching_[s], touching_[s + 1]});
        };
        side(j, r.wa, r.wb, r.radius);
        if (o >= 0) side(o, r.other_wa, r.other_wb, r.other_radius);
        if (!(n > 0)) n = 1.0 / mass_[j]; // between held nodes: it moves nothing, but carries a force
        const double k_n = spring_share / (h * h * n * shared),
                     k_t = spring_share / (h * h * std::max(n, t) * shared);
        r.damping_n = 2 * damping_ratio * std::sqrt(k_n / (n * shared));
        r.damping_t = 2 * damping_ratio * std::sqrt(k_t / (std::max(n, t) * shared));
        r.film_limit = 0.3 / (h * n * shared);
        // The contract's compliance is per impulse; a force held over the step is an impulse of dt times it.
        const Vec3 cn = dt_ * applied(c.compliance, r.normal), c1 = dt_ * applied(c.compliance, r.e1),
                   c2 = dt_ * applied(c.compliance, r.e2);
        r.c_n = std::max(0.0, dot(r.normal, cn)) + 1 / k_n;
        r.c_1 = std::max(0.0, dot(r.e1, c1)) + 1 / k_t, r.c_2 = std::max(0.0, dot(r.e2, c2)) + 1 / k_t;
        r.c_n1 = dot(r.normal, c1), r.c_n2 = dot(r.normal, c2), r.c_12 = dot(r.e1, c2);
        Vec3 p = r.wa * position(j) + r.wb * position(j + 1);
        if (o >= 0) p -= r.other_wa * position(o) + r.other_wb * position(o + 1);
        const double gap = r.gap + dot(r.normal, p - r.centre);
        Memory m;
        for (std::size_t s = 0; s < memory_count_; ++s)
            if (memory_[(k + s) % memory_count_].id == r.id) { // contacts mostly keep their order
                m = memory_[(k + s) % memory_count_];
                break;
            }
        r.stick_1 = dot(m.stick, r.e1), r.stick_2 = dot(m.stick, r.e2);
        // An overlap that the query has found, and not the spring made, carries no force: it is taken back
        // slowly.
        r.offset = std::min({0.0, m.offset, gap + r.c_n * m.force});
    }
}

// Forces at the step's begin and end act for half a substep each; at its begin nothing has moved since the
// last step.
void CordeRod::contact_forces(double progress) {
    const double whole = dt_ / substeps_, h = progress == 0.0 ? 0.0 : whole;
    const double acts = progress == 0.0 || progress == 1.0 ? 0.5 * whole : whole;
    const double h_relax = settings_.recovery_speed * h, slide = 1.0 / dt_;
    for (std::size_t k = 0; k < row_count_; ++k) {
        Contact& r = rows_[k];
        const int j = r.segment, o = r.other;
        Vec3 p = r.wa * position(j) + r.wb * position(j + 1);
        if (o >= 0) p -= r.other_wa * position(o) + r.other_wb * position(o + 1);
        r.offset = std::min(0.0, r.offset + h_relax);
        const double depth = r.offset - r.gap - dot(r.normal, p - r.centre - progress * r.motion);
        if (depth <= 0) {
            r.f_n = r.stick_1 = r.stick_2 = 0;
            continue;
        }
        const Vec3 arm = -r.radius * r.normal, turning = angular_velocity(j);
        Vec3 middle = r.wa * velocity(j) + r.wb * velocity(j + 1) - slide * r.motion;
        if (o >= 0) middle -= r.other_wa * velocity(o) + r.other_wb * velocity(o + 1);
        Vec3 v = middle + cross(turning, arm);
        if (o >= 0) v -= cross(angular_velocity(o), r.other_radius * r.normal);
        const double f_n = std::max(0.0, depth / r.c_n - r.damping_n * dot(r.normal, v));
        r.f_n = depth / r.c_n;
        const double v1 = dot(r.e1, v), v2 = dot(r.e2, v);
        r.stick_1 += h * v1, r.stick_2 += h * v2;
        // (C + 1/k) f = -stick along the surface, what the normal force moves there included.
        const double d1 = -r.stick_1 - r.c_n1 * r.f_n, d2 = -r.stick_2 - r.c_n2 * r.f_n;
        const double det = r.c_1 * r.c_2 - r.c_12 * r.c_12;
        const double s1 = (r.c_2 * d1 - r.c_12 * d2) / det, s2 = (r.c_1 * d2 - r.c_12 * d1) / det;
        double f1 = s1 - r.damping_t * v1, f2 = s2 - r.damping_t * v2;
        const double size = std::sqrt(f1 * f1 + f2 * f2), most = r.friction * f_n;
        if (size > most) {
            // While it slips, the spring follows so closely that it carries the friction there is.
            f1 *= most / size, f2 *= most / size;
            const double spring = std::sqrt(s1 * s1 + s2 * s2), keep = spring > most ? most / spring : 1.0;
            r.stick_1 = -(r.c_1 * keep * s1 + r.c_12 * keep * s2) - r.c_n1 * r.f_n;
            r.stick_2 = -(r.c_2 * keep * s2 + r.c_12 * keep * s1) - r.c_n2 * r.f_n;
        }
        const Vec3 friction = f1 * r.e1 + f2 * r.e2;
        const Vec3 f =
            f_n * r.normal + friction - (std::min(film * f_n, r.film_limit) * dot(r.e2, middle)) * r.e2;
        r.impulse += acts * f;
        const auto push = [&](int i, double weight) {
            fx_[i] += weight * f.x, fy_[i] += weight * f.y, fz_[i] += weight * f.z;
        };
        const auto turn = [&](int s, const Vec3& torque) {
            const Vec3 t = rotate_back(frame(s), torque);
            t1_[s] += t.x, t2_[s] += t.y, t3_[s] += t.z;
        };
        push(j, r.wa), push(j + 1, r.wb);
        turn(j, cross(arm, friction));
        if (o < 0) continue;
        push(o, -r.other_wa), push(o + 1, -r.other_wb);
        turn(o, cross(r.other_radius * r.normal, -friction));
    }
}

void CordeRod::remember_contacts() {
    memory_count_ = 0;
    for (std::size_t k = 0; k < row_count_; ++k) {
        const Contact& r = rows_[k];
        impulse_[r.index] = r.impulse;
        if (r.f_n > 0 || r.offset < 0)
            memory_[memory_count_++] = {r.id, r.stick_1 * r.e1 + r.stick_2 * r.e2, r.offset, r.f_n};
    }
    row_count_ = 0;
}

} // namespace calot::rod_corde
