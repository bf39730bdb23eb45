// Bounding volume hierarchy over boxes: eight children a node, float boxes rounded outwards, flat array.
// The tree only proposes; whoever walks it decides in double precision, so no result depends on its shape.
#pragma once

#include "geometry/vec3.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace calot::geometry {

// Axis-aligned box in single precision; every operation that makes one from doubles rounds outwards.
struct Box {
    std::array<float, 3> lo{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::infinity()};
    std::array<float, 3> hi{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()};

    void merge(const Box& other) {
        for (int k = 0; k < 3; ++k) {
            lo[k] = other.lo[k] < lo[k] ? other.lo[k] : lo[k];
            hi[k] = other.hi[k] > hi[k] ? other.hi[k] : hi[k];
        }
    }
};

// Largest float not above, smallest float not below, up to one unit in the last place of slack: conversion
// errs by at most 2^-24 of the magnitude, so 2^-22 of it always covers that.
inline float rounded_down(double v) {
    const float f = static_cast<float>(v);
    return f - (std::fabs(f) * 0x1p-22f + std::numeric_limits<float>::min());
}
inline float rounded_up(double v) {
    const float f = static_cast<float>(v);
    return f + (std::fabs(f) * 0x1p-22f + std::numeric_limits<float>::min());
}

inline Box box_of(Vec3 a, Vec3 b, double grow) {
    Box box;
    for (int k = 0; k < 3; ++k) {
        box.lo[k] = rounded_down((a[k] < b[k] ? a[k] : b[k]) - grow);
        box.hi[k] = rounded_up((a[k] > b[k] ? a[k] : b[k]) + grow);
    }
    return box;
}

class Bvh {
  public:
    static constexpr int width = 8;
    static constexpr std::uint32_t leaf_size = 4;
    // Deepest path (binary levels) times the siblings left waiting at each level.
    static constexpr int stack_size = 96 * (width - 1) + 1;

    struct alignas(64) Node {
        float lo[3][width];
        float hi[3][width];
        std::uint32_t child[width]; // inner: node; leaf: first position in order()
        std::uint32_t count[width]; // 0: inner or empty (an empty slot has an inverted box)
    };

    // Builds the tree over `boxes` (finite). Deterministic: binned surface-area heuristic, ties by index.
    // Allocates; O(n log n); any thread.
    void build(std::span<const Box> boxes);

    // Recomputes all boxes bottom up from `boxes`, given by position in order() (not by the index they had in
    // build), topology unchanged. No allocation.
    void refit(std::span<const Box> boxes_in_order);

    // order()[position] = index of the box given to build; leaves cover consecutive positions.
    std::span<const std::uint32_t> order() const { return order_; }
    std::span<const Node> nodes() const { return nodes_; }
    bool empty() const { return order_.empty(); }

    // Calls visit(first, last) for every leaf whose box overlaps `query`: positions [first, last) in order().
    template<class Visit>
    void overlapping(const Box& query, Visit&& visit) const;

    // Calls visit(first, last) -> double for leaves that may be nearer to p than the squared distance
    // `limit2`, nearest boxes first; visit returns the new limit. Leaves at exactly the limit are visited
    // too.
    template<class Visit>
    void nearest(Vec3 p, double limit2, Visit&& visit) const;

  private:
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;
};

namespace detail {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));

inline Float8 load8(const float* p) {
    return *reinterpret_cast<const Float8*>(p);
}
inline Float8 splat8(float v) {
    return Float8{v, v, v, v, v, v, v, v};
}
inline unsigned mask8(Int8 lanes) {
#if defined(__AVX__)
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(lanes)));
#else
    unsigned mask = 0;
    for (int i = 0; i < 8; ++i)
        mask |= lanes[i] ? 1u << i : 0u;
    return mask;
#endif
}

} // namespace detail

template<class Visit>
void Bvh::overlapping(const Box& query, Visit&& visit) const {
    using namespace detail;
    if (nodes_.empty()) return;
    std::uint32_t stack[stack_size];
    int top = 0;
    stack[top++] = 0;
    Float8 lo[3], hi[3];
    for (int k = 0; k < 3; ++k) {
        lo[k] = splat8(query.lo[k]);
        hi[k] = splat8(query.hi[k]);
    }
    while (top > 0) {
        const Node& node = nodes_[stack[--top]];
        const Int8 hit = (load8(node.lo[0]) <= hi[0]) & (load8(node.hi[0]) >= lo[0]) &
                         (load8(node.lo[1]) <= hi[1]) & (load8(node.hi[1]) >= lo[1]) &
                         (load8(node.lo[2]) <= hi[2]) & (load8(node.hi[2]) >= lo[2]);
        for (unsigned mask = mask8(hit); mask != 0; mask &= mask - 1) {
            const int i = __builtin_ctz(mask);
            if (node.count[i] != 0)
                visit(node.child[i], node.child[i] + node.count[i]);
            else if (node.child[i] != 0) // an empty slot overlaps an infinite query only
                stack[top++] = node.child[i];
        }
    }
}

template<class Visit>
void Bvh::nearest(Vec3 p, double limit2, Visit&& visit) const {
    using namespace detail;
    if (nodes_.empty()) return;
    struct Entry {
        float distance2;
        std::uint32_t child, count;
    };
    Entry stack[stack_size];
    int top = 0;
    stack[top++] = {0.0f, 0, 0};
    // The point as a tiny box, so that its rounding to float cannot make a distance too long.
    Float8 lo[3], hi[3];
    for (int k = 0; k < 3; ++k) {
        lo[k] = splat8(rounded_down(p[k]));
        hi[k] = splat8(rounded_up(p[k]));
    }
    const Float8 zero = splat8(0.0f);
    while (top > 0) {
        const Entry entry = stack[--top];
        if (static_cast<double>(entry.distance2) > limit2) continue;
        if (entry.count != 0) {
            limit2 = visit(entry.child, entry.child + entry.count);
            continue;
        }
        const Node& node = nodes_[entry.child];
        Float8 distance2 = zero;
        for (int k = 0; k < 3; ++k) {
            const Float8 below = load8(node.lo[k]) - hi[k];
            const Float8 above = lo[k] - load8(node.hi[k]);
            Float8 outside = below > above ? below : above;
            outside = outside > zero ? outside : zero;
            distance2 += outside * outside;
        }
        distance2 *= splat8(1.0f - 0x1p-20f);
        // Beyond the largest float nothing is out of reach; empty slots are at infinity and never pass.
        const double reach = limit2 < 1e38 ? limit2 : 1e38;
        unsigned mask = mask8(distance2 <= splat8(rounded_up(reach)));
        // Insertion keeps the nearest child on top of the stack.
        const int base = top;
        for (; mask != 0; mask &= mask - 1) {
            const int i = __builtin_ctz(mask);
            const Entry child{distance2[i], node.child[i], node.count[i]};
            int at = top++;
            for (; at > base && stack[at - 1].distance2 < child.distance2; --at)
                stack[at] = stack[at - 1];
            stack[at] = child;
        }
    }
}

} // namespace calot::geometry
