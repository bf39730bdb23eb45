// Tri-diagonal systems, eliminated from both ends towards the middle: two chains of dependent operations that
// run beside each other, half as long as the one from the first row.
#pragma once

namespace calot::rod_cosserat::two_ended {

/// Of a symmetric positive definite matrix, in place: 1 / D for the diagonal, and for `off` (m-1 values,
/// off[j] between rows j and j+1) what a row adds of its neighbour.
inline void factor(int m, double* diagonal, double* off) {
    const int middle = m / 2;
    for (int j = 0; j < middle; ++j) {
        diagonal[j] = 1.0 / diagonal[j];
        const double l = off[j] * diagonal[j];
        diagonal[j + 1] -= l * off[j];
        off[j] = l;
    }
    for (int j = m - 1; j > middle; --j) {
        diagonal[j] = 1.0 / diagonal[j];
        const double l = off[j - 1] * diagonal[j];
        diagonal[j - 1] -= l * off[j - 1];
        off[j - 1] = l;
    }
    diagonal[middle] = 1.0 / diagonal[middle];
}

/// Solves with that; the solution replaces `right`.
inline void solve(int m, const double* inverse, const double* off, double* right) {
    const int middle = m / 2, last = m - 1, pairs = last - middle; // the lower half has one more if m is even
    double low = right[0], high = right[last];
    for (int k = 0; k < pairs - 1; ++k) {
        low = right[k + 1] - off[k] * low;
        high = right[last - k - 1] - off[last - k - 1] * high;
        right[k + 1] = low, right[last - k - 1] = high;
    }
    for (int j = pairs > 0 ? pairs - 1 : 0; j < middle - 1; ++j)
        low = right[j + 1] - off[j] * low, right[j + 1] = low;
    double centre = right[middle];
    if (middle > 0) centre -= off[middle - 1] * right[middle - 1];
    if (middle < last) centre -= off[middle] * right[middle + 1];
    low = high = right[middle] = centre * inverse[middle];
    for (int k = 1; k <= pairs; ++k) {
        const int i = middle - k, j = middle + k;
        low = right[i] * inverse[i] - off[i] * low;
        high = right[j] * inverse[j] - off[j - 1] * high;
        right[i] = low, right[j] = high;
    }
    for (int i = middle - pairs - 1; i >= 0; --i)
        low = right[i] * inverse[i] - off[i] * low, right[i] = low;
}

/// Any matrix whose pivots stay above a hundredth of its diagonal, without exchanging rows. Row j: lower[j]
/// x[j-1] + diagonal[j] x[j] + upper[j] x[j+1] = right[j]. `inverse`: m values of room. False: a pivot is
/// smaller, x is of no use.
inline bool solve(int m, const double* lower, const double* diagonal, const double* upper,
                  const double* right, double* inverse, double* x) {
    constexpr double smallest = 0.01;
    const int middle = m / 2, last = m - 1, pairs = last - middle;
    double low = diagonal[0], high = diagonal[last], low_right = right[0], high_right = right[last];
    bool is_safe = true;
    const auto from_low = [&](int i) {
        is_safe &= low >= smallest * diagonal[i];
        const double in = 1.0 / low;
        inverse[i] = in, x[i] = low_right;
        low = diagonal[i + 1] - lower[i + 1] * upper[i] * in;
        low_right = right[i + 1] - lower[i + 1] * in * low_right;
    };
    const auto from_high = [&](int j) {
        is_safe &= high >= smallest * diagonal[j];
        const double in = 1.0 / high;
        inverse[j] = in, x[j] = high_right;
        high = diagonal[j - 1] - upper[j - 1] * lower[j] * in;
        high_right = right[j - 1] - upper[j - 1] * in * high_right;
    };
    for (int k = 0; k < pairs; ++k)
        from_low(k), from_high(last - k);
    for (int i = pairs; i < middle; ++i)
        from_low(i);
    const double centre = low + high - diagonal[middle];
    if (!is_safe || centre == 0.0) return false;
    low = high = x[middle] = (low_right + high_right - right[middle]) / centre;
    for (int k = 1; k <= pairs; ++k) {
        const int i = middle - k, j = middle + k;
        low = x[i] * inverse[i] - upper[i] * inverse[i] * low;
        high = x[j] * inverse[j] - lower[j] * inverse[j] * high;
        x[i] = low, x[j] = high;
    }
    for (int i = middle - pairs - 1; i >= 0; --i)
        low = x[i] * inverse[i] - upper[i] * inverse[i] * low, x[i] = low;
    return true;
}

} // namespace calot::rod_cosserat::two_ended
