#include "geometry/distance.hpp"
#include "geometry/triangle_scene.hpp"

namespace calot::geometry {
namespace {

// Lanes of a leaf whose triangles may be as near to p as `distance`: a triangle is at least as far as its
// plane, and within the plane as the outside of each of its edges.
unsigned near_lanes(const TriangleScene::FaceBlock& block, Vec3 p, double distance, float tolerance) {
    using namespace detail;
    const Float8 x = splat8(static_cast<float>(p.x)), y = splat8(static_cast<float>(p.y)),
                 z = splat8(static_cast<float>(p.z));
    const auto height = [&](const float(&n)[3][8], const float(&offset)[8]) {
        return load8(n[0]) * x + load8(n[1]) * y + load8(n[2]) * z - load8(offset);
    };
    const Float8 over = height(block.normal, block.offset);
    Float8 outside = splat8(0.0f);
    for (int k = 0; k < 3; ++k) {
        const Float8 beyond = -height(block.inward[k], block.inward_offset[k]);
        outside = outside > beyond ? outside : beyond;
    }
    const float reach = static_cast<float>(distance) + 2.0f * tolerance;
    return mask8(over * over + outside * outside <= splat8(reach * reach));
}

} // namespace

NearestPoint nearest_point(const TriangleScene& scene, Vec3 p, double reach) {
    NearestPoint best;
    if (!is_finite(p) || !(reach >= 0.0)) return best;
    double best_distance2 = reach * reach;
    std::uint32_t best_key = TriangleScene::none;
    const bool screened = scene.has_screens();
    scene.tree().nearest(p, best_distance2, [&](std::uint32_t leaf) {
        const std::uint32_t first = scene.tree().leaf_begin(leaf);
        unsigned lanes = (1u << (scene.tree().leaf_begin(leaf + 1) - first)) - 1;
        if (screened)
            lanes &= near_lanes(scene.faces(leaf), p, std::sqrt(best_distance2), scene.screen_tolerance());
        for (; lanes != 0; lanes &= lanes - 1) {
            const std::uint32_t position = first + static_cast<std::uint32_t>(__builtin_ctz(lanes));
            const TriangleScene::Triangle& t = scene.triangles()[position];
            const Vec3 point =
                closest_on_triangle(p, scene.corner(t, 0), scene.corner(t, 1), scene.corner(t, 2)).point;
            const double distance2 = norm2(p - point);
            if (distance2 < best_distance2 || (distance2 == best_distance2 && t.key < best_key)) {
                best_distance2 = distance2;
                best_key = t.key;
                best.position = position;
                best.point = point;
            }
        }
        return best_distance2;
    });
    if (best) best.distance = std::sqrt(best_distance2);
    return best;
}

} // namespace calot::geometry
