// Vectors and matrices of three rows, written once for one chain and for two chains side by side.
#pragma once

namespace calot::rod_direct {

/// Two doubles that go through the same operations.
using Pair = double __attribute__((vector_size(16)));

template<class V>
struct Vec {
    V x, y, z;
};

/// Symmetric: xx, xy, xz, yy, yz, zz.
template<class V>
struct Sym {
    V xx, xy, xz, yy, yz, zz;
};

/// By rows.
template<class V>
struct Mat {
    V a[9];
    V operator()(int r, int c) const { return a[3 * r + c]; }
};

template<class V>
inline Vec<V> operator+(const Vec<V>& a, const Vec<V>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template<class V>
inline Vec<V> operator-(const Vec<V>& a, const Vec<V>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template<class V>
inline Sym<V> operator-(const Sym<V>& a, const Sym<V>& b) {
    return {a.xx - b.xx, a.xy - b.xy, a.xz - b.xz, a.yy - b.yy, a.yz - b.yz, a.zz - b.zz};
}
template<class V>
inline Sym<V> operator+(const Sym<V>& a, const Sym<V>& b) {
    return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
}
template<class V>
inline Mat<V> operator+(const Mat<V>& a, const Mat<V>& b) {
    Mat<V> r;
    for (int k = 0; k < 9; ++k)
        r.a[k] = a.a[k] + b.a[k];
    return r;
}

template<class V>
inline Vec<V> times(const Sym<V>& s, const Vec<V>& v) {
    return {s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
            s.xz * v.x + s.yz * v.y + s.zz * v.z};
}
template<class V>
inline Vec<V> times(const Mat<V>& m, const Vec<V>& v) {
    return {m.a[0] * v.x + m.a[1] * v.y + m.a[2] * v.z, m.a[3] * v.x + m.a[4] * v.y + m.a[5] * v.z,
            m.a[6] * v.x + m.a[7] * v.y + m.a[8] * v.z};
}
/// Transposed m times v.
template<class V>
inline Vec<V> transposed_times(const Mat<V>& m, const Vec<V>& v) {
    return {m.a[0] * v.x + m.a[3] * v.y + m.a[6] * v.z, m.a[1] * v.x + m.a[4] * v.y + m.a[7] * v.z,
            m.a[2] * v.x + m.a[5] * v.y + m.a[8] * v.z};
}

template<class V>
inline Mat<V> times(const Sym<V>& s, const Mat<V>& m) {
    Mat<V> r;
    for (int c = 0; c < 3; ++c) {
        r.a[c] = s.xx * m.a[c] + s.xy * m.a[3 + c] + s.xz * m.a[6 + c];
        r.a[3 + c] = s.xy * m.a[c] + s.yy * m.a[3 + c] + s.yz * m.a[6 + c];
        r.a[6 + c] = s.xz * m.a[c] + s.yz * m.a[3 + c] + s.zz * m.a[6 + c];
    }
    return r;
}
template<class V>
inline Mat<V> times(const Mat<V>& m, const Sym<V>& s) {
    Mat<V> r;
    for (int k = 0; k < 9; k += 3) {
        r.a[k] = m.a[k] * s.xx + m.a[k + 1] * s.xy + m.a[k + 2] * s.xz;
        r.a[k + 1] = m.a[k] * s.xy + m.a[k + 1] * s.yy + m.a[k + 2] * s.yz;
        r.a[k + 2] = m.a[k] * s.xz + m.a[k + 1] * s.yz + m.a[k + 2] * s.zz;
    }
    return r;
}
template<class V>
inline Mat<V> transposed_times(const Mat<V>& m, const Mat<V>& b) {
    Mat<V> r;
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c)
            r.a[3 * i + c] = m.a[i] * b.a[c] + m.a[3 + i] * b.a[3 + c] + m.a[6 + i] * b.a[6 + c];
    return r;
}
/// m times the transposed of b, of which the product is known to be symmetric.
template<class V>
inline Sym<V> symmetric_times_transposed(const Mat<V>& m, const Mat<V>& b) {
    const auto e = [&](int i, int j) {
        return m.a[3 * i] * b.a[3 * j] + m.a[3 * i + 1] * b.a[3 * j + 1] + m.a[3 * i + 2] * b.a[3 * j + 2];
    };
    return {e(0, 0), e(0, 1), e(0, 2), e(1, 1), e(1, 2), e(2, 2)};
}
/// The transposed of m times b, of which the product is known to be symmetric.
template<class V>
inline Sym<V> symmetric_transposed_times(const Mat<V>& m, const Mat<V>& b) {
    const auto e = [&](int i, int j) {
        return m.a[i] * b.a[j] + m.a[3 + i] * b.a[3 + j] + m.a[6 + i] * b.a[6 + j];
    };
    return {e(0, 0), e(0, 1), e(0, 2), e(1, 1), e(1, 2), e(2, 2)};
}
/// m + the transposed of m.
template<class V>
inline Sym<V> twice_symmetric(const Mat<V>& m) {
    return {m.a[0] + m.a[0], m.a[1] + m.a[3], m.a[2] + m.a[6],
            m.a[4] + m.a[4], m.a[5] + m.a[7], m.a[8] + m.a[8]};
}

/// The inverse by cofactors; the leading minors, which are positive where s is positive definite, go to
/// `minors`.
template<class V>
inline Sym<V> inverse(const Sym<V>& s, V minors[3]) {
    const V xx = s.yy * s.zz - s.yz * s.yz, xy = s.xz * s.yz - s.xy * s.zz, xz = s.xy * s.yz - s.xz * s.yy;
    const V yy = s.xx * s.zz - s.xz * s.xz, yz = s.xy * s.xz - s.xx * s.yz, zz = s.xx * s.yy - s.xy * s.xy;
    const V determinant = s.xx * xx + s.xy * xy + s.xz * xz;
    const V r = 1.0 / determinant;
    minors[0] = s.xx, minors[1] = zz, minors[2] = determinant;
    return {xx * r, xy * r, xz * r, yy * r, yz * r, zz * r};
}

} // namespace calot::rod_direct
