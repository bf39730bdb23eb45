#include "geometry/triangle_scene.hpp"

#include <algorithm>

namespace calot::geometry {
namespace {

int sign(double v) {
    return v > 0.0 ? 1 : v < 0.0 ? -1 : 0;
}

// Sign of the turn from a to b about p, all in the plane, p the origin: exact, and never zero for a != b. p
// counts as moved by (e, e^2) for a vanishing e (simulation of simplicity, Edelsbrunner and Muecke 1990), so
// that a ray through an edge or a corner crosses exactly one of the triangles that meet there.
int turn(double ax, double ay, double bx, double by) {
    const double left = ax * by, right = ay * bx;
    if (left != right) return left > right ? 1 : -1; // rounding keeps the order of products
    const double residue = std::fma(ax, by, -left) - std::fma(ay, bx, -right);
    if (residue != 0.0) return sign(residue);
    return ay != by ? sign(ay - by) : sign(bx - ax);
}

// Calls crossing(triangle, +1 or -1) for each triangle that the ray from p along +z leaves (+1) or enters
// (-1).
template<class Crossing>
void shoot(const TriangleScene& scene, Vec3 p, Crossing&& crossing) {
    Box ray = box_of(p, p, 0.0);
    ray.hi[2] = std::numeric_limits<float>::max();
    scene.tree().overlapping(ray, [&](std::uint32_t leaf) {
        for (std::uint32_t i = scene.tree().leaf_begin(leaf); i < scene.tree().leaf_begin(leaf + 1); ++i) {
            const TriangleScene::Triangle& t = scene.triangles()[i];
            // Rounding of these differences moves a vertex alike for all of its triangles: still watertight.
            const Vec3 a = scene.corner(t, 0) - p, b = scene.corner(t, 1) - p, c = scene.corner(t, 2) - p;
            const int ab = turn(a.x, a.y, b.x, b.y);
            if (ab == 0 || ab != turn(b.x, b.y, c.x, c.y) || ab != turn(c.x, c.y, a.x, a.y)) continue;
            const double wa = b.x * c.y - b.y * c.x, wb = c.x * a.y - c.y * a.x, wc = a.x * b.y - a.y * b.x;
            if ((wa * a.z + wb * b.z + wc * c.z) * ab > 0.0) crossing(t, ab);
        }
    });
}

} // namespace

bool winding_numbers(const TriangleScene& scene, Vec3 p, std::span<int> winding) {
    std::fill(winding.begin(), winding.end(), 0);
    if (!is_finite(p)) return false;
    shoot(scene, p, [&](const TriangleScene::Triangle& t, int direction) {
        if (t.organ < winding.size()) winding[t.organ] += direction;
    });
    return true;
}

std::uint32_t organ_containing(const TriangleScene& scene, Vec3 p) {
    std::array<int, TriangleScene::most_organs> winding;
    if (!winding_numbers(scene, p, std::span(winding).first(scene.organ_count()))) return TriangleScene::none;
    for (std::uint32_t organ = 0; organ < scene.organ_count(); ++organ)
        if (winding[organ] > 0) return organ;
    return TriangleScene::none;
}

} // namespace calot::geometry
