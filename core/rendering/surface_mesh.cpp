#include "rendering/surface_mesh.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace calot::rendering {
namespace {

using Eigen::Vector3f;

Vector3f at(const std::vector<std::array<float, 3>>& v, std::uint32_t i) {
    return Vector3f(v[i][0], v[i][1], v[i][2]);
}

// Interleaves the low ten bits of three numbers.
std::uint32_t morton(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    const auto spread = [](std::uint32_t v) {
        v = (v | (v << 16)) & 0x030000FFu;
        v = (v | (v << 8)) & 0x0300F00Fu;
        v = (v | (v << 4)) & 0x030C30C3u;
        return (v | (v << 2)) & 0x09249249u;
    };
    return spread(x) | (spread(y) << 1) | (spread(z) << 2);
}

} // namespace

void check(const Surface& s) {
    const auto refuse = [&s](const std::string& what) {
        throw std::invalid_argument("surface \"" + s.name + "\": " + what);
    };
    if (s.triangles.empty()) refuse("triangles: there are none");
    if (!s.normals.empty() && s.normals.size() != s.vertices.size())
        refuse("normals: not one for each vertex");
    if (!s.colours.empty() && s.colours.size() != s.vertices.size())
        refuse("colours: not one for each vertex");
    if (!s.triangle_appearance.empty() && s.triangle_appearance.size() != s.triangles.size())
        refuse("triangle_appearance: not one for each triangle");
    for (const auto* field : {&s.vertices, &s.normals})
        for (const auto& v : *field)
            if (!std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2]))
                refuse(field == &s.vertices ? "vertices: one is not finite" : "normals: one is not finite");
    for (const auto& t : s.triangles)
        for (std::uint32_t i : t)
            if (i >= s.vertices.size())
                refuse("triangles: index " + std::to_string(i) + " is past the last vertex");
}

std::vector<std::array<float, 3>> vertex_normals(const Surface& s) {
    std::vector<Vector3f> sum(s.vertices.size(), Vector3f::Zero());
    for (const auto& t : s.triangles) {
        const Vector3f a = at(s.vertices, t[0]);
        const Vector3f area = (at(s.vertices, t[1]) - a).cross(at(s.vertices, t[2]) - a);
        for (std::uint32_t i : t)
            sum[i] += area;
    }
    std::vector<std::array<float, 3>> out(sum.size());
    for (std::size_t i = 0; i < sum.size(); ++i) {
        const float length = sum[i].norm();
        const Vector3f n = length > 0 ? Vector3f(sum[i] / length) : Vector3f(0, 0, 1);
        out[i] = {n.x(), n.y(), n.z()};
    }
    return out;
}

std::vector<float> concavity(const Surface& s, const std::vector<std::array<float, 3>>& normals,
                             double scale) {
    const std::size_t count = s.vertices.size();
    std::vector<float> value(count, 0), weight(count, 0);
    const auto edge = [&](std::uint32_t i, std::uint32_t j) {
        const Vector3f d = at(s.vertices, j) - at(s.vertices, i);
        const float squared = d.squaredNorm();
        if (!(squared > 0)) return;
        value[i] += at(normals, i).dot(d) / squared;
        weight[i] += 1;
    };
    for (const auto& t : s.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            edge(t[k], t[(k + 1) % 3]);
            edge(t[k], t[(k + 2) % 3]);
        }
    for (std::size_t i = 0; i < count; ++i)
        if (weight[i] > 0) value[i] = value[i] / weight[i] * 2 * static_cast<float>(scale);
    // Curvature of a fine mesh is noisy: a few rounds of averaging over neighbours.
    std::vector<float> sum(count);
    for (int round = 0; round < 3; ++round) {
        sum = value;
        std::fill(weight.begin(), weight.end(), 1.0f);
        for (const auto& t : s.triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                sum[t[k]] += value[t[(k + 1) % 3]] + value[t[(k + 2) % 3]];
                weight[t[k]] += 2;
            }
        for (std::size_t i = 0; i < count; ++i)
            value[i] = sum[i] / weight[i];
    }
    for (float& v : value)
        v = std::tanh(v);
    return value;
}

void update_bounds(Cluster& c, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                   const std::vector<std::array<float, 3>>& vertices) {
    Eigen::AlignedBox3f box;
    float longest = 0;
    for (std::size_t t = c.first; t < c.first + c.count; ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vector3f a = at(vertices, triangles[t][k]);
            box.extend(a);
            longest = std::max(longest, (at(vertices, triangles[t][(k + 1) % 3]) - a).squaredNorm());
        }
    const Vector3f centre = box.center();
    float radius = 0;
    for (std::size_t t = c.first; t < c.first + c.count; ++t)
        for (std::uint32_t i : triangles[t])
            radius = std::max(radius, (at(vertices, i) - centre).squaredNorm());
    c.centre = {centre.x(), centre.y(), centre.z()};
    c.radius = std::sqrt(radius);
    c.longest_edge = std::sqrt(longest);
}

ClusteredTriangles cluster(const Surface& s, std::size_t size) {
    Eigen::AlignedBox3f box;
    for (const auto& v : s.vertices)
        box.extend(Vector3f(v[0], v[1], v[2]));
    const Vector3f extent = box.sizes().cwiseMax(1e-9f);
    const auto code = [&](const std::array<std::uint32_t, 3>& t) {
        const Vector3f c = (at(s.vertices, t[0]) + at(s.vertices, t[1]) + at(s.vertices, t[2])) / 3;
        const Vector3f unit = (c - box.min()).cwiseQuotient(Vector3f::Constant(extent.maxCoeff())) * 1023.0f;
        return morton(static_cast<std::uint32_t>(unit.x()), static_cast<std::uint32_t>(unit.y()),
                      static_cast<std::uint32_t>(unit.z()));
    };
    std::vector<std::pair<std::uint32_t, std::uint32_t>> order(s.triangles.size());
    for (std::size_t t = 0; t < order.size(); ++t)
        order[t] = {code(s.triangles[t]), static_cast<std::uint32_t>(t)};
    std::sort(order.begin(), order.end());

    ClusteredTriangles out;
    out.triangles.reserve(order.size());
    for (const auto& [code, t] : order)
        out.triangles.push_back(s.triangles[t]);
    for (std::size_t first = 0; first < out.triangles.size(); first += size) {
        Cluster c;
        c.first = first;
        c.count = std::min(size, out.triangles.size() - first);
        update_bounds(c, out.triangles, s.vertices);
        out.clusters.push_back(c);
    }
    return out;
}

} // namespace calot::rendering
