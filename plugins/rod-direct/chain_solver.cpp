#include "chain_solver.hpp"

#include <algorithm>

namespace calot::rod_direct {

namespace {

inline double lane_minimum(double v) {
    return v;
}
inline double lane_minimum(Pair v) {
    return std::min(v[0], v[1]);
}
inline double smaller(double a, double b) {
    return a < b ? a : b;
}
inline Pair smaller(Pair a, Pair b) {
    return a < b ? a : b;
}

template<class V>
V both(double left, double right);
template<>
inline double both<double>(double left, double) {
    return left;
}
template<>
inline Pair both<Pair>(double left, double right) {
    return Pair{left, right};
}

template<class V>
Sym<V> load_sym(const std::vector<double>* from, int left, int right) {
    const auto l = static_cast<std::size_t>(left), r = static_cast<std::size_t>(right);
    return {both<V>(from[0][l], from[0][r]), both<V>(from[1][l], from[1][r]),
            both<V>(from[2][l], from[2][r]), both<V>(from[3][l], from[3][r]),
            both<V>(from[4][l], from[4][r]), both<V>(from[5][l], from[5][r])};
}
template<class V>
Vec<V> load_vec(const std::vector<double>* from, int left, int right) {
    const auto l = static_cast<std::size_t>(left), r = static_cast<std::size_t>(right);
    return {both<V>(from[0][l], from[0][r]), both<V>(from[1][l], from[1][r]),
            both<V>(from[2][l], from[2][r])};
}
template<class V>
Mat<V> load_mat(const std::vector<double>* from, int left, int right) {
    const auto l = static_cast<std::size_t>(left), r = static_cast<std::size_t>(right);
    Mat<V> m;
    for (int i = 0; i < 9; ++i)
        m.a[i] = both<V>(from[i][l], from[i][r]);
    return m;
}
inline void store(const Vec<double>& v, std::vector<double>* to, int left, int) {
    const auto l = static_cast<std::size_t>(left);
    to[0][l] = v.x, to[1][l] = v.y, to[2][l] = v.z;
}
inline void store(const Vec<Pair>& v, std::vector<double>* to, int left, int right) {
    const auto l = static_cast<std::size_t>(left), r = static_cast<std::size_t>(right);
    to[0][l] = v.x[0], to[1][l] = v.y[0], to[2][l] = v.z[0];
    to[0][r] = v.x[1], to[1][r] = v.y[1], to[2][r] = v.z[1];
}

// K - [c] x; the right chain sees it transposed, its `mirror` is -1.
template<class V>
Mat<V> joint_matrix(const Sym<V>& k, const Vec<V>& c) {
    return {{k.xx, k.xy + c.z, k.xz - c.y, k.xy - c.z, k.yy, k.yz + c.x, k.xz + c.y, k.yz - c.x, k.zz}};
}

// E = -[arm] x.
template<class V>
Mat<V> arm_matrix(const Vec<V>& t) {
    const V zero = t.x - t.x;
    return {{zero, t.z, -t.y, -t.z, zero, t.x, t.y, -t.x, zero}};
}

// E a of -[arm] x, added to `to`.
template<class V>
void add(Mat<V>& to, const Vec<V>& t) {
    to.a[1] += t.z, to.a[2] -= t.y;
    to.a[3] -= t.z, to.a[5] += t.x;
    to.a[6] += t.y, to.a[7] -= t.x;
}

template<class V>
Sym<V> diagonal(V d) {
    const V zero = d - d;
    return {d, zero, zero, d, zero, d};
}

} // namespace

ChainSolver::ChainSolver(int segments)
    : m_(segments), middle_(segments / 2), pairs_((segments - 1) / 2),
      two_(static_cast<std::size_t>(pairs_)) {
    const auto m = static_cast<std::size_t>(m_);
    for (auto& x : h)
        x.assign(m, 0.0);
    for (auto* group : {arm, g, r, a, n})
        for (int i = 0; i < 3; ++i)
            group[i].assign(m, 0.0);
    for (auto* group : {e, z})
        for (int i = 0; i < 9; ++i)
            group[i].assign(m, 0.0);
    for (auto& x : v)
        x.assign(m, 0.0);
    soft.assign(m, 0.0);
    plain.assign(m, 1);
    for (auto* group : {k, full_w})
        for (int i = 0; i < 6; ++i)
            group[i].assign(m + 1, 0.0);
    for (auto& x : c)
        x.assign(m + 1, 0.0);
    w.assign(m + 1, 0.0);
}

template<>
ChainSolver::Factor<Pair>& ChainSolver::factor<Pair>(int slot) {
    return two_[static_cast<std::size_t>(slot)];
}
template<>
ChainSolver::Factor<double>& ChainSolver::factor<double>(int) {
    return one_;
}

// The two blocks of a slot go the same way: a plain one beside a full one is written out.
void ChainSolver::match_lanes() {
    const auto write_out = [&](std::size_t j) {
        const Mat<double> ee = arm_matrix(load_vec<double>(arm, static_cast<int>(j), 0));
        for (std::size_t i = 0; i < 9; ++i)
            e[i][j] = ee.a[i], z[i][j] = 0.0;
        for (std::size_t i : {0, 1, 2, 3, 4, 5}) {
            const bool on = i == 0 || i == 3 || i == 5;
            v[i][j] = on ? w[j] + w[j + 1] + soft[j] : 0.0;
            full_w[i][j] = on ? w[j] : 0.0, full_w[i][j + 1] = on ? w[j + 1] : 0.0;
        }
        plain[j] = 0;
    };
    for (std::size_t l = 0, r = static_cast<std::size_t>(m_) - 1; l < r; ++l, --r)
        if (plain[l] != plain[r]) write_out(plain[l] != 0 ? l : r);
}

// Block `slot` of the left chain, and its mirror image of the right one. From the inverse of the last Schur
// complement, [P Q; Q^T -R] with P = G^-1, Q = P F, R = V^-1 - F^T Q, F = E V^-1, G = H + F E^T, and the
// coupling O = [-B 0; Z W]: S' = D - O^T S^-1 O.
template<class V, bool is_plain>
void ChainSolver::eliminate(int slot, V& worst) {
    const int left = slot, right = m_ - 1 - slot;
    Factor<V>& f = factor<V>(slot);
    Sym<V> hh = load_sym<V>(h, left, right), vv;
    Vec<V> ga = load_vec<V>(g, left, right), gn = load_vec<V>(r, left, right);
    Mat<V> ee;
    const Vec<V> t = load_vec<V>(arm, left, right);
    if constexpr (is_plain) {
        vv = diagonal<V>(both<V>(w[static_cast<std::size_t>(left)] + w[static_cast<std::size_t>(left) + 1] +
                                     soft[static_cast<std::size_t>(left)],
                                 w[static_cast<std::size_t>(right)] + w[static_cast<std::size_t>(right) + 1] +
                                     soft[static_cast<std::size_t>(right)]));
        ee = arm_matrix(t);
    } else {
        vv = load_sym<V>(v, left, right);
        ee = load_mat<V>(e, left, right);
    }
    if (slot > 0) {
        const Factor<Pair>& former = two_[static_cast<std::size_t>(slot - 1)];
        // A single block continues the left chain.
        const auto part = [](const Pair& x) {
            if constexpr (sizeof(V) == sizeof(Pair))
                return x;
            else
                return x[0];
        };
        const auto sym = [&](const Sym<Pair>& s) {
            return Sym<V>{part(s.xx), part(s.xy), part(s.xz), part(s.yy), part(s.yz), part(s.zz)};
        };
        const auto vec = [&](const Vec<Pair>& s) { return Vec<V>{part(s.x), part(s.y), part(s.z)}; };
        Mat<V> q;
        for (int i = 0; i < 9; ++i)
            q.a[i] = part(former.q.a[i]);
        const Sym<V> p = sym(former.p), rr = sym(former.schur);
        const Vec<V> za = vec(former.za), zn = vec(former.zn);
        const Vec<V> joint_c = load_vec<V>(c, left, right + 1);
        const V mirror = both<V>(1.0, -1.0);
        const Mat<V> b = joint_matrix(load_sym<V>(k, left, right + 1),
                                      Vec<V>{mirror * joint_c.x, mirror * joint_c.y, mirror * joint_c.z});
        const Mat<V> pb = times(p, b), qb = transposed_times(q, b);
        hh = hh - symmetric_transposed_times(b, pb);
        ga = ga + transposed_times(b, za);
        if constexpr (is_plain) {
            const V ww = both<V>(w[static_cast<std::size_t>(left)], w[static_cast<std::size_t>(right) + 1]);
            const V w2 = ww * ww;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    ee.a[3 * i + j] += ww * qb.a[3 * j + i];
            vv = vv - Sym<V>{w2 * rr.xx, w2 * rr.xy, w2 * rr.xz, w2 * rr.yy, w2 * rr.yz, w2 * rr.zz};
            gn = gn - Vec<V>{ww * zn.x, ww * zn.y, ww * zn.z};
        } else {
            const Sym<V> ww = load_sym<V>(full_w, left, right + 1);
            const Mat<V> zz = load_mat<V>(z, left, right);
            // Upper right: C + B^T Q W + Z^T R W; upper left: + B^T Q Z + its transposed + Z^T R Z.
            Mat<V> bq;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    bq.a[3 * i + j] = qb.a[3 * j + i];
            const Mat<V> rz = times(rr, zz);
            Mat<V> zr;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    zr.a[3 * i + j] = rz.a[3 * j + i];
            const Mat<V> bqz = [&] {
                Mat<V> x;
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j)
                        x.a[3 * i + j] = bq.a[3 * i] * zz.a[j] + bq.a[3 * i + 1] * zz.a[3 + j] +
                                         bq.a[3 * i + 2] * zz.a[6 + j];
                return x;
            }();
            hh = hh + twice_symmetric(bqz) + symmetric_transposed_times(zz, rz);
            ee = ee + times(bq + zr, ww);
            const Mat<V> wr = [&] {
                const Mat<V> full{{rr.xx, rr.xy, rr.xz, rr.xy, rr.yy, rr.yz, rr.xz, rr.yz, rr.zz}};
                return times(full, ww);
            }();
            const Mat<V> full_ww{{ww.xx, ww.xy, ww.xz, ww.xy, ww.yy, ww.yz, ww.xz, ww.yz, ww.zz}};
            vv = vv - symmetric_transposed_times(full_ww, wr);
            ga = ga - transposed_times(zz, zn);
            gn = gn - times(ww, zn);
        }
    }
    V minors[3];
    f.v_inverse = inverse(vv, minors);
    worst = smaller(worst, smaller(minors[0], smaller(minors[1], minors[2])));
    f.f = times(ee, f.v_inverse);
    const Sym<V> gg = hh + symmetric_times_transposed(f.f, ee);
    f.p = inverse(gg, minors);
    worst = smaller(worst, smaller(minors[0], smaller(minors[1], minors[2])));
    f.q = times(f.p, f.f);
    f.schur = f.v_inverse - symmetric_transposed_times(f.f, f.q);
    f.za = times(f.p, ga + times(f.f, gn));
    f.zn = transposed_times(f.f, f.za) - times(f.v_inverse, gn);
}

// The block where the chains meet.
void ChainSolver::meet(double& worst) {
    const int j = middle_;
    const auto at = static_cast<std::size_t>(j);
    const bool is_plain = plain[at] != 0;
    Sym<double> hh = load_sym<double>(h, j, j), vv;
    Vec<double> ga = load_vec<double>(g, j, j), gn = load_vec<double>(r, j, j);
    Mat<double> ee;
    const auto node_matrix = [&](int i) {
        return is_plain ? diagonal(w[static_cast<std::size_t>(i)]) : load_sym<double>(full_w, i, i);
    };
    if (is_plain) {
        vv = diagonal(w[at] + w[at + 1] + soft[at]);
        ee = arm_matrix(load_vec<double>(arm, j, j));
    } else {
        vv = load_sym<double>(v, j, j);
        ee = load_mat<double>(e, j, j);
    }
    const auto from = [&](const Sym<double>& p, const Mat<double>& q, const Sym<double>& rr,
                          const Vec<double>& za, const Vec<double>& zn, int joint, double mirror,
                          bool has_z) {
        const Vec<double> jc = load_vec<double>(c, joint, joint);
        const Mat<double> b = joint_matrix(load_sym<double>(k, joint, joint),
                                           Vec<double>{mirror * jc.x, mirror * jc.y, mirror * jc.z});
        const Sym<double> s = node_matrix(joint);
        const Mat<double> ww{{s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz}};
        Mat<double> zz{};
        if (!is_plain && has_z) zz = load_mat<double>(z, j, j);
        const auto product = [](const Mat<double>& x, const Mat<double>& y) {
            Mat<double> out;
            for (int i = 0; i < 3; ++i)
                for (int l = 0; l < 3; ++l)
                    out.a[3 * i + l] = x(i, 0) * y(0, l) + x(i, 1) * y(1, l) + x(i, 2) * y(2, l);
            return out;
        };
        const Mat<double> qz = product(q, zz), rz = times(rr, zz);
        const Mat<double> bq = transposed_times(b, q);
        hh = hh - symmetric_transposed_times(b, times(p, b)) + twice_symmetric(transposed_times(b, qz)) +
             symmetric_transposed_times(zz, rz);
        ee = ee + product(bq, ww) + transposed_times(rz, ww);
        vv = vv - symmetric_transposed_times(ww, times(rr, ww));
        ga = ga + transposed_times(b, za) - transposed_times(zz, zn);
        gn = gn - times(ww, zn);
    };
    const auto lane = [&](const Factor<Pair>& f, int l, int joint, double mirror, bool has_z) {
        const auto sym = [&](const Sym<Pair>& s) {
            return Sym<double>{s.xx[l], s.xy[l], s.xz[l], s.yy[l], s.yz[l], s.zz[l]};
        };
        Mat<double> q;
        for (int i = 0; i < 9; ++i)
            q.a[i] = f.q.a[i][l];
        from(sym(f.p), q, sym(f.schur), {f.za.x[l], f.za.y[l], f.za.z[l]}, {f.zn.x[l], f.zn.y[l], f.zn.z[l]},
             joint, mirror, has_z);
    };
    const bool has_single = middle_ > pairs_;
    if (has_single)
        from(one_.p, one_.q, one_.schur, one_.za, one_.zn, j, 1.0, true);
    else if (pairs_ > 0)
        lane(two_.back(), 0, j, 1.0, true);
    if (pairs_ > 0) lane(two_.back(), 1, j + 1, -1.0, false);

    double minors[3];
    last_.v_inverse = inverse(vv, minors);
    for (double x : minors)
        worst = smaller(worst, x);
    last_.f = times(ee, last_.v_inverse);
    last_.p = inverse(hh + symmetric_times_transposed(last_.f, ee), minors);
    for (double x : minors)
        worst = smaller(worst, x);
    const Vec<double> xa = times(last_.p, ga + times(last_.f, gn));
    store(xa, a, j, j);
    store(transposed_times(last_.f, xa) - times(last_.v_inverse, gn), n, j, j);
}

// x = z - S^-1 O x', O x' = [-B a'; Z a' + W n'].
template<class V>
void ChainSolver::substitute(int slot) {
    const int left = slot, right = m_ - 1 - slot;
    const Factor<V>& f = factor<V>(slot);
    const Vec<V> joint_c = load_vec<V>(c, left + 1, right);
    const V mirror = both<V>(1.0, -1.0);
    const Mat<V> b = joint_matrix(load_sym<V>(k, left + 1, right),
                                  Vec<V>{mirror * joint_c.x, mirror * joint_c.y, mirror * joint_c.z});
    const Vec<V> an = load_vec<V>(a, left + 1, right - 1), nn = load_vec<V>(n, left + 1, right - 1);
    const Vec<V> y = times(b, an); // -(-B a')
    Vec<V> x;
    if (plain[static_cast<std::size_t>(left) + 1] != 0) {
        const V ww = both<V>(w[static_cast<std::size_t>(left) + 1], w[static_cast<std::size_t>(right)]);
        x = {ww * nn.x, ww * nn.y, ww * nn.z};
    } else {
        Mat<V> zz = load_mat<V>(z, left + 1, right - 1);
        // The middle block leans to the left only.
        if constexpr (sizeof(V) == sizeof(Pair))
            if (right - 1 == middle_)
                for (auto& value : zz.a)
                    value[1] = 0.0;
        x = times(load_sym<V>(full_w, left + 1, right), nn) + times(zz, an);
    }
    // S^-1 [-y; x] = [P(-y + F x); F^T that - V^-1 x].
    const Vec<V> da = times(f.p, times(f.f, x) - y);
    const Vec<V> dn = transposed_times(f.f, da) - times(f.v_inverse, x);
    store(f.za - da, a, left, right);
    store(f.zn - dn, n, left, right);
}

bool ChainSolver::solve() {
    match_lanes();
    Pair worst = {1.0, 1.0};
    for (int s = 0; s < pairs_; ++s) {
        if (plain[static_cast<std::size_t>(s)] != 0)
            eliminate<Pair, true>(s, worst);
        else
            eliminate<Pair, false>(s, worst);
    }
    double least = lane_minimum(worst);
    const bool has_single = middle_ > pairs_;
    if (has_single) {
        if (plain[static_cast<std::size_t>(pairs_)] != 0)
            eliminate<double, true>(pairs_, least);
        else
            eliminate<double, false>(pairs_, least);
    }
    meet(least);
    if (has_single) substitute<double>(pairs_);
    for (int s = pairs_; s-- > 0;)
        substitute<Pair>(s);
    double sum = 0.0;
    for (const auto* x : {a, n})
        for (int i = 0; i < 3; ++i)
            sum += x[i][0] * 0.0 + x[i][static_cast<std::size_t>(m_) - 1] * 0.0;
    return least > 0.0 && sum == 0.0;
}

} // namespace calot::rod_direct
