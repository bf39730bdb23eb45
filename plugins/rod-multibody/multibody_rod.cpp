#include "multibody_rod.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_multibody {

namespace {

// N/m, of what holds a clamped end and the centreline in the sleeve: 50 N move it by half a micrometre.
// Implicit, so that it costs no substeps.
constexpr double holding = 1e8;
constexpr double least_holding = 1e2; // at the sleeve's mouth, half a segment outside
// How often a substep is solved again because contacts open, close, stick, slip, or a coupling meets its
// limit.
constexpr int most_passes = 4;
// Nothing on an endoscope moves this fast.
constexpr double speed_limit = 20.0; // m/s

} // namespace

MultibodyRod::Matrix3 MultibodyRod::Matrix3::outer(const Vec3& a, double s) {
    return {{s * a.x * a.x, s * a.x * a.y, s * a.x * a.z, s * a.y * a.x, s * a.y * a.y, s * a.y * a.z,
             s * a.z * a.x, s * a.z * a.y, s * a.z * a.z}};
}
void MultibodyRod::Matrix3::operator+=(const Matrix3& o) {
    for (std::size_t i = 0; i < 9; ++i)
        m[i] += o.m[i];
}
Vec3 MultibodyRod::Matrix3::operator*(const Vec3& v) const {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
}

MultibodyRod::MultibodyRod(const RodDescription& d, std::span<const double> p)
    : n_(d.nodes), bodies_(d.nodes - 1), substeps_(static_cast<int>(p[0])), dt_(d.dt), recovery_speed_(p[1]),
      length_(d.length), rest_darboux_(d.rest_darboux), properties_(d.properties), guide_(d.guide) {
    const auto n = static_cast<std::size_t>(n_), m = n - 1;
    for (auto* a : {&k1_, &k2_, &k3_, &damping_12_, &damping_3_, &rest1_, &rest2_, &rest3_, &cell_})
        a->assign(n, 0.0);
    wrenches_.assign(6 * m, 0.0), at_joint_.assign(9 * m, 0.0), at_body_.assign(36 * m, 0.0);
    const auto contacts = static_cast<std::size_t>(d.max_contacts);
    rows_.resize(contacts), memory_.resize(contacts), impulse_.resize(contacts);
    build();
    const std::vector<double> still(static_cast<std::size_t>(chain_->motions()), 0.0);
    chain_->place(d.position.data(), aligned_frames(d).data(), still.data());
    base_clamp_ = frame(0), tip_clamp_ = frame(bodies_ - 1);
}

void MultibodyRod::build() {
    std::vector<Chain::Body> bodies;
    for (std::size_t j = 0; j < length_.size(); ++j)
        bodies.push_back({length_[j], properties_.mass_per_length[j] * length_[j], properties_.radius[j]});
    chain_ = std::make_unique<Chain>(bodies_, bodies.data());
    const auto motions = static_cast<std::size_t>(chain_->motions());
    joint_moments_.assign(motions, 0.0), right_.assign(motions, 0.0), change_.assign(motions, 0.0);
    update_joints();
}

void MultibodyRod::set_properties(const RodProperties& p) {
    const bool same_bodies =
        p.mass_per_length == properties_.mass_per_length && p.radius == properties_.radius;
    properties_ = p;
    if (same_bodies) return update_joints();
    // Simbody's bodies have their masses for life.
    std::vector<double> q(static_cast<std::size_t>(chain_->coordinates())),
        u(chain_->motion(), chain_->motion() + chain_->motions());
    chain_->read(q.data());
    build();
    chain_->restore(q.data(), u.data());
}

// Joint i spans half of each neighbouring segment; compliances and rest angles of the halves add. At the ends
// the cell is half a segment: what lies between the end's cross-section and the segment's middle.
void MultibodyRod::update_joints() {
    const auto series = [](double la, double ka, double lb, double kb) {
        return (la + lb) / (la / ka + lb / kb);
    };
    for (int i = 0; i < n_; ++i) {
        const int a = std::max(i - 1, 0), b = std::min(i, n_ - 2);
        const double la = i > 0 ? 0.5 * length_[a] : 0.0, lb = i < n_ - 1 ? 0.5 * length_[b] : 0.0;
        const auto mean = [&](double va, double vb) { return (la * va + lb * vb) / (la + lb); };
        const RodProperties& p = properties_;
        cell_[i] = la + lb;
        k1_[i] = series(la, p.bending_x[a], lb, p.bending_x[b]);
        k2_[i] = series(la, p.bending_y[a], lb, p.bending_y[b]);
        k3_[i] = series(la, p.torsion[a], lb, p.torsion[b]);
        damping_12_[i] = mean(p.bending_damping[a], p.bending_damping[b]);
        damping_3_[i] = mean(p.torsion_damping[a], p.torsion_damping[b]);
        rest1_[i] = mean(rest_darboux_[3 * a], rest_darboux_[3 * b]);
        rest2_[i] = mean(rest_darboux_[3 * a + 1], rest_darboux_[3 * b + 1]);
        rest3_[i] = mean(rest_darboux_[3 * a + 2], rest_darboux_[3 * b + 2]);
    }
}

// Curvature and twist between two frames as u = (2/c) v, v the vector part of conjugate(q_a) q_b; energy
// c/2 sum K (u - u_0)^2. A small turn a of q_b (in q_a's frame) changes v by (p_0 a + a x v)/2, so the moment
// on q_b is
// -(p_0 m + v x m) with m = K (u - u_0). Its derivative is close to K/c in the frame halfway between.
Vec3 MultibodyRod::joint_moment(int i, const Quat& a, const Quat& b, Matrix3* stiffness,
                                Matrix3* damping) const {
    const Quat p = short_turn(a, b);
    const double per = 2.0 / cell_[i];
    const Vec3 v{p.x, p.y, p.z};
    const Vec3 m{k1_[i] * (per * v.x - rest1_[i]), k2_[i] * (per * v.y - rest2_[i]),
                 k3_[i] * (per * v.z - rest3_[i])};
    const Quat half = normalized(Quat{1.0 + p.w, p.x, p.y, p.z});
    *stiffness = *damping = {};
    const double k[3] = {k1_[i] / cell_[i], k2_[i] / cell_[i], k3_[i] / cell_[i]};
    const double tau[3] = {damping_12_[i], damping_12_[i], damping_3_[i]};
    for (int c = 0; c < 3; ++c) {
        const Vec3 axis = rotate(half, Vec3{c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0, c == 2 ? 1.0 : 0.0});
        *stiffness += Matrix3::outer(axis, k[c]), *damping += Matrix3::outer(axis, k[c] * tau[c]);
    }
    return -(p.w * m + cross(v, m));
}

Vec3 MultibodyRod::end_of(int k, double along) const {
    return vec3(chain_->body(k).origin) + along * third_axis(frame(k));
}
Vec3 MultibodyRod::position(int i) const {
    return i < bodies_ ? end_of(i, 0) : end_of(bodies_ - 1, length_.back());
}
Vec3 MultibodyRod::velocity(int i) const {
    return i < bodies_ ? vec3(chain_->body(i).velocity) : point_velocity(bodies_ - 1, position(i));
}
Vec3 MultibodyRod::point_velocity(int k, const Vec3& point) const {
    const BodyMotion& b = chain_->body(k);
    return vec3(b.velocity) + cross(vec3(b.turning), point - vec3(b.origin));
}
// At the substep's end, by the last solve.
Vec3 MultibodyRod::point_velocity_after(int k, const Vec3& point) const {
    const BodyMotion& b = chain_->body(k);
    const double* c = chain_->body_change(k);
    return vec3(b.velocity) + vec3(c + 3) + cross(vec3(b.turning) + vec3(c), point - vec3(b.origin));
}
double MultibodyRod::insertion() const {
    return guide_.present != 0 ? dot(position(0) - vec3(guide_.exit), vec3(guide_.direction)) : 0.0;
}

// A force that falls by `resistance` times the change of the point's velocity in this substep: h J^T R J for
// the body's spatial inertia, J = (-[arm]x, 1).
void MultibodyRod::push(int k, const Vec3& point, const Vec3& force, const Matrix3& resistance, double h) {
    const Vec3 arm = point - vec3(chain_->body(k).origin), torque = cross(arm, force);
    double* w = &wrenches_[6 * static_cast<std::size_t>(k)];
    w[0] += torque.x, w[1] += torque.y, w[2] += torque.z, w[3] += force.x, w[4] += force.y, w[5] += force.z;
    double* s = &at_body_[36 * static_cast<std::size_t>(k)];
    for (int c = 0; c < 6; ++c) {
        const int axis = c % 3;
        const Vec3 unit{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
        const Vec3 f = h * (resistance * (c < 3 ? cross(unit, arm) : unit)), t = cross(arm, f);
        const double column[6] = {t.x, t.y, t.z, f.x, f.y, f.z};
        for (int r = 0; r < 6; ++r)
            s[6 * r + c] += column[r];
    }
}
// A force that is given - resistance times the point's velocity at the substep's end.
void MultibodyRod::act(int k, const Vec3& point, const Vec3& given, const Matrix3& resistance, double h) {
    push(k, point, given - resistance * point_velocity(k, point), resistance, h);
}
void MultibodyRod::turn(int k, const Vec3& given, const Matrix3& resistance, double h) {
    const Vec3 t = given - resistance * vec3(chain_->body(k).turning);
    double* w = &wrenches_[6 * static_cast<std::size_t>(k)];
    w[0] += t.x, w[1] += t.y, w[2] += t.z;
    double* s = &at_body_[36 * static_cast<std::size_t>(k)];
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            s[6 * r + c] += h * resistance.m[static_cast<std::size_t>(3 * r + c)];
}

// Everything that acts, with what it takes away from a change of motion. Weight lies on what is outside the
// sleeve.
void MultibodyRod::assemble(double h, double progress) {
    std::fill(joint_moments_.begin(), joint_moments_.end(), 0.0);
    std::fill(wrenches_.begin(), wrenches_.end(), 0.0);
    std::fill(at_joint_.begin(), at_joint_.end(), 0.0);
    std::fill(at_body_.begin(), at_body_.end(), 0.0);
    for (int k = 0; k < bodies_; ++k) {
        const auto b = static_cast<std::size_t>(k);
        const double l = length_[b], mass = properties_.mass_per_length[b] * l, r = properties_.radius[b];
        const Vec3 t = third_axis(frame(k)), arm = 0.5 * l * t;
        double outside = 1;
        if (guide_.present != 0)
            outside =
                clamp(0.5 + dot(end_of(k, 0.5 * l) - vec3(guide_.exit), vec3(guide_.direction)) / l, 0, 1);
        const Vec3 weight = outside * mass * gravity_, torque = cross(arm, weight);
        double* w = &wrenches_[6 * b];
        w[0] += torque.x, w[1] += torque.y, w[2] += torque.z, w[3] += weight.x, w[4] += weight.y,
            w[5] += weight.z;
        // Drag takes momentum away at one rate.
        const double rate = properties_.drag[b] / properties_.mass_per_length[b];
        if (rate > 0) {
            double p[6];
            chain_->momentum(k, p);
            for (int i = 0; i < 6; ++i)
                w[i] -= rate * p[i];
            // The cylinder's spatial inertia about its origin.
            const double across = mass * (r * r / 4 + l * l / 3), along = mass * r * r / 2, s = h * rate;
            double* at = &at_body_[36 * b];
            const Matrix3 turning = Matrix3::outer(t, along - across);
            const double c[3][3] = {{0, -arm.z, arm.y}, {arm.z, 0, -arm.x}, {-arm.y, arm.x, 0}};
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    at[6 * i + j] +=
                        s * (turning.m[static_cast<std::size_t>(3 * i + j)] + (i == j ? across : 0));
                    at[6 * i + 3 + j] += s * mass * c[i][j];
                    at[6 * (3 + i) + j] -= s * mass * c[i][j];
                    at[6 * (3 + i) + 3 + j] += i == j ? s * mass : 0;
                }
        }
        if (k == 0) continue;
        Matrix3 stiffness, damping;
        const std::size_t first = 6 + 3 * (b - 1);
        const double* u = chain_->motion() + first;
        const Vec3 moment = joint_moment(k, frame(k - 1), frame(k), &stiffness, &damping);
        for (std::size_t i = 0; i < 9; ++i) {
            stiffness.m[i] = h * stiffness.m[i] + damping.m[i];
            at_joint_[9 * b + i] = h * stiffness.m[i];
        }
        store(moment - stiffness * vec3(u), &joint_moments_[first]);
    }
    assemble_base(h, progress);
    assemble_tip(h, progress);
    if (guide_.present != 0) assemble_guide(h);
    assemble_contacts(h);
}

void MultibodyRod::assemble_base(double h, double progress) {
    base_held_ = {};
    const Vec3 at = position(0);
    if (base_.mode == CALOT_END_LOADED) {
        base_held_.force = vec3(base_.wrench.force), base_held_.torque = vec3(base_.wrench.torque);
    } else if (base_.mode == CALOT_END_CLAMPED) {
        const Vec3 to = base_from_ + progress * (vec3(base_.pose.position) - base_from_);
        base_clamp_ = blend(base_clamp_from_, quat(base_.pose.quaternion), progress);
        base_held_.force = holding * (to - at);
        base_held_.resistance.m = {h * holding, 0, 0, 0, h * holding, 0, 0, 0, h * holding};
        Matrix3 stiffness, damping;
        base_held_.torque = rotate(base_clamp_, joint_moment(0, base_clamp_, frame(0), &stiffness, &damping));
        for (int c = 0; c < 3; ++c) {
            // From the clamp's axes to the world's.
            const Quat half = normalized(blend(base_clamp_, frame(0), 0.5));
            const Vec3 axis = rotate(half, Vec3{c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0, c == 2 ? 1.0 : 0.0});
            base_held_.turning_resistance += Matrix3::outer(axis, h *
                                                                      (c == 0   ? k1_
                                                                       : c == 1 ? k2_
                                                                                : k3_)[0] /
                                                                      cell_[0]);
        }
    } else if (base_.mode == CALOT_END_COUPLED) {
        const Vec3 d = vec3(guide_.direction);
        const auto coupling = [&](const calot_coupling& c, double value, double limited, Vec3& given,
                                  Matrix3& resistance) {
            if (limited != 0) {
                given = limited * c.limit * d;
                return;
            }
            given =
                (c.stiffness * (c.target + c.velocity * dt_ * progress - value) + c.damping * c.velocity) * d;
            resistance = Matrix3::outer(d, h * c.stiffness + c.damping);
        };
        coupling(base_.insertion, insertion(), axial_limit_, base_held_.force, base_held_.resistance);
        coupling(base_.rotation, roll_, roll_limit_, base_held_.torque, base_held_.turning_resistance);
    }
    act(0, at, base_held_.force, base_held_.resistance, h);
    turn(0, base_held_.torque, base_held_.turning_resistance, h);
}

void MultibodyRod::assemble_tip(double h, double progress) {
    tip_held_ = {};
    const int last = bodies_ - 1, i = n_ - 1;
    const Vec3 at = position(i);
    if (tip_.mode == CALOT_END_LOADED) {
        tip_held_.force = vec3(tip_.wrench.force), tip_held_.torque = vec3(tip_.wrench.torque);
    } else if (tip_.mode == CALOT_END_CLAMPED) {
        const Vec3 to = tip_from_ + progress * (vec3(tip_.pose.position) - tip_from_);
        tip_clamp_ = blend(tip_clamp_from_, quat(tip_.pose.quaternion), progress);
        tip_held_.force = holding * (to - at);
        tip_held_.resistance.m = {h * holding, 0, 0, 0, h * holding, 0, 0, 0, h * holding};
        Matrix3 stiffness, damping;
        // The moment on the clamp, as seen from the body.
        tip_held_.torque =
            -rotate(frame(last), joint_moment(i, frame(last), tip_clamp_, &stiffness, &damping));
        for (int c = 0; c < 3; ++c) {
            const Quat half = normalized(blend(frame(last), tip_clamp_, 0.5));
            const Vec3 axis = rotate(half, Vec3{c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0, c == 2 ? 1.0 : 0.0});
            tip_held_.turning_resistance += Matrix3::outer(axis, h *
                                                                     (c == 0   ? k1_
                                                                      : c == 1 ? k2_
                                                                               : k3_)[i] /
                                                                     cell_[i]);
        }
    }
    act(last, at, tip_held_.force, tip_held_.resistance, h);
    turn(last, tip_held_.torque, tip_held_.turning_resistance, h);
}

// Nodes in the sleeve are drawn to its axis; the spring grows from nothing half a segment outside to its full
// stiffness half a segment inside, by powers, so that its mouth has no step.
void MultibodyRod::assemble_guide(double h) {
    const Vec3 d = vec3(guide_.direction), exit = vec3(guide_.exit);
    for (int i = 0; i < n_; ++i) {
        const int k = std::min(i, bodies_ - 1);
        const Vec3 p = position(i), from = p - exit;
        double inside = clamp(0.5 - dot(from, d) / length_[static_cast<std::size_t>(k)], 0, 1);
        if (i == 0 && base_.mode == CALOT_END_COUPLED) inside = 1;
        if (inside == 0) continue;
        const double k_side = least_holding * (std::pow(holding / least_holding, inside) - 1);
        Matrix3 resistance = Matrix3::outer(d, -h * k_side);
        for (const std::size_t c : {0u, 4u, 8u})
            resistance.m[c] += h * k_side;
        act(k, p, -k_side * (from - dot(from, d) * d), resistance, h);
    }
}

// Whether the coupling has met or left a limit, by the last solve.
bool MultibodyRod::judge_base() {
    if (base_.mode != CALOT_END_COUPLED) return false;
    const Vec3 d = vec3(guide_.direction);
    const auto judge = [&](const calot_coupling& c, double force, double& limit) {
        if (limit != 0 || std::abs(force) <= c.limit) return false;
        limit = force > 0 ? 1 : -1;
        return true;
    };
    const double force =
        dot(base_held_.force - base_held_.resistance * point_velocity_after(0, position(0)), d);
    const Vec3 turning = vec3(chain_->body(0).turning) + vec3(chain_->body_change(0));
    const double torque = dot(base_held_.torque - base_held_.turning_resistance * turning, d);
    const bool axial = judge(base_.insertion, force, axial_limit_);
    return judge(base_.rotation, torque, roll_limit_) || axial;
}

// Linearly implicit Euler: (M + h C + h^2 K) (v_end - v) = h (f - C v - h K v), with the springs' K and
// dampers' C at the substep's begin; solved again when a contact or a coupling turns out to be in another
// state.
void MultibodyRod::substep(double h, double progress) {
    begin_contacts(h, progress);
    axial_limit_ = roll_limit_ = 0;
    for (int pass = 0; pass < most_passes; ++pass) {
        assemble(h, progress);
        chain_->residual(joint_moments_.data(), wrenches_.data(), right_.data());
        for (double& r : right_)
            r *= -h;
        chain_->solve(at_joint_.data(), at_body_.data(), right_.data(), change_.data());
        const bool base = judge_base();
        if (!judge_contacts(h) && !base) break;
    }
    // Simbody throws when it meets a number that is none.
    for (const double c : change_)
        if (!(std::abs(c) < 1e9)) {
            has_overflowed_ = true;
            return;
        }
    const auto book = [&](const Held& held, int body, int node, Vec3& force, Vec3& torque) {
        const Vec3 turning = vec3(chain_->body(body).turning) + vec3(chain_->body_change(body));
        force += held.force - held.resistance * point_velocity_after(body, position(node));
        torque += held.torque - held.turning_resistance * turning;
    };
    book(base_held_, 0, 0, base_force_, base_torque_);
    book(tip_held_, bodies_ - 1, n_ - 1, tip_force_, tip_torque_);
    end_contacts(h);
    roll_ += h * dot(vec3(chain_->body(0).turning) + vec3(chain_->body_change(0)), third_axis(frame(0)));
    chain_->advance(h, change_.data());
}

void MultibodyRod::step(const calot_rod_input& in) {
    base_ = in.base, tip_ = in.tip;
    for (calot_rod_end* e : {&base_, &tip_})
        store(normalized(quat(e->pose.quaternion)), e->pose.quaternion);
    gravity_ = vec3(in.gravity);
    if (in.rest_darboux.size != 0) {
        std::copy(in.rest_darboux.data, in.rest_darboux.data + in.rest_darboux.size, rest_darboux_.begin());
        update_joints();
    }
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
    base_from_ = position(0), tip_from_ = position(n_ - 1);
    base_clamp_from_ = base_clamp_, tip_clamp_from_ = tip_clamp_;
    prepare_contacts(in);
    // Lengths of an implicit substep that were tried: free, and where contacts slip.
    const double longest = row_count_ > 0 ? 2e-4 : 1e-3;
    const int substeps = substeps_ > 0 ? substeps_ : static_cast<int>(std::ceil(dt_ / longest - 1e-9));
    const double h = dt_ / substeps;
    has_overflowed_ = false;
    for (int s = 0; s < substeps && !has_overflowed_; ++s)
        substep(h, (s + 1.0) / substeps);
    limit_speed();
    remember_contacts();
    const double share = 1.0 / substeps;
    base_force_ = share * base_force_, base_torque_ = share * base_torque_;
    tip_force_ = share * tip_force_, tip_torque_ = share * tip_torque_;
}

void MultibodyRod::limit_speed() {
    double top = 0;
    for (int i = 0; i < n_; ++i)
        top = std::max(top, norm(velocity(i)));
    if (!(top > speed_limit)) return;
    for (int i = 0; i < chain_->motions(); ++i)
        change_[static_cast<std::size_t>(i)] = (speed_limit / top - 1) * chain_->motion()[i];
    chain_->advance(0, change_.data());
}

void MultibodyRod::stop() {
    std::vector<double> q(static_cast<std::size_t>(chain_->coordinates())),
        still(static_cast<std::size_t>(chain_->motions()), 0.0);
    chain_->read(q.data());
    chain_->restore(q.data(), still.data());
    memory_count_ = row_count_ = 0;
    has_overflowed_ = false;
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
    std::fill(impulse_.begin(), impulse_.end(), Vec3{});
}

bool MultibodyRod::is_finite() const {
    return !has_overflowed_;
}

RodEnergies MultibodyRod::energies() const {
    RodEnergies e;
    e.kinetic = chain_->kinetic_energy();
    for (int k = 0; k < bodies_; ++k) {
        const double l = length_[static_cast<std::size_t>(k)];
        e.gravity -=
            properties_.mass_per_length[static_cast<std::size_t>(k)] * l * dot(gravity_, end_of(k, 0.5 * l));
    }
    for (int i = 0; i < n_; ++i) {
        Quat p;
        if (i > 0 && i < n_ - 1)
            p = short_turn(frame(i - 1), frame(i));
        else if (i == 0 && base_.mode == CALOT_END_CLAMPED)
            p = short_turn(base_clamp_, frame(0));
        else if (i == n_ - 1 && tip_.mode == CALOT_END_CLAMPED)
            p = short_turn(frame(i - 1), tip_clamp_);
        else
            continue;
        const double per = 2.0 / cell_[i], d1 = per * p.x - rest1_[i], d2 = per * p.y - rest2_[i],
                     d3 = per * p.z - rest3_[i];
        e.bending += 0.5 * cell_[i] * (k1_[i] * d1 * d1 + k2_[i] * d2 * d2);
        e.twist += 0.5 * cell_[i] * k3_[i] * d3 * d3;
    }
    return e;
}

} // namespace calot::rod_multibody
