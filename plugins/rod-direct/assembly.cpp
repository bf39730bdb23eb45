// The linearised step of the rod alone: joints, segments, nodes. Loops are written to be vectorised.
#include "direct_rod.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_direct {

namespace {

// A segment in the sleeve keeps its direction by this much more stiffness than its joints have: stiff enough
// to leave a millionth of a turn, soft enough for a 3x3 inverse by cofactors.
constexpr double lock = 1e6;

struct Turned {
    double v1, v2, v3, w;
};

// The short way from a to b, in a's and b's own axes alike.
inline Turned between_frames(const double* const q[4], int i) {
    const double aw = q[0][i], ax = q[1][i], ay = q[2][i], az = q[3][i];
    const double bw = q[0][i + 1], bx = q[1][i + 1], by = q[2][i + 1], bz = q[3][i + 1];
    const double p0 = aw * bw + ax * bx + ay * by + az * bz;
    const double sign = std::copysign(1.0, p0);
    // In pairs that cancel to the last bit where both lie in one coordinate plane.
    return {sign * ((aw * bx - ax * bw) + (az * by - ay * bz)),
            sign * ((aw * by - ay * bw) + (ax * bz - az * bx)),
            sign * ((aw * bz + ay * bx) - (ax * by + az * bw)), sign * p0};
}

} // namespace

// Kelvin-Voigt: moment k (phi - rest + tau (phi - phi_start) / h) = kv phi - offset, kv = k (1 + tau / h).
void DirectRod::viscous_offsets() {
    const double* const q[4] = {q_[0].data(), q_[1].data(), q_[2].data(), q_[3].data()};
    const double per_h = 1.0 / stage_;
    const double *k1 = k_[0].data(), *k2 = k_[1].data(), *k3 = k_[2].data(), *r1 = rest_[0].data(),
                 *r2 = rest_[1].data(), *r3 = rest_[2].data(), *t1 = viscosity_[0].data(),
                 *t3 = viscosity_[2].data();
    double *kv1 = kv_[0].data(), *kv2 = kv_[1].data(), *kv3 = kv_[2].data(), *o1 = offset_[0].data(),
           *o2 = offset_[1].data(), *o3 = offset_[2].data();
    if (!viscous_) {
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i) {
            kv1[i] = k1[i], kv2[i] = k2[i], kv3[i] = k3[i];
            o1[i] = k1[i] * r1[i], o2[i] = k2[i] * r2[i], o3[i] = k3[i] * r3[i];
        }
        return;
    }
#pragma GCC ivdep
    for (int i = 0; i < n_; ++i) {
        const Turned p = between_frames(q, i);
        const double f = 2.0 * turn_factor(p.w), s1 = t1[i] * per_h, s3 = t3[i] * per_h;
        kv1[i] = k1[i] * (1.0 + s1), kv2[i] = k2[i] * (1.0 + s1), kv3[i] = k3[i] * (1.0 + s3);
        o1[i] = k1[i] * (r1[i] + s1 * f * p.v1);
        o2[i] = k2[i] * (r2[i] + s1 * f * p.v2);
        o3[i] = k3[i] * (r3[i] + s3 * f * p.v3);
    }
}

// Joint i turns by the rotation vector phi = 2 g(w) v of p = conjugate(q_a) q_b = (w, v). Turning b by a
// small angle in its own axes, alpha, changes phi by T alpha, T = g (w + [v] x) - g'(w) v v^T; turning a by
// it changes phi by -T^T alpha. So with the world's angles a_a, a_b both ways phi changes by D (a_b - a_a),
// D = T R_b^T: the moment is D^T s on a and its negative on b, s = kv phi - offset, and the stiffness
// D^T kv D. The order of turns adds half the moment across: energy -m . (a_a x a_b) / 2.
void DirectRod::joints() {
    const double* const q[4] = {q_[0].data(), q_[1].data(), q_[2].data(), q_[3].data()};
    const double *kv1 = kv_[0].data(), *kv2 = kv_[1].data(), *kv3 = kv_[2].data(), *o1 = offset_[0].data(),
                 *o2 = offset_[1].data(), *o3 = offset_[2].data();
    double *m1 = moment_[0].data(), *m2 = moment_[1].data(), *m3 = moment_[2].data();
    double *kxx = joint_k_[0].data(), *kxy = joint_k_[1].data(), *kxz = joint_k_[2].data(),
           *kyy = joint_k_[3].data(), *kyz = joint_k_[4].data(), *kzz = joint_k_[5].data();
#pragma GCC ivdep
    for (int i = 0; i < n_; ++i) {
        const Turned p = between_frames(q, i);
        const double g = turn_factor(p.w), dg = turn_factor_slope(p.w, g), gw = g * p.w;
        const double s1 = 2.0 * kv1[i] * g * p.v1 - o1[i], s2 = 2.0 * kv2[i] * g * p.v2 - o2[i],
                     s3 = 2.0 * kv3[i] * g * p.v3 - o3[i];
        const double d1 = dg * p.v1, d2 = dg * p.v2, d3 = dg * p.v3;
        const double g1 = g * p.v1, g2 = g * p.v2, g3 = g * p.v3;
        // Columns of T^T.
        const double c11 = gw - d1 * p.v1, c12 = -g3 - d1 * p.v2, c13 = g2 - d1 * p.v3;
        const double c21 = g3 - d2 * p.v1, c22 = gw - d2 * p.v2, c23 = -g1 - d2 * p.v3;
        const double c31 = -g2 - d3 * p.v1, c32 = g1 - d3 * p.v2, c33 = gw - d3 * p.v3;
        const double w = q[0][i + 1], x = q[1][i + 1], y = q[2][i + 1], z = q[3][i + 1];
        const double wy = w * w - y * y, zx = z * z - x * x, wz = w * w - z * z, yx = y * y - x * x;
        const double r11 = wy - zx, r12 = 2.0 * (x * y - w * z), r13 = 2.0 * (x * z + w * y);
        const double r21 = 2.0 * (x * y + w * z), r22 = wz + yx, r23 = 2.0 * (y * z - w * x);
        const double r31 = 2.0 * (x * z - w * y), r32 = 2.0 * (y * z + w * x), r33 = wy + zx;
        const double a1x = r11 * c11 + r12 * c12 + r13 * c13, a1y = r21 * c11 + r22 * c12 + r23 * c13,
                     a1z = r31 * c11 + r32 * c12 + r33 * c13;
        const double a2x = r11 * c21 + r12 * c22 + r13 * c23, a2y = r21 * c21 + r22 * c22 + r23 * c23,
                     a2z = r31 * c21 + r32 * c22 + r33 * c23;
        const double a3x = r11 * c31 + r12 * c32 + r13 * c33, a3y = r21 * c31 + r22 * c32 + r23 * c33,
                     a3z = r31 * c31 + r32 * c32 + r33 * c33;
        m1[i] = a1x * s1 + a2x * s2 + a3x * s3;
        m2[i] = a1y * s1 + a2y * s2 + a3y * s3;
        m3[i] = a1z * s1 + a2z * s2 + a3z * s3;
        const double b1x = kv1[i] * a1x, b1y = kv1[i] * a1y, b1z = kv1[i] * a1z;
        const double b2x = kv2[i] * a2x, b2y = kv2[i] * a2y, b2z = kv2[i] * a2z;
        const double b3x = kv3[i] * a3x, b3y = kv3[i] * a3y, b3z = kv3[i] * a3z;
        kxx[i] = b1x * a1x + b2x * a2x + b3x * a3x;
        kxy[i] = b1x * a1y + b2x * a2y + b3x * a3y;
        kxz[i] = b1x * a1z + b2x * a2z + b3x * a3z;
        kyy[i] = b1y * a1y + b2y * a2y + b3y * a3y;
        kyz[i] = b1y * a1z + b2y * a2z + b3y * a3z;
        kzz[i] = b1z * a1z + b2z * a2z + b3z * a3z;
    }
}

// The rod's own part of the system at the present iterate. `with_geometry`: the joints' moments and the
// tension act on what is turned; without, the matrix is definite whatever they are.
void DirectRod::assemble(bool with_geometry) {
    joints();
    const double h = stage_, per_h = 1.0 / h, per_h2 = per_h * per_h;
    const double half = with_geometry ? 0.5 : 0.0, one = with_geometry ? 1.0 : 0.0;
    for (int k = 0; k < 6; ++k)
        std::copy(joint_k_[k].begin(), joint_k_[k].end(), solver_.k[k].begin());
    for (int k = 0; k < 3; ++k) {
        double* c = solver_.c[k].data();
        const double* m = moment_[k].data();
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i)
            c[i] = half * m[i];
    }
    {
        const double *qw = q_[0].data() + 1, *qx = q_[1].data() + 1, *qy = q_[2].data() + 1,
                     *qz = q_[3].data() + 1;
        double *tx = direction_[0].data(), *ty = direction_[1].data(), *tz = direction_[2].data();
        double *ax = solver_.arm[0].data(), *ay = solver_.arm[1].data(), *az = solver_.arm[2].data();
        const double* l = length_.data();
#pragma GCC ivdep
        for (int j = 0; j < m_; ++j) {
            tx[j] = 2.0 * (qx[j] * qz[j] + qw[j] * qy[j]);
            ty[j] = 2.0 * (qy[j] * qz[j] - qw[j] * qx[j]);
            tz[j] = (qw[j] * qw[j] - qy[j] * qy[j]) + (qz[j] * qz[j] - qx[j] * qx[j]);
            ax[j] = l[j] * tx[j], ay[j] = l[j] * ty[j], az[j] = l[j] * tz[j];
        }
    }
    const double *tx = direction_[0].data(), *ty = direction_[1].data(), *tz = direction_[2].data();
    const double *kxx = joint_k_[0].data(), *kxy = joint_k_[1].data(), *kxz = joint_k_[2].data(),
                 *kyy = joint_k_[3].data(), *kyz = joint_k_[4].data(), *kzz = joint_k_[5].data();
    const double *mx = moment_[0].data(), *my = moment_[1].data(), *mz = moment_[2].data();
    const double *ux = turn_[0].data(), *uy = turn_[1].data(), *uz = turn_[2].data();
    const double *ox = turn_guess_[0].data(), *oy = turn_guess_[1].data(), *oz = turn_guess_[2].data();
    const double *fx = force_[0].data(), *fy = force_[1].data(), *fz = force_[2].data();
    const double *jt = transverse_.data(), *jp = polar_.data(), *l = length_.data(),
                 *rho = mass_per_length_.data(), *drag = drag_.data();
    double *hxx = h_[0].data(), *hxy = h_[1].data(), *hxz = h_[2].data(), *hyy = h_[3].data(),
           *hyz = h_[4].data(), *hzz = h_[5].data(), *gx = g_[0].data(), *gy = g_[1].data(),
           *gz = g_[2].data();
#pragma GCC ivdep
    for (int j = 0; j < m_; ++j) {
        const double slow = per_h * drag[j] / rho[j], inertia = per_h2 + slow;
        const double across = jt[j] * inertia, about = jp[j] * inertia;
        const double tension = one * l[j] * std::max(0.0, fx[j] * tx[j] + fy[j] * ty[j] + fz[j] * tz[j]);
        const double d = across + tension, s = about - across - tension;
        const double sx = s * tx[j], sy = s * ty[j], sz = s * tz[j];
        hxx[j] = kxx[j] + kxx[j + 1] + d + sx * tx[j];
        hxy[j] = kxy[j] + kxy[j + 1] + sx * ty[j];
        hxz[j] = kxz[j] + kxz[j + 1] + sx * tz[j];
        hyy[j] = kyy[j] + kyy[j + 1] + d + sy * ty[j];
        hyz[j] = kyz[j] + kyz[j + 1] + sy * tz[j];
        hzz[j] = kzz[j] + kzz[j + 1] + d + sz * tz[j];
        // Inertia and drag: J (inertia turn - guess / h^2).
        const double ix = inertia * ux[j] - per_h2 * ox[j], iy = inertia * uy[j] - per_h2 * oy[j],
                     iz = inertia * uz[j] - per_h2 * oz[j];
        const double along = (jp[j] - jt[j]) * (ix * tx[j] + iy * ty[j] + iz * tz[j]);
        gx[j] = mx[j + 1] - mx[j] - jt[j] * ix - along * tx[j];
        gy[j] = my[j + 1] - my[j] - jt[j] * iy - along * ty[j];
        gz[j] = mz[j + 1] - mz[j] - jt[j] * iz - along * tz[j];
    }
    const double *mass = mass_.data(), *slow = node_drag_.data();
    const double gravity[3] = {now_.gravity.x, now_.gravity.y, now_.gravity.z};
    for (int k = 0; k < 3; ++k) {
        double* b = b_[k].data();
        const double *x = x_[k].data(), *x0 = x0_[k].data(), *v = v_[k].data(), weight = gravity[k];
#pragma GCC ivdep
        for (int i = 0; i < n_; ++i) {
            const double moved = per_h * (x[i] - x0[i]);
            b[i] = mass[i] * (weight - per_h * (moved - v[i])) - slow[i] * moved;
        }
    }
    // Segments that lie in the sleeve with both ends keep its direction; nodes in it feel axial forces only
    // and have no weight.
    if (on_axis_ > 0) {
        const Vec3 d = now_.guide.direction;
        for (int i = 0; i < on_axis_; ++i) {
            const Vec3 b = row(b_, i) - mass_[at(i)] * now_.gravity;
            set_node(b_, i, dot(b, d) * d);
        }
        for (int j = 0; j + 1 < on_axis_; ++j) {
            const std::size_t s = at(j);
            const double k = lock * (k_[0][s] + k_[1][s] + k_[0][s + 1] + k_[1][s + 1] + jt[j] * per_h2);
            const double t[3] = {d.x, d.y, d.z};
            int e = 0;
            for (int r = 0; r < 3; ++r)
                for (int c = r; c < 3; ++c, ++e)
                    h_[e][s] += k * ((r == c ? 1.0 : 0.0) - t[r] * t[c]);
            const Vec3 g = row(g_, j);
            set_node(g_, j, dot(g, d) * d);
            for (auto& arm : solver_.arm)
                arm[s] = 0.0;
        }
    }
}

} // namespace calot::rod_direct
