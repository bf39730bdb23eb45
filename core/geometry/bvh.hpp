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
    static constexpr std::uint32_t leaf_size = 8; // as many as there are lanes: leaves are tested at one go
    // Deepest path (binary levels) times the siblings left waiting at each level.
    static constexpr int stack_size = 96 * (width - 1) + 1;

    struct alignas(64) Node {
        float lo[3][width];
        float hi[3][width];
        std::uint32_t child[width]; // a node, or a leaf
        bool leaf[width];           // an empty slot is neither: child 0, inverted box
    };

    // Builds the tree over `boxes` (finite). Deterministic: binned surface-area heuristic, ties by index.
    // Allocates; O(n log n); any thread.
    void build(std::span<const Box> boxes);

    // Recomputes all boxes bottom up, topology unchanged: leaf_box(leaf) -> Box. No allocation.
    template<class LeafBox>
    void refit(LeafBox&& leaf_box);

    // order()[position] = index of the box given to build; leaf l covers positions leaf_begin(l) to
    // leaf_begin(l + 1).
    std::span<const std::uint32_t> order() const { return order_; }
    std::uint32_t leaf_count() const { return static_cast<std::uint32_t>(leaf_begins_.size()) - 1; }
    std::uint32_t leaf_begin(std::uint32_t leaf) const { return leaf_begins_[leaf]; }
    std::span<const Node> nodes() const { return nodes_; }
    bool empty() const { return order_.empty(); }

    // Calls visit(leaf) for every leaf whose box overlaps `query`.
    template<class Visit>
    void overlapping(const Box& query, Visit&& visit) const;

    // The same for a capsule: leaves whose box overlaps that of segment a-b grown by `radius`, and comes as
    // near to its middle as any point of the capsule does. Calls visit(leaf, near_a): near_a is false when
    // the leaf's box is farther than `radius` from a.
    template<class Visit>
    void around_segment(Vec3 a, Vec3 b, double radius, Visit&& visit) const;

    // Calls visit(leaf) -> double for leaves that may be nearer to p than the squared distance `limit2`,
    // nearest boxes first; visit returns the new limit. Leaves at exactly the limit are visited too.
    template<class Visit>
    void nearest(Vec3 p, double limit2, Visit&& visit) const;

  private:
    static void set_box(Node& node, int slot, const Box& box) {
        for (int k = 0; k < 3; ++k) {
            node.lo[k][slot] = box.lo[k];
            node.hi[k][slot] = box.hi[k];
        }
    }
    static Box box_of_children(const Node& node);
    template<class Pass, class Visit>
    void walk(Pass&& pass, Visit&& visit) const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;
    std::vector<std::uint32_t> leaf_begins_{0};
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

// Walks the tree through the slots for which pass(node) sets the lane.
template<class Pass, class Visit>
void Bvh::walk(Pass&& pass, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::uint32_t stack[stack_size];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const Node& node = nodes_[stack[--top]];
        for (unsigned mask = detail::mask8(pass(node)); mask != 0; mask &= mask - 1) {
            const int i = __builtin_ctz(mask);
            if (node.leaf[i])
                visit(node.child[i]);
            else if (node.child[i] != 0) // an empty slot overlaps an infinite query only
                stack[top++] = node.child[i];
        }
    }
}

namespace detail {

struct BoxLanes {
    Float8 lo[3], hi[3];

    explicit BoxLanes(const Box& box) {
        for (int k = 0; k < 3; ++k) {
            lo[k] = splat8(box.lo[k]);
            hi[k] = splat8(box.hi[k]);
        }
    }
    Int8 overlap(const Bvh::Node& node) const {
        return (load8(node.lo[0]) <= hi[0]) & (load8(node.hi[0]) >= lo[0]) & (load8(node.lo[1]) <= hi[1]) &
               (load8(node.hi[1]) >= lo[1]) & (load8(node.lo[2]) <= hi[2]) & (load8(node.hi[2]) >= lo[2]);
    }
    // Square of the distance to the slots' boxes, never too long by rounding.
    Float8 distance2(const Bvh::Node& node) const {
        const Float8 zero = splat8(0.0f);
        Float8 sum = zero;
        for (int k = 0; k < 3; ++k) {
            const Float8 below = load8(node.lo[k]) - hi[k], above = lo[k] - load8(node.hi[k]);
            Float8 outside = below > above ? below : above;
            outside = outside > zero ? outside : zero;
            sum += outside * outside;
        }
        return sum * splat8(1.0f - 0x1p-20f);
    }
};

} // namespace detail

template<class Visit>
void Bvh::overlapping(const Box& query, Visit&& visit) const {
    const detail::BoxLanes lanes(query);
    walk([&](const Node& node) { return lanes.overlap(node); }, visit);
}

template<class Visit>
void Bvh::around_segment(Vec3 a, Vec3 b, double radius, Visit&& visit) const {
    using namespace detail;
    if (nodes_.empty()) return;
    const BoxLanes lanes(box_of(a, b, radius));
    const Vec3 middle = 0.5 * (a + b);
    const BoxLanes centre(box_of(middle, middle, 0.0)), start(box_of(a, a, 0.0)); // tiny: rounded outwards
    const double farthest = 0.5 * norm(b - a) + radius;
    const Float8 limit = splat8(rounded_up(farthest * farthest)), near = splat8(rounded_up(radius * radius));
    std::uint32_t stack[stack_size];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const Node& node = nodes_[stack[--top]];
        unsigned mask = mask8(lanes.overlap(node) & (centre.distance2(node) <= limit));
        if (mask == 0) continue;
        const unsigned near_a = mask8(start.distance2(node) <= near);
        for (; mask != 0; mask &= mask - 1) {
            const int i = __builtin_ctz(mask);
            if (node.leaf[i])
                visit(node.child[i], (near_a >> i & 1) != 0);
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
        std::uint32_t child;
        bool leaf;
    };
    Entry stack[stack_size];
    int top = 0;
    stack[top++] = {0.0f, 0, false};
    const BoxLanes point(box_of(p, p, 0.0)); // a tiny box: rounded outwards
    while (top > 0) {
        const Entry entry = stack[--top];
        if (static_cast<double>(entry.distance2) > limit2) continue;
        if (entry.leaf) {
            limit2 = visit(entry.child);
            continue;
        }
        const Node& node = nodes_[entry.child];
        const Float8 distance2 = point.distance2(node);
        // Beyond the largest float nothing is out of reach; empty slots are at infinity and never pass.
        const double reach = limit2 < 1e38 ? limit2 : 1e38;
        unsigned mask = mask8(distance2 <= splat8(rounded_up(reach)));
        // Insertion keeps the nearest child on top of the stack.
        const int base = top;
        for (; mask != 0; mask &= mask - 1) {
            const int i = __builtin_ctz(mask);
            const Entry child{distance2[i], node.child[i], node.leaf[i]};
            int at = top++;
            for (; at > base && stack[at - 1].distance2 < child.distance2; --at)
                stack[at] = stack[at - 1];
            stack[at] = child;
        }
    }
}

template<class LeafBox>
void Bvh::refit(LeafBox&& leaf_box) {
    // Children always follow their parent in the array: backwards is bottom up.
    for (std::size_t n = nodes_.size(); n-- > 0;) {
        Node& node = nodes_[n];
        for (int i = 0; i < width; ++i) {
            if (node.leaf[i])
                set_box(node, i, leaf_box(node.child[i]));
            else if (node.child[i] != 0)
                set_box(node, i, box_of_children(nodes_[node.child[i]]));
        }
    }
}

} // namespace calot::geometry
