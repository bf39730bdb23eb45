#include "organ_mesh.hpp"

#include "borders.hpp"
#include "surface.hpp"

#include <cmath>
#include <unordered_map>

namespace calot::mesher {
namespace {

/// A grid edge's crossing of the surface, by bisection.
Vec crossing(const Shape& solid, Vec inside, Vec outside) {
    for (int i = 0; i < 30; ++i) {
        const Vec middle = 0.5 * (inside + outside);
        (solid.value(middle) < 0 ? inside : outside) = middle;
    }
    return 0.5 * (inside + outside);
}

/// Where the edges of a grid of the given step cross the surface.
std::vector<Vec> grid_crossings(const Shape& solid, const Box& box, double step) {
    const Vec size = box.high - box.low;
    const auto count = [&](double length) { return static_cast<std::size_t>(std::ceil(length / step)) + 1; };
    constexpr std::size_t most_cells = 10'000'000; // bounds the time that any description can take
    while (count(size.x) * count(size.y) * count(size.z) > most_cells)
        step *= 1.25;
    const std::size_t nx = count(size.x), ny = count(size.y), nz = count(size.z);
    std::vector<float> below(nx * ny), here(nx * ny);
    std::vector<Vec> found;
    const auto at = [&](std::size_t i, std::size_t j, std::size_t k) {
        return box.low + Vec{step * static_cast<double>(i), step * static_cast<double>(j),
                             step * static_cast<double>(k)};
    };
    for (std::size_t k = 0; k < nz; ++k) {
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i)
                here[j * nx + i] = static_cast<float>(solid.value(at(i, j, k)));
        const auto cross = [&](float a, float b, Vec p, Vec q) {
            if ((a < 0) != (b < 0)) found.push_back(a < 0 ? crossing(solid, p, q) : crossing(solid, q, p));
        };
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i) {
                const float v = here[j * nx + i];
                if (i + 1 < nx) cross(v, here[j * nx + i + 1], at(i, j, k), at(i + 1, j, k));
                if (j + 1 < ny) cross(v, here[(j + 1) * nx + i], at(i, j, k), at(i, j + 1, k));
                if (k) cross(below[j * nx + i], v, at(i, j, k - 1), at(i, j, k));
            }
        std::swap(below, here);
    }
    return found;
}

const Region& region_at(const Organ& organ, Vec p) {
    for (const Region& r : organ.regions)
        if (!r.inside || r.inside->value(p) < 0) return r;
    return organ.regions.back();
}

/// Points of the surface, no closer to each other than 0.7 of their region's edge: they give the refinement
/// every component and every wall from the start.
std::vector<Vec> seed_points(const Organ& organ, const Box& box) {
    double longest = organ.edge;
    for (const Region& r : organ.regions)
        longest = std::max(longest, r.edge);
    const double cell = 0.7 * longest; // neighbours nearer than that are in the next cell at most
    std::unordered_map<std::uint64_t, std::vector<Vec>> kept;
    std::vector<Vec> out;
    const auto key = [](std::int64_t i, std::int64_t j, std::int64_t k) {
        return static_cast<std::uint64_t>((i + (1 << 20)) << 42 | (j + (1 << 20)) << 21 | (k + (1 << 20)));
    };
    // In the order of the grid: a point is kept when no kept one is near.
    for (const Vec& p : grid_crossings(*organ.solid, box, organ.edge)) {
        const double near = 0.7 * region_at(organ, p).edge;
        const auto i = static_cast<std::int64_t>(std::floor(p.x / cell)),
                   j = static_cast<std::int64_t>(std::floor(p.y / cell)),
                   k = static_cast<std::int64_t>(std::floor(p.z / cell));
        bool free = true;
        for (std::int64_t a = i - 1; free && a <= i + 1; ++a)
            for (std::int64_t b = j - 1; free && b <= j + 1; ++b)
                for (std::int64_t c = k - 1; free && c <= k + 1; ++c)
                    if (const auto near_by = kept.find(key(a, b, c)); near_by != kept.end())
                        for (const Vec& q : near_by->second)
                            free = free && norm(p - q) >= near;
        if (!free) continue;
        kept[key(i, j, k)].push_back(p);
        out.push_back(p);
    }
    return out;
}

/// Central differences over about a third of an edge: what is finer than the triangles must not show in the
/// normals.
Vec gradient(const Shape& solid, Vec p, double h) {
    const auto difference = [&](Vec d) { return solid.value(p + d) - solid.value(p - d); };
    return {difference({h, 0, 0}), difference({0, h, 0}), difference({0, 0, h})};
}

/// How open the surface is at p, from the field's values above it (Evans 2006): 1 in the open, towards 0 in a
/// groove.
double openness(const Shape& solid, Vec p, Vec normal) {
    double shut = 0, weight = 1, total = 0;
    for (const double reach : {1.0, 2.5, 5.0, 9.0}) {
        shut += weight * std::clamp(1 - solid.value(p + reach * normal) / reach, 0.0, 1.0);
        total += weight;
        weight *= 0.75;
    }
    return std::clamp(1 - 1.3 * shut / total, 0.15, 1.0);
}

/// From the description's frame and millimetres to LPS metres, rounded as the file will round it.
meshio::Vec3 to_lps(Vec p) {
    const auto single = [](double v) { return static_cast<double>(static_cast<float>(v)); };
    return {single(0.001 * p.x), single(-0.001 * p.z), single(0.001 * p.y)};
}

Vec from_lps(const meshio::Vec3& p) {
    return {1000 * p[0], 1000 * p[2], -1000 * p[1]};
}

} // namespace

OrganMesh mesh_organ(const Organ& organ) {
    const Shape& solid = *organ.solid;
    SurfaceRequest request;
    request.field = [&](Vec p) { return solid.value(p); };
    request.bounds = solid.bounds().grown(1.0);
    request.edge = [&](Vec p) { return region_at(organ, p).edge; };
    request.deviation = [&](Vec p) { return region_at(organ, p).deviation; };
    request.seeds = seed_points(organ, request.bounds);
    request.most_points =
        2 * organ.triangles; // a closed surface has half as many; the excess is reported below
    if (request.seeds.size() < 4)
        throw SurfaceError("has no surface: its solid is empty or smaller than 'edge'");
    Surface surface = extract_surface(request);
    for (std::size_t i = 0; i + 1 < organ.regions.size(); ++i)
        cut_along(surface, solid, *organ.regions[i].inside,
                  [&](Vec p) { // earlier regions win: no border inside them
                      for (std::size_t k = 0; k < i; ++k)
                          if (organ.regions[k].inside->value(p) < -0.2) return true;
                      return false;
                  });

    meshio::TriangleMesh mesh;
    mesh.name = organ.name;
    for (const Region& r : organ.regions)
        mesh.region_names.push_back(r.name);
    for (const Vec& p : surface.points) {
        mesh.vertices.push_back(to_lps(p));
        const Vec n = normalised(gradient(solid, p, 0.3 * region_at(organ, p).edge));
        mesh.normals.push_back({n.x, -n.z, n.y});
        const auto open = static_cast<std::uint8_t>(std::lround(255 * openness(solid, p, n)));
        mesh.colours.push_back({open, open, open, 255});
    }
    for (const auto& t : surface.triangles) {
        mesh.triangles.push_back(t);
        const Vec middle = (1.0 / 3) * (surface.points[t[0]] + surface.points[t[1]] + surface.points[t[2]]);
        mesh.region.push_back(static_cast<std::uint16_t>(&region_at(organ, middle) - organ.regions.data()));
    }
    meshio::weld(mesh); // single precision may have joined two points
    return examine(std::move(mesh), organ.triangles);
}

OrganMesh examine(meshio::TriangleMesh mesh, std::size_t budget) {
    OrganMesh out;
    out.mesh = std::move(mesh);
    out.report = meshio::check(out.mesh);
    out.problem = out.report.problem();
    if (!out.report.closed() || !out.report.manifold() || out.report.triangles == 0) return out;
    Surface surface;
    for (const auto& p : out.mesh.vertices)
        surface.points.push_back(from_lps(p));
    surface.triangles = out.mesh.triangles;
    out.self_intersections = self_intersections(surface);
    if (out.self_intersections) // first, because parts that cut each other have no inside and outside
        out.problem = std::to_string(out.self_intersections) + " pairs of triangles cut each other";
    else if (out.problem.empty() && budget && out.report.triangles > budget)
        out.problem = std::to_string(out.report.triangles) + " triangles, more than the budget of " +
                      std::to_string(budget) + ": raise 'edge' or 'deviation', or the budget";
    return out;
}

} // namespace calot::mesher
