// Procedural surfaces for the tests and the benchmark of this folder.
#pragma once

#include "geometry/triangle_scene.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <span>
#include <vector>

namespace calot::geometry::test {

struct Shape {
    std::vector<double> vertices;
    std::vector<std::uint32_t> triangles;
    std::vector<std::uint32_t> regions;

    std::uint32_t add(Vec3 v) {
        vertices.insert(vertices.end(), {v.x, v.y, v.z});
        return static_cast<std::uint32_t>(vertices.size() / 3 - 1);
    }
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        triangles.insert(triangles.end(), {a, b, c});
    }
    Vec3 vertex(std::size_t i) const { return {vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]}; }
    std::size_t triangle_count() const { return triangles.size() / 3; }
    Vec3 corner(std::size_t t, int k) const { return vertex(triangles[3 * t + k]); }
    OrganSurface surface(std::string_view name = "shape", std::span<const double> friction = {}) const {
        return {name, vertices, triangles, regions, friction};
    }
    TriangleScene scene() const {
        const OrganSurface organs[] = {surface()};
        return TriangleScene(organs);
    }
    template<class Map>
    Shape mapped(Map&& map) const {
        Shape out = *this;
        for (std::size_t i = 0; i < vertices.size() / 3; ++i) {
            const Vec3 v = map(vertex(i));
            out.vertices[3 * i] = v.x;
            out.vertices[3 * i + 1] = v.y;
            out.vertices[3 * i + 2] = v.z;
        }
        return out;
    }
};

// A closed grid of rings x sides quads, wrapping both ways; place(i, j) gives the vertices. Outward where
// (direction of j) x (direction of i) is.
template<class Place>
Shape torus_grid(std::uint32_t rings, std::uint32_t sides, Place&& place) {
    Shape shape;
    for (std::uint32_t i = 0; i < rings; ++i)
        for (std::uint32_t j = 0; j < sides; ++j)
            shape.add(place(i, j));
    for (std::uint32_t i = 0; i < rings; ++i)
        for (std::uint32_t j = 0; j < sides; ++j) {
            const std::uint32_t a = i * sides + j, b = i * sides + (j + 1) % sides;
            const std::uint32_t c = (i + 1) % rings * sides + j,
                                d = (i + 1) % rings * sides + (j + 1) % sides;
            shape.triangle(a, d, c);
            shape.triangle(a, b, d);
        }
    return shape;
}

struct ProfilePoint {
    double r, z;
};

// Closed solid of revolution about z without points on the axis: `profile` runs counter-clockwise in (r, z).
inline Shape revolved(std::span<const ProfilePoint> profile, std::uint32_t sides) {
    return torus_grid(
        static_cast<std::uint32_t>(profile.size()), sides, [&](std::uint32_t i, std::uint32_t j) {
            const double angle = 2.0 * std::numbers::pi * j / sides;
            return Vec3{profile[i].r * std::cos(angle), profile[i].r * std::sin(angle), profile[i].z};
        });
}

// Wall of a straight tube along z: solid between the radii, from z = 0 to length, in `steps` rings.
inline Shape tube_wall(double inner, double outer, double length, std::uint32_t sides, std::uint32_t steps) {
    std::vector<ProfilePoint> profile;
    for (std::uint32_t i = 0; i <= steps; ++i)
        profile.push_back({outer, length * i / steps});
    for (std::uint32_t i = 0; i <= steps; ++i)
        profile.push_back({inner, length * (steps - i) / steps});
    return revolved(profile, sides);
}

// Round plate about z from z = -thickness / 2 to thickness / 2 with a round hole whose rim is a half torus.
inline Shape plate_with_hole(double hole_radius, double outer_radius, double thickness, std::uint32_t sides,
                             std::uint32_t rim_steps, std::uint32_t plate_steps) {
    std::vector<ProfilePoint> profile;
    const double half = 0.5 * thickness, rim_centre = hole_radius + half;
    for (std::uint32_t i = 0; i <= rim_steps; ++i) { // from the top over the hole's inside to the bottom
        const double angle = std::numbers::pi * (0.5 + static_cast<double>(i) / rim_steps);
        profile.push_back({rim_centre + half * std::cos(angle), half * std::sin(angle)});
    }
    for (std::uint32_t i = 1; i <= plate_steps; ++i)
        profile.push_back({rim_centre + (outer_radius - rim_centre) * i / plate_steps, -half});
    for (std::uint32_t i = 0; i < plate_steps; ++i)
        profile.push_back({outer_radius - (outer_radius - rim_centre) * i / plate_steps, half});
    return revolved(profile, sides);
}

// Closed sphere by latitude and longitude, outward.
inline Shape sphere(Vec3 centre, double radius, std::uint32_t stacks, std::uint32_t slices) {
    Shape shape;
    const std::uint32_t south = shape.add(centre - Vec3{0, 0, radius});
    for (std::uint32_t i = 1; i < stacks; ++i)
        for (std::uint32_t j = 0; j < slices; ++j) {
            const double polar = std::numbers::pi * i / stacks, turn = 2.0 * std::numbers::pi * j / slices;
            shape.add(centre + radius * Vec3{std::sin(polar) * std::cos(turn),
                                             std::sin(polar) * std::sin(turn), -std::cos(polar)});
        }
    const std::uint32_t north = shape.add(centre + Vec3{0, 0, radius});
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return 1 + (i - 1) * slices + j % slices; };
    for (std::uint32_t j = 0; j < slices; ++j) {
        shape.triangle(south, at(1, j + 1), at(1, j));
        for (std::uint32_t i = 1; i + 1 < stacks; ++i) {
            shape.triangle(at(i, j), at(i, j + 1), at(i + 1, j + 1));
            shape.triangle(at(i, j), at(i + 1, j + 1), at(i + 1, j));
        }
        shape.triangle(at(stacks - 1, j), at(stacks - 1, j + 1), north);
    }
    return shape;
}

// Axis-aligned closed box, each face a grid of `cells` x `cells` quads split in two.
inline Shape box(Vec3 lo, Vec3 hi, std::uint32_t cells) {
    Shape shape;
    const double size[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z}, base[3] = {lo.x, lo.y, lo.z};
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            const std::uint32_t first = static_cast<std::uint32_t>(shape.vertices.size() / 3);
            for (std::uint32_t i = 0; i <= cells; ++i)
                for (std::uint32_t j = 0; j <= cells; ++j) {
                    double p[3];
                    p[axis] = base[axis] + side * size[axis];
                    p[u] = base[u] + size[u] * i / cells;
                    p[v] = base[v] + size[v] * j / cells;
                    shape.add({p[0], p[1], p[2]});
                }
            for (std::uint32_t i = 0; i < cells; ++i)
                for (std::uint32_t j = 0; j < cells; ++j) {
                    const std::uint32_t a = first + i * (cells + 1) + j, b = a + cells + 1;
                    if (side == 1) {
                        shape.triangle(a, b, b + 1);
                        shape.triangle(a, b + 1, a + 1);
                    } else {
                        shape.triangle(a, b + 1, b);
                        shape.triangle(a, a + 1, b + 1);
                    }
                }
        }
    return shape;
}

// Numbers that are the same with every standard library, unlike its distributions.
class Random {
  public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double in(double lo, double hi) {
        return lo + (hi - lo) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    Vec3 in_cube(double half) { return {in(-half, half), in(-half, half), in(-half, half)}; }

  private:
    std::mt19937_64 engine_;
};

// Loose triangles of about `size` in a cube: no surface, but every configuration.
inline Shape soup(std::uint64_t seed, std::uint32_t count, double half, double size) {
    Random random(seed);
    Shape shape;
    for (std::uint32_t i = 0; i < count; ++i) {
        const Vec3 centre = random.in_cube(half);
        const std::uint32_t a = shape.add(centre + random.in_cube(size));
        const std::uint32_t b = shape.add(centre + random.in_cube(size));
        shape.triangle(a, b, shape.add(centre + random.in_cube(size)));
    }
    return shape;
}

} // namespace calot::geometry::test
