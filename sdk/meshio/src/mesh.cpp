#include "vector.hpp"

#include <calot/meshio/mesh.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <unordered_map>

namespace calot::meshio {
namespace {

struct PositionHash {
    std::size_t operator()(const Vec3& p) const {
        std::uint64_t h = 0x9e3779b97f4a7c15ull;
        for (const double c : p) {
            h ^= std::bit_cast<std::uint64_t>(c + 0.0); // + 0.0 makes the two zeros one
            h *= 0xff51afd7ed558ccdull;
            h ^= h >> 32;
        }
        return h;
    }
};

} // namespace

void weld(TriangleMesh& mesh) {
    std::unordered_map<Vec3, std::uint32_t, PositionHash> known;
    known.reserve(mesh.vertices.size());
    constexpr std::uint32_t none = ~0u;
    std::vector<std::uint32_t> moved(mesh.vertices.size(), none);
    const bool with_normals = !mesh.normals.empty(), with_colours = !mesh.colours.empty();
    TriangleMesh out;
    auto place = [&](std::uint32_t old) {
        if (moved[old] != none) return moved[old];
        const auto next = static_cast<std::uint32_t>(out.vertices.size());
        const auto [at, fresh] = known.try_emplace(mesh.vertices[old], next);
        moved[old] = at->second;
        if (fresh) {
            out.vertices.push_back(mesh.vertices[old]);
            if (with_normals) out.normals.push_back(mesh.normals[old]);
            if (with_colours) out.colours.push_back(mesh.colours[old]);
        } else if (with_normals) {
            out.normals[at->second] = out.normals[at->second] + mesh.normals[old];
        }
        return moved[old];
    };
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& tri = mesh.triangles[t];
        const auto& v = mesh.vertices;
        if (v[tri[0]] == v[tri[1]] || v[tri[1]] == v[tri[2]] || v[tri[2]] == v[tri[0]]) continue;
        // In order: the vertices' numbering must not depend on how a compiler orders the arguments of a call.
        const std::uint32_t a = place(tri[0]), b = place(tri[1]), c = place(tri[2]);
        out.triangles.push_back({a, b, c});
        if (!mesh.region.empty()) out.region.push_back(mesh.region[t]);
    }
    for (auto& n : out.normals)
        n = normalised(n);
    mesh.vertices = std::move(out.vertices);
    mesh.triangles = std::move(out.triangles);
    mesh.region = std::move(out.region);
    mesh.normals = std::move(out.normals);
    mesh.colours = std::move(out.colours);
}

void compute_normals(TriangleMesh& mesh) {
    mesh.normals.assign(mesh.vertices.size(), Vec3{});
    for (const auto& tri : mesh.triangles) {
        const Vec3 p[3] = {mesh.vertices[tri[0]], mesh.vertices[tri[1]], mesh.vertices[tri[2]]};
        const Vec3 n = normalised(cross(p[1] - p[0], p[2] - p[0]));
        for (int i = 0; i < 3; ++i) {
            const Vec3 a = normalised(p[(i + 1) % 3] - p[i]), b = normalised(p[(i + 2) % 3] - p[i]);
            const double angle = std::acos(std::clamp(dot(a, b), -1.0, 1.0));
            mesh.normals[tri[i]] = mesh.normals[tri[i]] + angle * n;
        }
    }
    for (auto& n : mesh.normals)
        n = normalised(n);
}

} // namespace calot::meshio
