// One substep: elastic moments and forces, leapfrog, lengths, twist, frames. Loops are written to be
// vectorised.
#include "cosserat_rod.hpp"
#include "lapack.hpp"
#include "two_ended.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_cosserat {

namespace {

// What one solve leaves is about the square of the violation before it, and the next substep takes that away;
// above this violation (gravity and 0.1 ms make 1e-5 at 1 cm) one more solve is made.
constexpr double second_solve_above = 1e-4;
constexpr int most_solves = 4;
// An endoscope bent to 25 mm at its mouth pushes itself out with about as much.
constexpr double sleeve_limit = 30.0; // N

double clamped_force(const RodCoupling& c, double target, double at, double rate, double cap) {
    return std::clamp(c.stiffness * (target - at) + c.damping * (c.velocity - rate), -cap, cap);
}

} // namespace

void CosseratRod::directions() {
    const double *x = x_.data(), *y = y_.data(), *z = z_.data();
    double *tx = tx_.data() + 1, *ty = ty_.data() + 1, *tz = tz_.data() + 1;
    for (int j = 0; j < n_ - 1; ++j) {
        const double ex = x[j + 1] - x[j], ey = y[j + 1] - y[j], ez = z[j + 1] - z[j];
        const double inverse = 1.0 / std::sqrt(ex * ex + ey * ey + ez * ez);
        tx[j] = ex * inverse, ty[j] = ey * inverse, tz[j] = ez * inverse;
    }
}

// Which nodes lie in the sleeve, and how much of each joint's cell does. A joint bends with the part of its
// cell that is outside: c = clamp(a + l/2, 0, l) at axial coordinate a. So the clamp moves continuously with
// the mouth. While c < l/2 the joint is too stiff for an explicit step: the elastic forces see c = l/2, and
// the rest becomes a lateral spring on the next node, taken implicitly in drift().
void CosseratRod::update_guide() {
    on_axis_ = 0;
    mouth_stiffness_ = 0.0;
    std::copy(per_twist_cell_.begin(), per_twist_cell_.end(), per_cell_.begin());
    if (!now_.guide.present) return;
    const Vec3 d = now_.guide.direction, o = now_.guide.origin;
    const auto axial = [&](int i) { return dot(position(i) - o, d); };
    while (on_axis_ < n_ && axial(on_axis_) < 0.5 * length_[std::max(on_axis_ - 1, 0)])
        ++on_axis_;
    for (int i = 0; i < std::min(on_axis_ + 1, n_ - 1); ++i) {
        const double full = 2.0 / per_twist_cell_[i], l = length_[std::min(i, n_ - 2)];
        const double c = std::clamp(axial(i) + 0.5 * l, 0.0, full);
        per_cell_[i] = 2.0 / std::clamp(c, 0.5 * full, full);
        if (i == on_axis_ - 1 && i + 1 < n_) {
            const double k = std::max(k1_[i], k2_[i]), stiff = k / std::max(c, 1e-3 * full) - 2.0 * k / full;
            mouth_stiffness_ = std::max(stiff, 0.0) * inverse_length_[i] * inverse_length_[i];
        }
    }
    // The frame that an on-axis segment has is the axis; laying nodes there is hold_to_axis()'s work.
    hold_to_axis();
    directions();
}

void CosseratRod::hold_to_axis() {
    const Vec3 d = now_.guide.direction, o = now_.guide.origin;
    for (int i = 0; i < on_axis_; ++i) {
        const Vec3 p = o + dot(position(i) - o, d) * d, v = dot({vx_[i], vy_[i], vz_[i]}, d) * d;
        x_[i] = p.x, y_[i] = p.y, z_[i] = p.z;
        vx_[i] = v.x, vy_[i] = v.y, vz_[i] = v.z;
    }
}

// CoRdE (Spillmann & Teschner 2007, eq. 5 to 9): u_k = (2/l) B_k q_a . q_b, the imaginary part of p =
// conjugate(q_a) q_b; energy l/2 sum K_k (u_k - u_k0)^2. Its moment falls again beyond a joint's right angle:
// a shaft pressed together kinks there and stays so. Here u_k is that times g(p_0), turn_factor(), whose
// moment rises to the half turn. Turning q_b by a small angle a (material frame of q_a) changes v = Im p by
// (p_0 a + a x v)/2 and p_0 by -(v . a)/2, so with m = K (u - u_0) the moment on q_a is g (p_0 m + v x m) -
// g' (v . m) v, and its negative on q_b.
void CosseratRod::joint_moments(double h, bool advance) {
    const double *qw = qw_.data(), *qx = qx_.data(), *qy = qy_.data(), *qz = qz_.data();
    const double *k1 = k1_.data(), *k2 = k2_.data(), *k3 = k3_.data(), *r1 = rest1_.data(),
                 *r2 = rest2_.data(), *r3 = rest3_.data(), *pc = per_cell_.data(),
                 *pt = per_twist_cell_.data(), *visc = viscosity_.data();
    double *gx = gx_.data(), *gy = gy_.data(), *gz = gz_.data();
    double *l1 = last_u1_.data(), *l2 = last_u2_.data(), *d1 = rate1_.data(), *d2 = rate2_.data();
    const double cap = viscosity_cap_, fresh = advance ? 1.0 : 0.0, kept = 1.0 - fresh, rate = fresh / h;
#pragma GCC ivdep
    for (int i = 1; i < n_ - 1; ++i) {
        const double aw = qw[i - 1], ax = qx[i - 1], ay = qy[i - 1], az = qz[i - 1];
        const double bw = qw[i], bx = qx[i], by = qy[i], bz = qz[i];
        const double p0 = aw * bw + ax * bx + ay * by + az * bz;
        const double sign = std::copysign(1.0, p0);
        const double c0 = p0 * sign;
        const double v1 = sign * (aw * bx - ax * bw - ay * bz + az * by);
        const double v2 = sign * (aw * by + ax * bz - ay * bw - az * bx);
        const double v3 = sign * (aw * bz - ax * by + ay * bx - az * bw);
        const double g0 = turn_factor(c0), slope = turn_factor_slope(c0, g0);
        double s1 = pc[i] * g0 * v1, s2 = pc[i] * g0 * v2;
        d1[i] = rate * (s1 - l1[i]) + kept * d1[i];
        d2[i] = rate * (s2 - l2[i]) + kept * d2[i];
        l1[i] = fresh * s1 + kept * l1[i];
        l2[i] = fresh * s2 + kept * l2[i];
        const double tau = std::min(visc[i], cap);
        s1 += tau * d1[i];
        s2 += tau * d2[i];
        const double m1 = k1[i] * (s1 - r1[i]), m2 = k2[i] * (s2 - r2[i]),
                     m3 = k3[i] * (pt[i] * g0 * v3 - r3[i]);
        const double more = -slope * (v1 * m1 + v2 * m2 + v3 * m3);
        const double g1 = g0 * (c0 * m1 + v2 * m3 - v3 * m2) + more * v1;
        const double g2 = g0 * (c0 * m2 + v3 * m1 - v1 * m3) + more * v2;
        const double g3 = g0 * (c0 * m3 + v1 * m2 - v2 * m1) + more * v3;
        const double w1 = 2.0 * (ay * g3 - az * g2), w2 = 2.0 * (az * g1 - ax * g3),
                     w3 = 2.0 * (ax * g2 - ay * g1);
        gx[i] = g1 + aw * w1 + ay * w3 - az * w2;
        gy[i] = g2 + aw * w2 + az * w1 - ax * w3;
        gz[i] = g3 + aw * w3 + ax * w2 - ay * w1;
    }
}

// The same for one joint between any two frames: the ends' half cells. Without viscosity: an end may be held
// at one tick and free at the next, so there is no rate to speak of.
Vec3 CosseratRod::joint_moment(int i, const Quat& a, const Quat& b) const {
    Quat p = conjugate(a) * b;
    if (p.w < 0.0) p = {-p.w, -p.x, -p.y, -p.z};
    const double g = turn_factor(p.w), s = g * per_cell_[i], s3 = g * per_twist_cell_[i];
    const Vec3 v{p.x, p.y, p.z},
        m{k1_[i] * (s * p.x - rest1_[i]), k2_[i] * (s * p.y - rest2_[i]), k3_[i] * (s3 * p.z - rest3_[i])};
    return rotate(a, g * (p.w * m + cross(v, m)) - (turn_factor_slope(p.w, g) * dot(v, m)) * v);
}

// Joint i turns segment i-1 with +G_i and segment i with -G_i; what a segment receives along its direction
// drives its spin. `advance`: a substep has passed since the last call, so the viscous rates are renewed.
void CosseratRod::elastic_moments(double h, bool advance) {
    joint_moments(h, advance);
    const int last = n_ - 1;
    const auto put = [&](int i, Vec3 g) { gx_[i] = g.x, gy_[i] = g.y, gz_[i] = g.z; };
    if (now_.base.mode == RodEndMode::clamped)
        put(0, joint_moment(0, base_clamp_, frame(0)));
    else
        put(0, now_.base.mode == RodEndMode::loaded ? -now_.base.torque : Vec3{});
    if (now_.tip.mode == RodEndMode::clamped)
        put(last, joint_moment(last, frame(last - 1), tip_clamp_));
    else
        put(last, now_.tip.mode == RodEndMode::loaded ? now_.tip.torque : Vec3{});

    const double *gx = gx_.data(), *gy = gy_.data(), *gz = gz_.data();
    const double *tx = tx_.data() + 1, *ty = ty_.data() + 1, *tz = tz_.data() + 1;
    double* torque = torque_.data();
#pragma GCC ivdep
    for (int j = 0; j < last; ++j)
        torque[j] = (gx[j + 1] - gx[j]) * tx[j] + (gy[j + 1] - gy[j]) * ty[j] + (gz[j + 1] - gz[j]) * tz[j];
}

// What twist() has found for the joints' moments, added to the elastic ones of the pose: spins differ, so
// twist grows by it for the time `ahead`, and its damping acts. Segments' torques balance with these, not
// with the elastic moments alone, which are stiff and, where torsion is damped much, far from balance: bent
// by them, a shaft that is turned in contact would fold in zigzag. The axis of a joint's twist halves its
// angle.
void CosseratRod::twist_moments(double ahead, std::span<const double> spin) {
    const double *tx = tx_.data(), *ty = ty_.data(), *tz = tz_.data();
    const double *k = k3_.data(), *per_cell = per_twist_cell_.data(), *tau = twist_viscosity_.data();
    double *gx = gx_.data(), *gy = gy_.data(), *gz = gz_.data();
#pragma GCC ivdep
    for (int i = 1; i < n_ - 1; ++i) {
        const double ax = tx[i] + tx[i + 1], ay = ty[i] + ty[i + 1], az = tz[i] + tz[i + 1];
        const double moment = (ahead + tau[i]) * 0.5 * k[i] * per_cell[i] * (spin[i] - spin[i - 1]);
        const double s = moment / std::sqrt(std::max(ax * ax + ay * ay + az * az, 1e-6));
        gx[i] += s * ax, gy[i] += s * ay, gz[i] += s * az;
    }
    const auto at_clamp = [&](int i, double rate, int t) {
        const double s = (ahead + tau[i]) * 0.5 * k[i] * per_cell[i] * rate;
        gx[i] += s * tx[t], gy[i] += s * ty[t], gz[i] += s * tz[t];
    };
    if (now_.base.mode == RodEndMode::clamped) at_clamp(0, spin[0], 1);
    if (now_.tip.mode == RodEndMode::clamped) at_clamp(n_ - 1, -spin[n_ - 2], n_ - 1);
}

// What a segment receives across its direction becomes a couple of forces on its two nodes.
void CosseratRod::elastic_forces() {
    const int last = n_ - 1;
    const double *gx = gx_.data(), *gy = gy_.data(), *gz = gz_.data(), *inverse = inverse_length_.data();
    const double *tx = tx_.data() + 1, *ty = ty_.data() + 1, *tz = tz_.data() + 1;
    double *cx = couple_x_.data() + 1, *cy = couple_y_.data() + 1, *cz = couple_z_.data() + 1;
#pragma GCC ivdep
    for (int j = 0; j < last; ++j) {
        const double ax = gx[j + 1] - gx[j], ay = gy[j + 1] - gy[j], az = gz[j + 1] - gz[j];
        cx[j] = inverse[j] * (ay * tz[j] - az * ty[j]);
        cy[j] = inverse[j] * (az * tx[j] - ax * tz[j]);
        cz[j] = inverse[j] * (ax * ty[j] - ay * tx[j]);
    }
    const double *m = mass_.data(), *bx = couple_x_.data(), *by = couple_y_.data(), *bz = couple_z_.data();
    const double wx = now_.gravity.x, wy = now_.gravity.y, wz = now_.gravity.z;
    double *fx = fx_.data(), *fy = fy_.data(), *fz = fz_.data();
#pragma GCC ivdep
    for (int i = 0; i < n_; ++i) {
        fx[i] = bx[i] - bx[i + 1] + m[i] * wx;
        fy[i] = by[i] - by[i + 1] + m[i] * wy;
        fz[i] = bz[i] - bz[i + 1] + m[i] * wz;
    }
    const auto push = [&](int i, Vec3 f) { fx_[i] += f.x, fy_[i] += f.y, fz_[i] += f.z; };
    if (now_.base.mode == RodEndMode::loaded) push(0, now_.base.force);
    if (now_.tip.mode == RodEndMode::loaded) push(last, now_.tip.force);
    if (on_axis_ == 0) return;

    // What lies in the sleeve is held there: it has no weight. A bent rod pushes itself out of a sleeve with
    // EI (u^2 - u_0^2) / 2 (Bigoni et al. 2015), the change of bending energy as the clamp moves along. While
    // the mouth's joint is the lateral spring its moment is too rough to be squared, and the next joint's
    // stands for it.
    for (int i = 0; i < on_axis_; ++i)
        push(i, -mass_[i] * now_.gravity);
    const int i = mouth_stiffness_ > 0.0 ? on_axis_ : on_axis_ - 1;
    if (i <= 0 || i >= last) return;
    const Vec3 bend = rotate(conjugate(frame(i - 1)), Vec3{gx_[i], gy_[i], gz_[i]});
    const double u1 = bend.x / k1_[i] + rest1_[i], u2 = bend.y / k2_[i] + rest2_[i];
    const double out =
        0.5 * (k1_[i] * (u1 * u1 - rest1_[i] * rest1_[i]) + k2_[i] * (u2 * u2 - rest2_[i] * rest2_[i]));
    push(on_axis_ - 1, std::clamp(out, -sleeve_limit, sleeve_limit) * now_.guide.direction);
}

void CosseratRod::kick(double h, double fraction, double progress) {
    const double s = fraction * h;
    const double *w = w_.data(), *slow = slow_.data(), *fx = fx_.data(), *fy = fy_.data(), *fz = fz_.data();
    double *vx = vx_.data(), *vy = vy_.data(), *vz = vz_.data();
#pragma GCC ivdep
    for (int i = 0; i < n_; ++i) {
        const double a = s * w[i];
        vx[i] = (vx[i] + a * fx[i]) * slow[i];
        vy[i] = (vy[i] + a * fy[i]) * slow[i];
        vz[i] = (vz[i] + a * fz[i]) * slow[i];
    }
    if (now_.base.mode == RodEndMode::coupled) {
        const Vec3 d = now_.guide.direction;
        const RodCoupling& c = now_.base.axial;
        const double target = c.target + c.velocity * now_.dt * progress;
        const double at = dot(position(0) - now_.guide.origin, d), rate = dot({vx_[0], vy_[0], vz_[0]}, d);
        const double force = clamped_force(c, target, at, rate, c.cap), dv = s * w_[0] * force;
        vx_[0] += dv * d.x, vy_[0] += dv * d.y, vz_[0] += dv * d.z;
        base_force_ += force * d;
    } else if (now_.base.mode == RodEndMode::loaded) {
        base_force_ += now_.base.force;
        base_torque_ += now_.base.torque;
    } else if (now_.base.mode == RodEndMode::clamped) {
        base_force_ += -Vec3{fx_[0], fy_[0], fz_[0]};
        base_torque_ += -Vec3{gx_[0], gy_[0], gz_[0]};
    }
    const int k = n_ - 1;
    if (now_.tip.mode == RodEndMode::loaded) {
        tip_force_ += now_.tip.force;
        tip_torque_ += now_.tip.torque;
    } else if (now_.tip.mode == RodEndMode::clamped) {
        tip_force_ += -Vec3{fx_[k], fy_[k], fz_[k]};
        tip_torque_ += Vec3{gx_[k], gy_[k], gz_[k]};
    }
}

void CosseratRod::hold_end(bool base, double progress) {
    const RodEnd& end = base ? now_.base : now_.tip;
    const int i = base ? 0 : n_ - 1;
    (base ? base_clamp_ : tip_clamp_) =
        blend(base ? base_clamp_from_ : tip_clamp_from_, end.orientation, progress);
    const Vec3 from = base ? base_from_ : tip_from_;
    const Vec3 v = (1.0 / now_.dt) * (end.position - from), to = from + progress * (end.position - from);
    (base ? base_force_ : tip_force_) +=
        (mass_[i] * substeps_ / now_.dt) * (v - Vec3{vx_[i], vy_[i], vz_[i]});
    vx_[i] = v.x, vy_[i] = v.y, vz_[i] = v.z;
    x_[i] = to.x, y_[i] = to.y, z_[i] = to.z;
}

void CosseratRod::drift(double h, double progress) {
    if (mouth_stiffness_ > 0.0 && on_axis_ < n_) {
        const int i = on_axis_;
        const Vec3 d = now_.guide.direction, r = position(i) - now_.guide.origin, v{vx_[i], vy_[i], vz_[i]};
        const Vec3 y = r - dot(r, d) * d, along = dot(v, d) * d, side = v - along;
        const double k = h * w_[i] * mouth_stiffness_;
        const Vec3 next = along + (1.0 / (1.0 + h * k)) * (side - k * y);
        vx_[i] = next.x, vy_[i] = next.y, vz_[i] = next.z;
    }
    double *x = x_.data(), *y = y_.data(), *z = z_.data();
    const double *vx = vx_.data(), *vy = vy_.data(), *vz = vz_.data();
#pragma GCC ivdep
    for (int i = 0; i < n_; ++i)
        x[i] += h * vx[i], y[i] += h * vy[i], z[i] += h * vz[i];
    if (now_.base.mode == RodEndMode::clamped) hold_end(true, progress);
    if (now_.tip.mode == RodEndMode::clamped) hold_end(false, progress);
    hold_to_axis();
}

// All lengths at once, by Newton. Tensions act along the directions at the substep's start (SHAKE, Ryckaert
// et al. 1977: this keeps the leapfrog symplectic), lengths are measured along the present ones, so the
// tri-diagonal matrix is not symmetric: Gaussian elimination with partial pivoting.
double CosseratRod::solve_lengths(double h) {
    const int m = n_ - 1;
    double *x = x_.data(), *y = y_.data(), *z = z_.data(), *vx = vx_.data(), *vy = vy_.data(),
           *vz = vz_.data();
    const double *w = w_.data(), *l = length_.data();
    const double *tx = tx_.data(), *ty = ty_.data(), *tz = tz_.data();
    double *lower = lower_.data(), *diagonal = diagonal_.data(), *upper = upper_.data(),
           *right = right_.data();
    double *lambda = lambda_.data(), worst = 0.0;
#pragma GCC ivdep
    for (int j = 0; j < m; ++j) {
        const double ex = x[j + 1] - x[j], ey = y[j + 1] - y[j], ez = z[j + 1] - z[j];
        const double length = std::sqrt(ex * ex + ey * ey + ez * ez), inverse = 1.0 / length;
        const double nx = ex * inverse, ny = ey * inverse, nz = ez * inverse;
        right[j] = length - l[j];
        // The small addition keeps a straight rod held at both ends solvable.
        diagonal[j] = (w[j] + w[j + 1]) * (nx * tx[j + 1] + ny * ty[j + 1] + nz * tz[j + 1]) * (1.0 + 1e-10);
        upper[j] = -w[j + 1] * (nx * tx[j + 2] + ny * ty[j + 2] + nz * tz[j + 2]);
        lower[j] = -w[j] * (nx * tx[j] + ny * ty[j] + nz * tz[j]);
    }
    for (int j = 0; j < m; ++j)
        worst = std::max(worst, std::fabs(right[j]) * inverse_length_[j]);
    const auto on_line = [&](int row, int node, Vec3 d) {
        const Vec3 e = position(row + 1) - position(row), t{tx[row + 1], ty[row + 1], tz[row + 1]};
        const Vec3 k = (1.0 / norm(e)) * e;
        diagonal[row] += w[node] * (dot(k, d) * dot(t, d) - dot(k, t));
    };
    if (on_axis_ > 0 && on_axis_ < n_) on_line(on_axis_ - 1, on_axis_ - 1, now_.guide.direction);
    if (!solve_tensions()) return 0.0;
    double* pulled = pulled_.data();
#pragma GCC ivdep
    for (int j = 1; j <= m; ++j)
        pulled[j] += lambda[j];
    const double per_h = 1.0 / h;
#pragma GCC ivdep
    for (int i = 0; i < n_; ++i) {
        const double a = w[i] * lambda[i + 1], b = w[i] * lambda[i];
        const double dx = a * tx[i + 1] - b * tx[i], dy = a * ty[i + 1] - b * ty[i],
                     dz = a * tz[i + 1] - b * tz[i];
        x[i] += dx, y[i] += dy, z[i] += dz;
        vx[i] += dx * per_h, vy[i] += dy * per_h, vz[i] += dz * per_h;
    }
    if (on_axis_ > 0) hold_to_axis();
    const double force = per_h * per_h;
    if (now_.base.mode == RodEndMode::clamped)
        base_force_ += -(force * lambda[1]) * Vec3{tx[1], ty[1], tz[1]};
    if (now_.tip.mode == RodEndMode::clamped) tip_force_ += (force * lambda[m]) * Vec3{tx[m], ty[m], tz[m]};
    return worst;
}

void CosseratRod::project_lengths(double h) {
    for (int k = 0; k < most_solves; ++k)
        if (solve_lengths(h) < second_solve_above) return;
}

// lambda_ from the tri-diagonal system, which is lost. Rows are exchanged, as LAPACK does, only where a
// segment turns so far in a substep that a pivot becomes small.
bool CosseratRod::solve_tensions() {
    const int m = n_ - 1;
    double *lower = lower_.data(), *diagonal = diagonal_.data(), *upper = upper_.data(),
           *right = right_.data();
    if (two_ended::solve(m, lower, diagonal, upper, right, pivot_.data(), lambda_.data() + 1)) return true;
    if (!lapack::solve_tridiagonal(m, lower + 1, diagonal, upper, right)) return false;
    std::copy(right, right + m, lambda_.begin() + 1);
    return true;
}

// Takes from velocities, 3 times N, the least that changes lengths, in the measure of the masses; what lies
// in the guide keeps to its axis. lambda_: the tensions that do so. False, and nothing taken: no solution.
bool CosseratRod::keep_lengths(Array& vx, Array& vy, Array& vz) {
    const auto onto_axis = [&] {
        for (int i = 0; i < on_axis_; ++i) {
            const Vec3 v = dot({vx[i], vy[i], vz[i]}, now_.guide.direction) * now_.guide.direction;
            vx[i] = v.x, vy[i] = v.y, vz[i] = v.z;
        }
    };
    onto_axis();
    double* right = right_.data();
    for (int j = 0; j < n_ - 1; ++j) {
        const int s = j + 1;
        right[j] = tx_[s] * (vx[s] - vx[j]) + ty_[s] * (vy[s] - vy[j]) + tz_[s] * (vz[s] - vz[j]);
        diagonal_[j] = (w_[j] + w_[s]) * (1.0 + 1e-10);
        lower_[j] = -w_[j] * (tx_[s] * tx_[j] + ty_[s] * ty_[j] + tz_[s] * tz_[j]);
        upper_[j] =
            j + 2 < n_ ? -w_[s] * (tx_[s] * tx_[s + 1] + ty_[s] * ty_[s + 1] + tz_[s] * tz_[s + 1]) : 0.0;
    }
    if (!solve_tensions()) return false;
    for (int i = 0; i < n_; ++i) {
        const double a = w_[i] * lambda_[i + 1], b = w_[i] * lambda_[i];
        vx[i] += a * tx_[i + 1] - b * tx_[i];
        vy[i] += a * ty_[i + 1] - b * ty_[i];
        vz[i] += a * tz_[i + 1] - b * tz_[i];
    }
    onto_axis();
    return true;
}

// Axial spins with twist taken implicitly (backward Euler), which is what makes 0.1 ms substeps possible:
// torsional waves would ask for 30 us at 1 cm spacing. D = I + (h^2 + h tau) K is tri-diagonal, symmetric,
// definite and constant over the tick.
void CosseratRod::factor_twist(double h) {
    const int m = n_ - 1;
    const auto stiffness = [&](int i) {
        if (i == 0 && now_.base.mode != RodEndMode::clamped) return 0.0;
        if (i == n_ - 1 && now_.tip.mode != RodEndMode::clamped) return 0.0;
        return (h * h + h * twist_viscosity_[i]) * 0.5 * k3_[i] * per_twist_cell_[i];
    };
    for (int j = 0; j < m; ++j) {
        twist_diagonal_[j] = polar_[j] + stiffness(j) + stiffness(j + 1);
        twist_off_[j] = j + 1 < m ? -stiffness(j + 1) : 0.0;
    }
    two_ended::factor(m, twist_diagonal_.data(), twist_off_.data());
    if (now_.base.mode != RodEndMode::coupled) return;
    std::fill(twist_unit_.begin(), twist_unit_.end(), 0.0);
    twist_unit_[0] = 1.0;
    two_ended::solve(m, twist_diagonal_.data(), twist_off_.data(), twist_unit_.data());
}

// Returns the torque of the coupling at the base, N m about the guide.
double CosseratRod::twist(double h, double progress, std::span<double> spin) const {
    const int m = n_ - 1;
    const double *polar = polar_.data(), *torque = torque_.data(), *slow = slow_spin_.data(),
                 *unit = twist_unit_.data();
    for (int j = 0; j < m; ++j)
        spin[j] = polar[j] * slow[j] * spin_[j] + h * torque[j];
    two_ended::solve(m, twist_diagonal_.data(), twist_off_.data(), spin.data());
    if (now_.base.mode != RodEndMode::coupled) return 0.0;
    // The coupling's torque at the substep's end, T = k (target - roll - h s) + c (velocity - s) with
    // s = spin + h T unit, solved for T.
    const RodCoupling& c = now_.base.roll;
    const double target = c.target + c.velocity * now_.dt * progress;
    const double k = c.stiffness * h + c.damping;
    const double free = c.stiffness * (target - roll_ - h * spin[0]) + c.damping * (c.velocity - spin[0]);
    const double t = std::clamp(free / (1.0 + k * h * unit[0]), -c.cap, c.cap);
    for (int j = 0; j < m; ++j)
        spin[j] += h * t * unit[j];
    return t;
}

// Frames follow their segments by the smallest turn from the old third axis to the new direction, and spin
// about it.
void CosseratRod::turn_frames(double h) {
    const double *x = x_.data(), *y = y_.data(), *z = z_.data(), *spin = spin_.data();
    double *tx = tx_.data() + 1, *ty = ty_.data() + 1, *tz = tz_.data() + 1;
    double *qw = qw_.data(), *qx = qx_.data(), *qy = qy_.data(), *qz = qz_.data();
    const double half = 0.5 * h;
    roll_ += h * spin[0];
#pragma GCC ivdep
    for (int j = 0; j < n_ - 1; ++j) {
        const double ex = x[j + 1] - x[j], ey = y[j + 1] - y[j], ez = z[j + 1] - z[j];
        const double inverse = 1.0 / std::sqrt(ex * ex + ey * ey + ez * ez);
        const double bx = ex * inverse, by = ey * inverse, bz = ez * inverse;
        const double w = qw[j], a = qx[j], b = qy[j], c = qz[j];
        const double dx = 2.0 * (a * c + w * b), dy = 2.0 * (b * c - w * a),
                     dz = w * w - a * a - b * b + c * c;
        const double r0 = 1.0 + dx * bx + dy * by + dz * bz;
        const double r1 = dy * bz - dz * by, r2 = dz * bx - dx * bz, r3 = dx * by - dy * bx;
        const double sw = r0 * w - r1 * a - r2 * b - r3 * c, sx = r0 * a + r1 * w + r2 * c - r3 * b;
        const double sy = r0 * b - r1 * c + r2 * w + r3 * a, sz = r0 * c + r1 * b - r2 * a + r3 * w;
        const double p = half * spin[j];
        const double ow = sw - p * sz, ox = sx + p * sy, oy = sy - p * sx, oz = sz + p * sw;
        const double unit = 1.0 / std::sqrt(ow * ow + ox * ox + oy * oy + oz * oz);
        qw[j] = ow * unit, qx[j] = ox * unit, qy[j] = oy * unit, qz[j] = oz * unit;
        tx[j] = bx, ty[j] = by, tz[j] = bz;
    }
    if (now_.guide.present) advance_ = dot(position(0) - now_.guide.origin, now_.guide.direction);
}

} // namespace calot::rod_cosserat
