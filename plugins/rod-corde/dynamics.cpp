// One step: elastic moments and forces, penalties, leapfrog, the sleeve. Loops are written to be vectorised.
#include "corde_rod.hpp"

#include <cmath>

namespace calot::rod_corde {

namespace {

// An endoscope bent to 25 mm at its mouth pushes itself out with about as much.
constexpr double sleeve_limit = 30.0; // N
// Nothing on an endoscope moves this fast; it bounds what a bad input can do within a substep.
constexpr double speed_limit = 20.0; // m/s

} // namespace

// Spillmann & Teschner (2007), eq. 5 to 9: u_k = (2/l) B_k q . q' between neighbouring frames, which is the
// vector part of p = conjugate(q_a) q_b times 2/l; energy l/2 sum K_k (u_k - u_k0)^2. Turning q_b by a small
// angle a (material frame of q_a) changes it by (p_0 a + a x v)/2, so the moment on q_a is p_0 m + v x m, m =
// K (u - u_0), and its negative on q_b.
Vec3 CordeRod::joint_moment(int i, const Quat& a, const Quat& b) const {
    const Quat p = short_turn(a, b);
    const Vec3 m{k1_[i] * (per_cell_[i] * p.x - rest1_[i]), k2_[i] * (per_cell_[i] * p.y - rest2_[i]),
                 k3_[i] * (2.0 / cell_[i] * p.z - rest3_[i])};
    return rotate(a, p.w * m + cross({p.x, p.y, p.z}, m));
}

// Joint i turns segment i-1 with +G_i and segment i with -G_i. CoRdE's gamma_r, friction of neighbouring
// frames' relative turning, is part of it; not at the ends, which may be held at one step and free at the
// next.
void CordeRod::joint_moments() {
    const double *qw = qw_.data(), *qx = qx_.data(), *qy = qy_.data(), *qz = qz_.data();
    const double *k1 = k1_.data(), *k2 = k2_.data(), *k3 = k3_.data(), *r1 = rest1_.data(),
                 *r2 = rest2_.data(), *r3 = rest3_.data(), *pc = per_cell_.data(), *cell = cell_.data();
    const double *o1 = o1_.data(), *o2 = o2_.data(), *o3 = o3_.data(), *cb = bend_friction_.data(),
                 *ct = twist_friction_.data();
    double *gx = gx_.data(), *gy = gy_.data(), *gz = gz_.data();
#pragma GCC ivdep
    for (int i = 1; i < n_ - 1; ++i) {
        const double aw = qw[i - 1], ax = qx[i - 1], ay = qy[i - 1], az = qz[i - 1];
        const double bw = qw[i], bx = qx[i], by = qy[i], bz = qz[i];
        const double p0 = aw * bw + ax * bx + ay * by + az * bz;
        const double sign = std::copysign(1.0, p0), c0 = p0 * sign;
        const double v1 = sign * (aw * bx - ax * bw - ay * bz + az * by);
        const double v2 = sign * (aw * by + ax * bz - ay * bw - az * bx);
        const double v3 = sign * (aw * bz - ax * by + ay * bx - az * bw);
        const double m1 = k1[i] * (pc[i] * v1 - r1[i]), m2 = k2[i] * (pc[i] * v2 - r2[i]),
                     m3 = k3[i] * (2.0 / cell[i] * v3 - r3[i]);
        // The other frame's angular velocity as this one sees it.
        const double s1 = 2.0 * (v2 * o3[i] - v3 * o2[i]), s2 = 2.0 * (v3 * o1[i] - v1 * o3[i]),
                     s3 = 2.0 * (v1 * o2[i] - v2 * o1[i]);
        const double d1 = o1[i] + c0 * s1 + v2 * s3 - v3 * s2 - o1[i - 1];
        const double d2 = o2[i] + c0 * s2 + v3 * s1 - v1 * s3 - o2[i - 1];
        const double d3 = o3[i] + c0 * s3 + v1 * s2 - v2 * s1 - o3[i - 1];
        const double g1 = c0 * m1 + v2 * m3 - v3 * m2 + cb[i] * d1;
        const double g2 = c0 * m2 + v3 * m1 - v1 * m3 + cb[i] * d2;
        const double g3 = c0 * m3 + v1 * m2 - v2 * m1 + ct[i] * d3;
        const double w1 = 2.0 * (ay * g3 - az * g2), w2 = 2.0 * (az * g1 - ax * g3),
                     w3 = 2.0 * (ax * g2 - ay * g1);
        gx[i] = g1 + aw * w1 + ay * w3 - az * w2;
        gy[i] = g2 + aw * w2 + az * w1 - ax * w3;
        gz[i] = g3 + aw * w3 + ax * w2 - ay * w1;
    }
    const int last = n_ - 1;
    const auto put = [&](int i, Vec3 g) { gx[i] = g.x, gy[i] = g.y, gz[i] = g.z; };
    put(0, base_.mode == CALOT_END_CLAMPED  ? joint_moment(0, base_clamp_, frame(0))
           : base_.mode == CALOT_END_LOADED ? -vec3(base_.wrench.torque)
                                            : Vec3{});
    put(last, tip_.mode == CALOT_END_CLAMPED  ? joint_moment(last, frame(last - 1), tip_clamp_)
              : tip_.mode == CALOT_END_LOADED ? vec3(tip_.wrench.torque)
                                              : Vec3{});
}

// Stretch: l/2 K_s (|e|/l - 1)^2. Parallel constraint: l/2 kappa |t - d_3|^2 = l kappa (1 - t . d_3), t =
// e/|e|: it turns the frame by l kappa d_3 x t, and the edge by as much the other way. With CoRdE's gamma_t,
// friction of an edge's length, and one between a frame's turning and its edge's, t x (v_b - v_a)/|e|.
void CordeRod::forces(double progress) {
    joint_moments();
    const int last = n_ - 1;
    {
        const double *x = x_.data(), *y = y_.data(), *z = z_.data(), *l = length_.data(),
                     *ks = stretch_.data(), *kp = penalty_.data(), *gx = gx_.data(), *gy = gy_.data(),
                     *gz = gz_.data();
        const double *qw = qw_.data(), *qx = qx_.data(), *qy = qy_.data(), *qz = qz_.data();
        const double *ux = vx_.data(), *uy = vy_.data(), *uz = vz_.data(), *o1 = o1_.data(), *o2 = o2_.data(),
                     *fs = stretch_friction_.data(), *fp = shear_friction_.data();
        double *px = px_.data() + 1, *py = py_.data() + 1, *pz = pz_.data() + 1;
        double *t1 = t1_.data(), *t2 = t2_.data(), *t3 = t3_.data();
#pragma GCC ivdep
        for (int j = 0; j < last; ++j) {
            const double ex = x[j + 1] - x[j], ey = y[j + 1] - y[j], ez = z[j + 1] - z[j];
            const double length = std::sqrt(ex * ex + ey * ey + ez * ez), inverse = 1.0 / length;
            const double tx = ex * inverse, ty = ey * inverse, tz = ez * inverse;
            const double w = qw[j], a = qx[j], b = qy[j], c = qz[j];
            const double dx = 2.0 * (a * c + w * b), dy = 2.0 * (b * c - w * a),
                         dz = w * w - a * a - b * b + c * c;
            const double k = kp[j] * l[j];
            const double vx = ux[j + 1] - ux[j], vy = uy[j + 1] - uy[j], vz = uz[j + 1] - uz[j];
            const double tension = ks[j] * (length / l[j] - 1.0) + fs[j] * (tx * vx + ty * vy + tz * vz);
            // Frame's angular velocity across d_3, in the world.
            const double p1 = o1[j], p2 = o2[j];
            const double m1 = -2.0 * c * p2, m2 = 2.0 * c * p1, m3 = 2.0 * (a * p2 - b * p1);
            const double wx = p1 + w * m1 + b * m3 - c * m2, wy = p2 + w * m2 + c * m1 - a * m3,
                         wz = w * m3 + a * m2 - b * m1;
            const double rx = inverse * (ty * vz - tz * vy) - wx, ry = inverse * (tz * vx - tx * vz) - wy,
                         rz = inverse * (tx * vy - ty * vx) - wz;
            const double across = rx * dx + ry * dy + rz * dz;
            // What turns the frame; its opposite turns the edge, by the forces turn x t / |e| on its ends.
            const double turn_x = k * (dy * tz - dz * ty) + fp[j] * (rx - across * dx);
            const double turn_y = k * (dz * tx - dx * tz) + fp[j] * (ry - across * dy);
            const double turn_z = k * (dx * ty - dy * tx) + fp[j] * (rz - across * dz);
            px[j] = tension * tx + inverse * (turn_y * tz - turn_z * ty);
            py[j] = tension * ty + inverse * (turn_z * tx - turn_x * tz);
            pz[j] = tension * tz + inverse * (turn_x * ty - turn_y * tx);
            const double ax = gx[j + 1] - gx[j] + turn_x;
            const double ay = gy[j + 1] - gy[j] + turn_y;
            const double az = gz[j + 1] - gz[j] + turn_z;
            const double s1 = 2.0 * (b * az - c * ay), s2 = 2.0 * (c * ax - a * az),
                         s3 = 2.0 * (a * ay - b * ax);
            t1[j] = ax - w * s1 + b * s3 - c * s2;
            t2[j] = ay - w * s2 + c * s1 - a * s3;
            t3[j] = az - w * s3 + a * s2 - b * s1;
        }
    }
    {
        const double *m = mass_.data(), *px = px_.data(), *py = py_.data(), *pz = pz_.data();
        double *fx = fx_.data(), *fy = fy_.data(), *fz = fz_.data();
        const double wx = gravity_.x, wy = gravity_.y, wz = gravity_.z;
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i) {
            fx[i] = px[i + 1] - px[i] + m[i] * wx;
            fy[i] = py[i + 1] - py[i] + m[i] * wy;
            fz[i] = pz[i + 1] - pz[i] + m[i] * wz;
        }
    }
    const auto push = [&](int i, Vec3 f) { fx_[i] += f.x, fy_[i] += f.y, fz_[i] += f.z; };
    if (base_.mode == CALOT_END_LOADED) push(0, vec3(base_.wrench.force));
    if (tip_.mode == CALOT_END_LOADED) push(last, vec3(tip_.wrench.force));
    if (row_count_ > 0) contact_forces(progress);
    if (on_axis_ > 0) sleeve_forces();
}

// What lies in the sleeve is held there: it has no weight. A bent rod pushes itself out of a sleeve with
// EI (u^2 - u_0^2) / 2 (Bigoni et al. 2015), the change of bending energy as the clamp moves along. While the
// mouth's joint is partly the lateral spring of drift() its moment is too rough to be squared; the next
// joint's stands for it.
void CordeRod::sleeve_forces() {
    const auto push = [&](int i, Vec3 f) { fx_[i] += f.x, fy_[i] += f.y, fz_[i] += f.z; };
    for (int i = 0; i < on_axis_; ++i)
        push(i, -mass_[i] * gravity_);
    const int i = mouth_stiffness_ > 0.0 ? on_axis_ : on_axis_ - 1;
    if (i <= 0 || i >= n_ - 1) return;
    const Vec3 bend = rotate_back(frame(i - 1), Vec3{gx_[i], gy_[i], gz_[i]});
    const double u1 = bend.x / k1_[i] + rest1_[i], u2 = bend.y / k2_[i] + rest2_[i];
    const double out =
        0.5 * (k1_[i] * (u1 * u1 - rest1_[i] * rest1_[i]) + k2_[i] * (u2 * u2 - rest2_[i] * rest2_[i]));
    push(on_axis_ - 1, clamp(out, -sleeve_limit, sleeve_limit) * vec3(guide_.direction));
}

// Half a kick at a step's ends, whole ones between: positions and velocities leave a step at the same time.
void CordeRod::kick(double h) {
    {
        const double *w = w_.data(), *fx = fx_.data(), *fy = fy_.data(), *fz = fz_.data();
        double *vx = vx_.data(), *vy = vy_.data(), *vz = vz_.data();
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i) {
            const double a = h * w[i];
            vx[i] += a * fx[i], vy[i] += a * fy[i], vz[i] += a * fz[i];
        }
    }
    const double *t1 = t1_.data(), *t2 = t2_.data(), *t3 = t3_.data(), *ia = across_.data(),
                 *il = along_.data();
    double *o1 = o1_.data(), *o2 = o2_.data(), *o3 = o3_.data();
#pragma GCC ivdep
    for (int j = 0; j < n_ - 1; ++j) {
        const double a = h / ia[j];
        o1[j] += a * t1[j], o2[j] += a * t2[j], o3[j] += h / il[j] * t3[j];
    }
}

// Which nodes lie in the sleeve, and how much of each joint's cell does. A joint bends with the part of its
// cell that is outside: c = clamp(a + l/2, 0, l) at axial coordinate a. So the clamp moves continuously with
// the mouth. While c < l/2 the joint is too stiff for an explicit step: the elastic forces see c = l/2, and
// the rest becomes a lateral spring on the next node, taken implicitly in drift().
void CordeRod::update_guide() {
    on_axis_ = 0;
    mouth_stiffness_ = 0.0;
    if (guide_.present == 0) return;
    const Vec3 d = vec3(guide_.direction), o = vec3(guide_.exit);
    const auto axial = [&](int i) { return dot(position(i) - o, d); };
    while (on_axis_ < n_ && axial(on_axis_) < 0.5 * length_[std::max(on_axis_ - 1, 0)])
        ++on_axis_;
    if (base_.mode == CALOT_END_COUPLED) on_axis_ = std::max(on_axis_, 1);
    for (int i = 0; i < n_; ++i)
        per_cell_[i] = 2.0 / cell_[i];
    for (int i = 0; i < std::min(on_axis_ + 1, n_ - 1); ++i) {
        const double full = cell_[i], l = length_[std::min(i, n_ - 2)];
        const double c = clamp(axial(i) + 0.5 * l, 0.0, full);
        per_cell_[i] = 2.0 / clamp(c, 0.5 * full, full);
        if (i == on_axis_ - 1) {
            const double k = std::max(k1_[i], k2_[i]), stiff = k / std::max(c, 1e-3 * full) - 2.0 * k / full;
            mouth_stiffness_ = std::max(stiff, 0.0) / (length_[i] * length_[i]);
        }
    }
    hold_to_axis();
}

// Nodes in the sleeve slide along its axis; frames whose edge lies in it only turn about it.
void CordeRod::hold_to_axis() {
    const Vec3 d = vec3(guide_.direction), o = vec3(guide_.exit);
    for (int i = 0; i < on_axis_; ++i) {
        const Vec3 p = o + dot(position(i) - o, d) * d, v = dot(velocity(i), d) * d;
        x_[i] = p.x, y_[i] = p.y, z_[i] = p.z;
        vx_[i] = v.x, vy_[i] = v.y, vz_[i] = v.z;
    }
    for (int j = 0; j < on_axis_ - 1; ++j) {
        const Quat q = normalized(between(third_axis(frame(j)), d) * frame(j));
        qw_[j] = q.w, qx_[j] = q.x, qy_[j] = q.y, qz_[j] = q.z;
        o1_[j] = o2_[j] = 0.0;
    }
}

// The virtual coupling at the base: springs along and about the guide, implicit for its own node and frame.
void CordeRod::drive_base(double h, double progress) {
    const Vec3 d = vec3(guide_.direction);
    const auto coupling = [&](const calot_coupling& c, double at, double rate, double inverse_mass) {
        const double target = c.target + c.velocity * dt_ * progress;
        const double wanted = c.stiffness * (target - at - h * rate) + c.damping * (c.velocity - rate);
        return clamp(wanted / (1.0 + h * (c.stiffness * h + c.damping) * inverse_mass), -c.limit, c.limit);
    };
    const double force = coupling(base_.insertion, insertion(), dot(velocity(0), d), w_[0]);
    vx_[0] += h * w_[0] * force * d.x, vy_[0] += h * w_[0] * force * d.y, vz_[0] += h * w_[0] * force * d.z;
    const double torque = coupling(base_.rotation, roll_, o3_[0], 1.0 / along_[0]);
    o3_[0] += h / along_[0] * torque;
    base_force_ += force * d;
    base_torque_ += torque * d;
}

void CordeRod::drift(double h, double progress) {
    if (base_.mode == CALOT_END_COUPLED) drive_base(h, progress);
    if (mouth_stiffness_ > 0.0 && on_axis_ < n_) {
        const int i = on_axis_;
        const Vec3 d = vec3(guide_.direction), r = position(i) - vec3(guide_.exit), v = velocity(i);
        const Vec3 y = r - dot(r, d) * d, along = dot(v, d) * d, side = v - along;
        const double k = h * w_[i] * mouth_stiffness_;
        const Vec3 next = along + (1.0 / (1.0 + h * k)) * (side - k * y);
        vx_[i] = next.x, vy_[i] = next.y, vz_[i] = next.z;
    }
    {
        double *x = x_.data(), *y = y_.data(), *z = z_.data(), *vx = vx_.data(), *vy = vy_.data(),
               *vz = vz_.data();
        const double* slow = slow_.data();
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i) {
            vx[i] *= slow[i], vy[i] *= slow[i], vz[i] *= slow[i];
            x[i] += h * vx[i], y[i] += h * vy[i], z[i] += h * vz[i];
        }
    }
    {
        double *qw = qw_.data(), *qx = qx_.data(), *qy = qy_.data(), *qz = qz_.data();
        double *o1 = o1_.data(), *o2 = o2_.data(), *o3 = o3_.data();
        const double *ia = across_.data(), *il = along_.data(), *slow = slow_spin_.data();
        // A free symmetric top's angular velocity turns in its own frame by (1 - I_3/I_1) o_3 h: half of it
        // before and half after the frame has turned. Both turns by Cayley's formula, which keeps lengths.
#pragma GCC ivdep
        for (int j = 0; j < n_ - 1; ++j) {
            const double u3 = o3[j] * slow[j];
            const double a = 0.25 * h * (1.0 - il[j] / ia[j]) * u3, unit = 1.0 / (1.0 + a * a);
            const double c = (1.0 - a * a) * unit, s = 2.0 * a * unit;
            const double v1 = o1[j] * slow[j], v2 = o2[j] * slow[j];
            const double u1 = c * v1 + s * v2, u2 = c * v2 - s * v1;
            o1[j] = c * u1 + s * u2, o2[j] = c * u2 - s * u1, o3[j] = u3;
            const double r1 = 0.5 * h * u1, r2 = 0.5 * h * u2, r3 = 0.5 * h * u3;
            const double w = qw[j], x = qx[j], y = qy[j], z = qz[j];
            const double nw = w - x * r1 - y * r2 - z * r3, nx = x + w * r1 + y * r3 - z * r2;
            const double ny = y + w * r2 + z * r1 - x * r3, nz = z + w * r3 + x * r2 - y * r1;
            const double n = 1.0 / std::sqrt(nw * nw + nx * nx + ny * ny + nz * nz);
            qw[j] = n * nw, qx[j] = n * nx, qy[j] = n * ny, qz[j] = n * nz;
        }
    }
    roll_ += h * o3_[0];
    const auto hold = [&](int i, const calot_rod_end& end, const Vec3& from, const Quat& turned_from,
                          Quat& clamp) {
        const Vec3 p = from + progress * (vec3(end.pose.position) - from);
        x_[i] = p.x, y_[i] = p.y, z_[i] = p.z;
        clamp = blend(turned_from, quat(end.pose.quaternion), progress);
    };
    if (base_.mode == CALOT_END_CLAMPED) hold(0, base_, base_from_, base_clamp_from_, base_clamp_);
    if (tip_.mode == CALOT_END_CLAMPED) hold(n_ - 1, tip_, tip_from_, tip_clamp_from_, tip_clamp_);
    if (on_axis_ > 0) hold_to_axis();
}

void CordeRod::limit_speed() {
    double top = 0.0;
    for (int i = 0; i < n_; ++i)
        top = std::max(top, vx_[i] * vx_[i] + vy_[i] * vy_[i] + vz_[i] * vz_[i]);
    if (!(top > speed_limit * speed_limit)) return;
    for (int i = 0; i < n_; ++i) {
        const double v = norm(velocity(i));
        if (v <= speed_limit) continue;
        const double keep = speed_limit / v;
        vx_[i] *= keep, vy_[i] *= keep, vz_[i] *= keep;
    }
}

void CordeRod::step(const calot_rod_input& in) {
    base_ = in.base, tip_ = in.tip;
    for (calot_rod_end* e : {&base_, &tip_})
        store(normalized(quat(e->pose.quaternion)), e->pose.quaternion);
    gravity_ = vec3(in.gravity);
    if (in.rest_darboux.size != 0 &&
        !std::equal(in.rest_darboux.data, in.rest_darboux.data + in.rest_darboux.size,
                    rest_darboux_.begin())) {
        std::copy(in.rest_darboux.data, in.rest_darboux.data + in.rest_darboux.size, rest_darboux_.begin());
        update_joints();
    }
    for (int i = 0; i < n_; ++i)
        w_[i] = 1.0 / mass_[i];
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
    base_from_ = position(0), tip_from_ = position(n_ - 1);
    base_clamp_from_ = base_clamp_, tip_clamp_from_ = tip_clamp_;
    const auto take_along = [&](int i, const calot_rod_end& end, const Vec3& from, Vec3& force) {
        if (end.mode != CALOT_END_CLAMPED) return;
        w_[i] = 0.0;
        const Vec3 v = (1.0 / dt_) * (vec3(end.pose.position) - from);
        force += (mass_[i] * substeps_ / dt_) * (v - velocity(i)); // becomes a mean over the substeps below
        vx_[i] = v.x, vy_[i] = v.y, vz_[i] = v.z;
    };
    take_along(0, base_, base_from_, base_force_);
    take_along(n_ - 1, tip_, tip_from_, tip_force_);
    update_guide();
    prepare_contacts(in);

    const double h = dt_ / substeps_;
    const int last = n_ - 1;
    forces(0.0);
    for (int s = 0; s < substeps_; ++s) {
        kick(s == 0 ? 0.5 * h : h);
        limit_speed();
        drift(h, (s + 1.0) / substeps_);
        forces((s + 1.0) / substeps_);
        if (base_.mode == CALOT_END_CLAMPED)
            base_force_ -= Vec3{fx_[0], fy_[0], fz_[0]}, base_torque_ -= Vec3{gx_[0], gy_[0], gz_[0]};
        if (tip_.mode == CALOT_END_CLAMPED)
            tip_force_ -= Vec3{fx_[last], fy_[last], fz_[last]},
                tip_torque_ += Vec3{gx_[last], gy_[last], gz_[last]};
    }
    kick(0.5 * h);
    if (on_axis_ > 0) hold_to_axis();
    remember_contacts();
    const double share = 1.0 / substeps_;
    base_force_ = share * base_force_, base_torque_ = share * base_torque_;
    tip_force_ = share * tip_force_, tip_torque_ = share * tip_torque_;
    if (base_.mode == CALOT_END_LOADED)
        base_force_ = vec3(base_.wrench.force), base_torque_ = vec3(base_.wrench.torque);
    if (tip_.mode == CALOT_END_LOADED)
        tip_force_ = vec3(tip_.wrench.force), tip_torque_ = vec3(tip_.wrench.torque);
}

} // namespace calot::rod_corde
