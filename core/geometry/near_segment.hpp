// Quick refusals of edges and vertices that no point near a segment can touch from outside.
#pragma once

#include "geometry/triangle_scene.hpp"

#include <algorithm>

namespace calot::geometry::detail {

inline Float8 dot3(const Float8 (&a)[3], const Float8 (&b)[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Float8 least(Float8 a, Float8 b) {
    return a < b ? a : b;
}
inline Float8 most(Float8 a, Float8 b) {
    return a > b ? a : b;
}
inline void load(Float8 (&to)[3], const float (&from)[3][8]) {
    for (int k = 0; k < 3; ++k)
        to[k] = load8(from[k]);
}

// As high as a point is over the plane's normal, nought for a plane that is not known.
inline double height_over(const TriangleScene::LeafPlane& plane, Vec3 p) {
    return plane.normal[0] * p.x + plane.normal[1] * p.y + plane.normal[2] * p.z;
}

// A segment with a margin, before blocks of edges.
struct NearSegment {
    Float8 start[3], along[3], inverse_length2, reach, slack;

    NearSegment(Vec3 p0, Vec3 p1, double reach_, float slack_) {
        const Vec3 u = p1 - p0;
        for (int k = 0; k < 3; ++k) {
            start[k] = splat8(static_cast<float>(p0[k]));
            along[k] = splat8(static_cast<float>(u[k]));
        }
        const double uu = norm2(u);
        inverse_length2 = splat8(uu > 0.0 ? static_cast<float>(1.0 / uu) : 0.0f);
        reach = splat8(static_cast<float>(reach_));
        slack = splat8(slack_);
    }

    // Lanes whose edge may touch some point within `slack` of the segment's.
    unsigned touching(const TriangleScene::EdgeBlock& block) const {
        const Float8 zero = splat8(0.0f), one = splat8(1.0f), half = splat8(0.5f);
        Float8 e[3], m0[3], m1[3], d[3];
        load(d, block.start), load(e, block.along);
        for (int k = 0; k < 3; ++k)
            d[k] = start[k] - d[k];
        const Float8 length = load8(block.length), tilt = load8(block.tilt);
        // The middle of the edge against the segment: most blocks are far away as a whole.
        const Float8 middle = half * length;
        Float8 m[3];
        for (int k = 0; k < 3; ++k)
            m[k] = d[k] - middle * e[k];
        const Float8 t = least(one, most(zero, -dot3(m, along) * inverse_length2));
        for (int k = 0; k < 3; ++k)
            m[k] += t * along[k];
        const Float8 limit = reach + slack + middle;
        Int8 pass = dot3(m, m) <= limit * limit;
        if (mask8(pass) == 0) return 0;
        const Float8 s0 = dot3(e, d), s1 = s0 + dot3(e, along);
        pass &= (most(s0, s1) >= -slack) & (least(s0, s1) <= length + slack);
        load(m0, block.inward0), load(m1, block.inward1);
        const Float8 lean = slack + most(tilt, -tilt) * (reach + slack);
        const Float8 over0 = dot3(m0, d), over1 = dot3(m1, d);
        pass &=
            (least(over0, over0 + dot3(m0, along)) <= lean) & (least(over1, over1 + dot3(m1, along)) <= lean);
        if (mask8(pass) == 0) return 0;
        // Of a blunt edge both faces must be seen from the front.
        const Float8 normal[3] = {e[1] * m0[2] - e[2] * m0[1], e[2] * m0[0] - e[0] * m0[2],
                                  e[0] * m0[1] - e[1] * m0[0]};
        const Float8 height = dot3(normal, d);
        pass &= (tilt <= zero) | (most(height, height + dot3(normal, along)) >= -slack);
        return mask8(pass);
    }

    // The same of a vertex.
    bool touches(const TriangleScene::SalientVertex& vertex) const {
        const Float8 zero = splat8(0.0f), one = splat8(1.0f);
        Float8 d[3], m[3], away[3];
        for (int k = 0; k < 3; ++k)
            d[k] = start[k] - splat8(vertex.place[k]);
        const Float8 t = least(one, most(zero, -dot3(d, along) * inverse_length2));
        for (int k = 0; k < 3; ++k)
            m[k] = d[k] + t * along[k];
        const Float8 limit = reach + slack;
        load(away, vertex.away);
        const Float8 over = dot3(away, d);
        const Int8 pass = (dot3(m, m) <= limit * limit) & (least(over, over + dot3(away, along)) <= slack);
        return mask8(pass) == 0xff;
    }
};

// May some point within `slack` of the segment's touch a vertex, of a surface without screens?
inline bool vertex_may_touch(const TriangleScene& scene, std::uint32_t vertex, Vec3 p0, Vec3 p1, double reach,
                             double slack) {
    const Vec3 v = scene.vertices()[vertex], u = p1 - p0;
    const double uu = norm2(u);
    const double t = uu > 0.0 ? std::clamp(dot(v - p0, u) / uu, 0.0, 1.0) : 0.0;
    if (norm2(p0 + t * u - v) > (reach + slack) * (reach + slack)) return false;
    for (const std::uint32_t position : scene.around(vertex))
        for (const std::uint32_t other : scene.triangles()[position].vertex) {
            const Vec3 w = scene.vertices()[other] - v;
            const double along = std::min(dot(p0 - v, w), dot(p1 - v, w));
            if (along > 0.0 && along * along > slack * slack * norm2(w)) return false;
        }
    return true;
}

} // namespace calot::geometry::detail
