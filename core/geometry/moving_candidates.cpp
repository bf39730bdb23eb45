// Candidates on a surface that moves. A list of triangles within reach lasts as long as neither chain nor
// surface has moved by the slack; how each of them lies is looked up for each content of the scene, eight at
// a time, in single precision relative to the first end.
#include "geometry/candidates.hpp"
#include "geometry/near_segment.hpp"
#include "geometry/surface_minima.hpp"

#include <algorithm>
#include <cmath>

namespace calot::geometry {
namespace {

using detail::Float8;
using detail::Int8;
using detail::most;

struct Points8 {
    Float8 x, y, z;
};

// Filled lane by lane; lanes that are not set repeat the first.
struct alignas(32) PointLanes {
    float x[8], y[8], z[8];

    void set(std::uint32_t lane, Vec3 v) {
        x[lane] = static_cast<float>(v.x);
        y[lane] = static_cast<float>(v.y);
        z[lane] = static_cast<float>(v.z);
    }
    void repeat(std::uint32_t used) {
        for (std::uint32_t lane = used; lane < 8; ++lane)
            x[lane] = x[0], y[lane] = y[0], z[lane] = z[0];
    }
    Points8 load() const { return {detail::load8(x), detail::load8(y), detail::load8(z)}; }
};

Points8 operator-(Points8 a, Points8 b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Points8 operator*(Float8 s, Points8 a) {
    return {s * a.x, s * a.y, s * a.z};
}
Float8 dot(Points8 a, Points8 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
Points8 cross(Points8 a, Points8 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Float8 root(Float8 v) {
#if defined(__AVX__)
    return reinterpret_cast<Float8>(_mm256_sqrt_ps(reinterpret_cast<__m256>(v)));
#else
    for (int i = 0; i < 8; ++i)
        v[i] = std::sqrt(v[i]);
    return v;
#endif
}
void store(float (&to)[8], Float8 v) {
    *reinterpret_cast<Float8*>(to) = v;
}
void store(float (&to)[3][8], Points8 v) {
    store(to[0], v.x), store(to[1], v.y), store(to[2], v.z);
}

// Length one, or nothing where v is shorter than `least`.
Points8 unit_or_none(Points8 v, Float8 least) {
    const Float8 length = root(dot(v, v)), zero = detail::splat8(0.0f);
    return (length > least ? detail::splat8(1.0f) / length : zero) * v;
}

} // namespace

bool Candidates::hold_moving(const TriangleScene& scene, Vec3 p0, Vec3 p1, double reach) const {
    const double left = slack_ - (scene.moved() - moved_);
    return surface_ == scene.surface() && reach <= reach_ && left >= 0.0 && norm2(p0 - q0_) <= left * left &&
           norm2(p1 - q1_) <= left * left;
}

void Candidates::gather_moving(const TriangleScene& scene, Vec3 q0, Vec3 q1, double reach, double slack) {
    surface_ = scene.surface();
    moved_ = scene.moved();
    version_ = 0; // no screens yet
    span_ = 0;
    q0_ = q0;
    q1_ = q1;
    reach_ = reach;
    slack_ = slack;
    near_count_ = 0;
    near_complete_ = true;
    const double limit = reach + slack + 1e-6;
    const Vec3 u = q1 - q0;
    const double uu = norm2(u), inverse = uu > 0.0 ? 1.0 / uu : 0.0;
    scene.tree().around_segment(q0, q1, limit, [&](std::uint32_t leaf, bool) {
        for (std::uint32_t i = scene.tree().leaf_begin(leaf); i < scene.tree().leaf_begin(leaf + 1); ++i) {
            const TriangleScene::Triangle& t = scene.triangles()[i];
            // Its bounding sphere about the middle against the segment.
            const Vec3 a = scene.corner(t, 0), b = scene.corner(t, 1), c = scene.corner(t, 2);
            const Vec3 middle = (1.0 / 3.0) * (a + b + c), from = middle - q0;
            const double s = std::clamp(dot(from, u) * inverse, 0.0, 1.0);
            const double around = std::max({norm2(a - middle), norm2(b - middle), norm2(c - middle)});
            const double far = limit + std::sqrt(around);
            if (norm2(from - s * u) > far * far) continue;
            if (near_count_ == near_.size()) {
                near_complete_ = false;
                return;
            }
            near_[near_count_++] = i;
            span_ = std::max(span_, norm(from) + std::sqrt(around));
        }
    });
}

void Candidates::make_screens(const TriangleScene& scene) {
    version_ = scene.version();
    // Places relative to q0 err by 2^-24 of the span at most. A triangle's plane, and where its edges lead,
    // then err at 15 mm by less than the tolerance if it is higher than least_height_.
    tolerance_ = static_cast<float>(3e-6 + 3e-6 * (span_ + slack_));
    least_height_ = static_cast<float>(2e-5 + 2e-3 * (span_ + slack_));
    complete_ = near_complete_;
    face_count_ = edge_count_ = vertex_count_ = 0;
    if (!complete_) return;
    screen_faces(scene);
    screen_edges(scene);
    for (std::uint32_t n = 0; n < near_count_; ++n) {
        const TriangleScene::Triangle& t = scene.triangles()[near_[n]];
        for (int k = 0; k < 3; ++k)
            if ((t.owns >> (3 + k) & 1) &&
                detail::vertex_may_touch(scene, t.vertex[k], q0_, q1_, reach_, slack_ + 1e-6))
                add_vertex(t.vertex[k]);
    }
}

void Candidates::screen_faces(const TriangleScene& scene) {
    PointLanes corner[3];
    for (std::uint32_t first = 0; first < near_count_; first += 8) {
        FaceLanes& to = blocks_[face_count_ / 8].faces;
        const std::uint32_t used = std::min(near_count_ - first, 8u);
        for (std::uint32_t lane = 0; lane < used; ++lane) {
            to.position[lane] = near_[first + lane];
            const TriangleScene::Triangle& t = scene.triangles()[near_[first + lane]];
            for (int k = 0; k < 3; ++k)
                corner[k].set(lane, scene.corner(t, k) - q0_);
        }
        Points8 p[3], e[3];
        for (int k = 0; k < 3; ++k) {
            corner[k].repeat(used);
            p[k] = corner[k].load();
        }
        for (int k = 0; k < 3; ++k)
            e[k] = p[(k + 1) % 3] - p[k];
        const Float8 longest = root(most(dot(e[0], e[0]), most(dot(e[1], e[1]), dot(e[2], e[2]))));
        const Points8 n = unit_or_none(cross(e[0], e[1]), detail::splat8(least_height_) * longest);
        store(to.planes.normal, n);
        store(to.planes.offset, dot(n, p[0]));
        for (int k = 0; k < 3; ++k) {
            const Points8 inward = unit_or_none(cross(n, e[k]), detail::splat8(0.0f));
            store(to.planes.inward[k], inward);
            store(to.planes.inward_offset[k], dot(inward, p[k]));
        }
        const auto margin = static_cast<float>(slack_) + tolerance_;
        if (detail::lanes_below(to.planes, {}, static_cast<float>(reach_), margin) != 0) face_count_ += used;
    }
}

void Candidates::screen_edges(const TriangleScene& scene) {
    // Ends, and the third corner of the one or two faces; turned as the first face has it.
    PointLanes end[2], opposite[2];
    alignas(32) std::int32_t is_border[8];
    std::uint32_t used = 0;
    const detail::NearSegment segment({}, q1_ - q0_, reach_, static_cast<float>(slack_) + tolerance_);
    const auto flush = [&] {
        if (used == 0) return;
        EdgeBlock& to = blocks_[edge_count_ / 8].edges;
        for (PointLanes* lanes : {&end[0], &end[1], &opposite[0], &opposite[1]})
            lanes->repeat(used);
        std::fill(is_border + used, is_border + 8, 0);
        const Float8 zero = detail::splat8(0.0f), least = detail::splat8(least_height_);
        const Points8 start = end[0].load(), way = end[1].load() - start;
        const Float8 length = root(dot(way, way));
        if (detail::mask8(length <= least) != 0) complete_ = false; // in no direction that could be told
        const Points8 along = (detail::splat8(1.0f) / length) * way;
        const auto across = [&](Points8 w) { return w - dot(w, along) * along; };
        const Points8 to0 = opposite[0].load() - start, to1 = opposite[1].load() - start;
        const Points8 inward0 = unit_or_none(across(to0), least), inward1 = unit_or_none(across(to1), least);
        // Towards a face that is hardly there nothing is refused, and what it makes of the edge is uncertain.
        const Points8 n0 = cross(along, inward0), n1 = cross(inward1, along);
        const Float8 dip = -dot(n0, inward1);
        const Int8 uncertain = (dot(inward0, inward0) <= zero) | (dot(inward1, inward1) <= zero) |
                               *reinterpret_cast<const Int8*>(is_border);
        const Int8 convex = uncertain | (dip > detail::splat8(-1e-3f));
        // As TriangleScene::EdgeBlock::tilt says; a little is added.
        const Float8 rim = detail::splat8(static_cast<float>(1.02 * detail::rim_tilt));
        const Int8 turns_back = uncertain | (dot(n0, n1) <= detail::splat8(0.01f));
        const Float8 blunt = dip > detail::splat8(static_cast<float>(0.95 * detail::rim_sharpness))
                                 ? rim
                                 : detail::splat8(1e-6f);
        store(to.start, start), store(to.along, along);
        store(to.inward0, inward0), store(to.inward1, inward1);
        // What is not convex passes nothing.
        store(to.length, convex ? length : detail::splat8(-1.0f));
        store(to.tilt, turns_back ? -rim : blunt);
        if (segment.touching(to) != 0) {
            store(to.tilt, turns_back ? rim : blunt);
            edge_count_ += used;
        }
        used = 0;
    };
    for (std::uint32_t n = 0; n < near_count_; ++n) {
        const TriangleScene::Triangle& t = scene.triangles()[near_[n]];
        for (int k = 0; k < 3; ++k) {
            if (!(t.owns >> k & 1)) continue;
            if (edge_count_ + used == most_edges) {
                complete_ = false;
                return;
            }
            const TriangleScene::Edge& edge = scene.edges()[t.edge[k]];
            const bool has_two = edge.triangle[1] != TriangleScene::none;
            end[0].set(used, scene.vertices()[t.vertex[k]] - q0_);
            end[1].set(used, scene.vertices()[t.vertex[(k + 1) % 3]] - q0_);
            opposite[0].set(used, scene.vertices()[t.vertex[(k + 2) % 3]] - q0_);
            // Of a border's missing face: no direction across.
            opposite[1].set(used, scene.vertices()[has_two ? edge.opposite[1] : t.vertex[k]] - q0_);
            is_border[used] = has_two ? 0 : -1;
            blocks_[edge_count_ / 8].edges.edge[used] = t.edge[k];
            if (++used == 8) flush();
        }
    }
    flush();
}

} // namespace calot::geometry
