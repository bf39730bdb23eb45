#include "bench/geometry_scenes.hpp"

#include <cmath>
#include <numbers>

namespace calot::bench {

using geometry::Vec3;

namespace {

constexpr double pi = std::numbers::pi;

// The colon's middle, arc length `s` m from its lower end: bends of 180 degrees about radius 60 mm,
// alternately right and left, each rising a little, so that neighbouring limbs do not meet.
struct Middle {
    Vec3 place, along, side, up;
};
Middle colon_middle(double s) {
    constexpr double bend = 0.06, limb = pi * bend, rise = 0.1;
    const double which = std::floor(s / limb), angle = s / bend - which * pi;
    const double sign = std::fmod(std::fabs(which), 2.0) < 0.5 ? 1.0 : -1.0, scale = 1 / std::hypot(1, rise);
    const Vec3 along{scale * std::sin(angle), scale * sign * std::cos(angle), scale * rise};
    const Vec3 side{sign * std::cos(angle), -std::sin(angle), 0.0};
    const Vec3 place{bend * (2 * which + 1 - std::cos(angle)), sign * bend * std::sin(angle), rise * s};
    return {place, along, side, cross(along, side)};
}

} // namespace

Vec3 Surface::corner(std::size_t triangle, int k) const {
    const double* v = &vertices[std::size_t{3} * triangles[3 * triangle + static_cast<std::size_t>(k)]];
    return {v[0], v[1], v[2]};
}

geometry::TriangleScene Surface::scene() const {
    const double friction[] = {0.05};
    const geometry::OrganSurface organs[] = {{"wall", vertices, triangles, {}, friction}};
    return geometry::TriangleScene(organs);
}

// `s` in [0, 1] along the tube.
Vec3 FoldedTube::inside(double s, double turn, double swell) const {
    if (kind_ == Kind::stomach) {
        const double polar = pi * (0.02 + 0.96 * s), around = std::sin(polar);
        const double r = (1 - 0.02 * around * std::cos(14 * turn)) * (1 + swell / 0.06 * around);
        return {0.06 * r * around * std::cos(turn), 0.06 * r * around * std::sin(turn),
                -0.12 * r * std::cos(polar)};
    }
    // Three taeniae pull the wall in lengthwise; between them a fold every 30 mm, half a step on in each row.
    const double third = std::floor(turn / (2 * pi / 3)),
                 between = std::sin(1.5 * (turn - third * 2 * pi / 3));
    const double phase = std::cos(pi * (1.2 * s / 0.03 + third / 3));
    const double fold = (0.0006 + 0.004 * between) * std::pow(std::fabs(phase), 8);
    const double r = 0.0148 + 0.004 * between - fold + swell * between; // as good as collapsed
    const Middle m = colon_middle(1.2 * s);
    return m.place + r * std::cos(turn) * m.side + r * std::sin(turn) * m.up;
}

Vec3 FoldedTube::outside(double s, double turn, double swell) const {
    if (kind_ == Kind::stomach) {
        const double polar = pi * (0.02 + 0.96 * s), r = 1 + swell / 0.06 * std::sin(polar);
        return {0.064 * r * std::sin(polar) * std::cos(turn), 0.064 * r * std::sin(polar) * std::sin(turn),
                -0.124 * r * std::cos(polar)};
    }
    const Middle m = colon_middle(1.2 * s);
    const double r = 0.030 + swell;
    return m.place + r * std::cos(turn) * m.side + r * std::sin(turn) * m.up;
}

Surface FoldedTube::wall(std::uint32_t rings, std::uint32_t sides, double swell) const {
    // Around from the outside's end to its beginning and back along the lumen: closed both ways.
    Surface surface;
    const auto add = [&](Vec3 v) { surface.vertices.insert(surface.vertices.end(), {v.x, v.y, v.z}); };
    const std::uint32_t circles = 2 * (rings + 1);
    for (std::uint32_t i = 0; i < circles; ++i) {
        const bool is_outside = i <= rings;
        const double s = static_cast<double>(is_outside ? i : circles - 1 - i) / rings;
        for (std::uint32_t j = 0; j < sides; ++j) {
            const double turn = 2 * pi * j / sides;
            add(is_outside ? outside(s, turn, swell) : inside(s, turn, swell));
        }
    }
    for (std::uint32_t i = 0; i < circles; ++i)
        for (std::uint32_t j = 0; j < sides; ++j) {
            const std::uint32_t next = (i + 1) % circles, a = i * sides + j, b = i * sides + (j + 1) % sides;
            const std::uint32_t c = next * sides + j, d = next * sides + (j + 1) % sides;
            surface.triangles.insert(surface.triangles.end(), {a, b, d, a, d, c});
        }
    return surface;
}

std::vector<double> FoldedTube::shaft_on_wall(std::size_t nodes, double radius, double along) const {
    std::vector<double> block(3 * nodes);
    const bool is_stomach = kind_ == Kind::stomach;
    // A helix in the stomach; in the colon half a turn for each 0.3 m, on the tops of the folds.
    const double step_s = is_stomach ? 5e-5 : 1e-4 / 1.2, step_turn = is_stomach ? 1.8e-3 : 1e-3;
    double s = is_stomach ? 0.18 : 0.01 + along / 1.2, turn = is_stomach ? along / 0.06 : 0.0;
    const auto place = [&](double share) {
        const double at = s + share * step_s, about = turn + share * step_turn;
        if (is_stomach) {
            const Vec3 p = inside(at, about, 0);
            return (1.0 - (radius + 1e-4) / norm(p)) * p;
        }
        const Middle m = colon_middle(1.2 * at);
        const double out = 0.0142 - 0.0003 - radius;
        return m.place + out * std::cos(about) * m.side + out * std::sin(about) * m.up;
    };
    Vec3 last = place(0);
    for (std::size_t i = 0; i < nodes; ++i) {
        if (i > 0) {
            const auto is_near = [&](double share) { return norm(place(share) - last) < 0.010; };
            while (is_near(1))
                s += step_s, turn += step_turn;
            double low = 0, high = 1;
            for (int k = 0; k < 30; ++k)
                (is_near(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
            s += high * step_s, turn += high * step_turn;
            last = place(0);
        }
        block[i] = last.x;
        block[nodes + i] = last.y;
        block[2 * nodes + i] = last.z;
    }
    return block;
}

} // namespace calot::bench
