#include "geometry/distance.hpp"
#include "geometry/triangle_scene.hpp"

namespace calot::geometry {
namespace {

// For each triangle of a leaf, of the squared distance from p a lower bound, up to the screens' tolerance: it
// is at least as far as its plane, and within the plane as the outside of each of its edges.
detail::Float8 least_distance2(const TriangleScene::FaceBlock& block, Vec3 p) {
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
    return over * over + outside * outside;
}

} // namespace

NearestPoint nearest_point(const TriangleScene& scene, Vec3 p, double reach) {
    NearestPoint best;
    if (!is_finite(p) || !(reach >= 0.0)) return best;
    double best_distance2 = reach * reach;
    std::uint32_t best_key = TriangleScene::none;
    const auto ask = [&](std::uint32_t position) {
        const TriangleScene::Triangle& t = scene.triangles()[position];
        const Vec3 point =
            closest_on_triangle(p, scene.corner(t, 0), scene.corner(t, 1), scene.corner(t, 2)).point;
        const double distance2 = norm2(p - point);
        const bool better = distance2 < best_distance2 || (distance2 == best_distance2 && t.key < best_key);
        if (!better) return false;
        best_distance2 = distance2;
        best_key = t.key;
        best.position = position;
        best.point = point;
        return true;
    };
    const bool screened = scene.has_screens();
    scene.tree().nearest(p, best_distance2, [&](std::uint32_t leaf) {
        const std::uint32_t first = scene.tree().leaf_begin(leaf), last = scene.tree().leaf_begin(leaf + 1);
        if (!screened) {
            for (std::uint32_t position = first; position < last; ++position)
                ask(position);
            return best_distance2;
        }
        // The most promising first, since each that is nearer refuses others.
        using namespace detail;
        const Float8 bound = least_distance2(scene.faces(leaf), p);
        const auto possible = [&] {
            const float reach =
                static_cast<float>(std::sqrt(best_distance2)) + 2.0f * scene.screen_tolerance();
            return mask8(bound <= splat8(reach * reach));
        };
        unsigned left = ((1u << (last - first)) - 1) & possible();
        while (left != 0) {
            auto lane = static_cast<std::uint32_t>(__builtin_ctz(left));
            for (unsigned other = left & (left - 1); other != 0; other &= other - 1)
                if (bound[__builtin_ctz(other)] < bound[lane])
                    lane = static_cast<std::uint32_t>(__builtin_ctz(other));
            left &= ~(1u << lane);
            if (ask(first + lane)) left &= possible();
        }
        return best_distance2;
    });
    if (best) best.distance = std::sqrt(best_distance2);
    return best;
}

} // namespace calot::geometry
