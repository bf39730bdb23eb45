#include "vector.hpp"

#include <calot/meshio/check.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace calot::meshio {
namespace {

struct Edge {
    std::uint32_t low, high, triangle;
    bool forward; // runs from low to high in its triangle
};

class Sets { // disjoint sets with path halving
  public:
    explicit Sets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
    std::uint32_t root(std::uint32_t a) {
        while (parent_[a] != a)
            a = parent_[a] = parent_[parent_[a]];
        return a;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        a = root(a), b = root(b);
        if (a != b) parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<std::uint32_t> parent_;
};

/// The solid angle of the triangle seen from p, over 4 pi (Van Oosterom and Strackee 1983): summed over a
/// closed surface it is the winding number of p.
double winding(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 u = a - p, v = b - p, w = c - p;
    const double lu = norm(u), lv = norm(v), lw = norm(w);
    const double y = dot(u, cross(v, w));
    const double x = lu * lv * lw + dot(u, v) * lw + dot(v, w) * lu + dot(w, u) * lv;
    return std::atan2(y, x) / (2 * M_PI);
}

void count_edges(const TriangleMesh& mesh, Sets& parts, MeshReport& report) {
    std::vector<Edge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
            edges.push_back({std::min(a, b), std::max(a, b), t, a < b});
        }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        if (a.low != b.low) return a.low < b.low;
        if (a.high != b.high) return a.high < b.high;
        return a.triangle < b.triangle;
    });
    for (std::size_t i = 0, j; i < edges.size(); i = j) {
        for (j = i + 1; j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high;
             ++j)
            parts.join(edges[i].triangle, edges[j].triangle);
        if (j - i == 1) ++report.boundary_edges;
        if (j - i > 2) ++report.non_manifold_edges;
        if (j - i == 2 && edges[i].forward == edges[i + 1].forward) ++report.misoriented_edges;
    }
}

/// A vertex is manifold when its triangles, joined through the edges at it, form one fan.
void count_vertices(const TriangleMesh& mesh, MeshReport& report) {
    std::vector<std::uint32_t> first(mesh.vertices.size() + 1, 0);
    for (const auto& tri : mesh.triangles)
        for (const auto v : tri)
            ++first[v + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> incident(first.back()), fill(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (const auto v : mesh.triangles[t])
            incident[fill[v]++] = t;
    std::vector<std::pair<std::uint32_t, std::uint32_t>>
        spokes; // neighbour across the vertex's edges, local triangle
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
        const std::uint32_t count = first[v + 1] - first[v];
        if (count < 2) continue;
        spokes.clear();
        for (std::uint32_t i = 0; i < count; ++i)
            for (const auto w : mesh.triangles[incident[first[v] + i]])
                if (w != v) spokes.emplace_back(w, i);
        std::sort(spokes.begin(), spokes.end());
        Sets fans(count);
        for (std::size_t i = 0; i + 1 < spokes.size(); ++i)
            if (spokes[i].first == spokes[i + 1].first) fans.join(spokes[i].second, spokes[i + 1].second);
        for (std::uint32_t i = 1; i < count; ++i)
            if (fans.root(i) != 0) {
                ++report.non_manifold_vertices;
                break;
            }
    }
}

} // namespace

std::string MeshReport::problem() const {
    const auto say = [](std::size_t n, const char* what) { return std::to_string(n) + " " + what; };
    if (triangles == 0) return "no triangles";
    if (degenerate_triangles) return say(degenerate_triangles, "degenerate triangles");
    if (boundary_edges) return "not closed: " + say(boundary_edges, "boundary edges");
    if (non_manifold_edges) return say(non_manifold_edges, "edges with more than two triangles");
    if (misoriented_edges) return say(misoriented_edges, "edges between triangles of opposite orientation");
    if (non_manifold_vertices) return say(non_manifold_vertices, "vertices where the surface touches itself");
    if (inverted_components) return say(inverted_components, "components facing the wrong way");
    return {};
}

MeshReport check(const TriangleMesh& mesh) {
    MeshReport report;
    report.vertices = mesh.vertices.size();
    report.triangles = mesh.triangles.size();
    for (const auto& tri : mesh.triangles)
        for (const auto v : tri)
            if (v >= mesh.vertices.size())
                throw MeshError(mesh.name + ": triangle uses vertex " + std::to_string(v) + " of " +
                                std::to_string(mesh.vertices.size()) + ": repair the mesh");
    if (mesh.triangles.empty()) return report;

    Sets parts(mesh.triangles.size());
    count_edges(mesh, parts, report);
    count_vertices(mesh, report);

    constexpr double smallest_area = 1e-14; // m2
    constexpr double inf = std::numeric_limits<double>::infinity();
    report.minimum = {inf, inf, inf}, report.maximum = {-inf, -inf, -inf};
    for (const auto& p : mesh.vertices)
        for (int i = 0; i < 3; ++i)
            report.minimum[i] = std::min(report.minimum[i], p[i]),
            report.maximum[i] = std::max(report.maximum[i], p[i]);
    const Vec3 origin = 0.5 * (report.minimum + report.maximum); // keeps cancellation out of the volumes

    std::vector<double> volume(mesh.triangles.size(), 0.0); // of a component, at its root
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& tri = mesh.triangles[t];
        const Vec3 a = mesh.vertices[tri[0]] - origin, b = mesh.vertices[tri[1]] - origin,
                   c = mesh.vertices[tri[2]] - origin;
        const double area = 0.5 * norm(cross(b - a, c - a));
        const double part = dot(a, cross(b, c)) / 6;
        report.area += area, report.volume += part;
        volume[parts.root(t)] += part;
        if (tri[0] == tri[1] || tri[1] == tri[2] || tri[2] == tri[0] || !(area > smallest_area))
            ++report.degenerate_triangles;
    }

    std::vector<std::uint32_t> roots;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        if (parts.root(t) == t) roots.push_back(t);
    report.components = roots.size();
    if (!report.closed() || !report.manifold() || roots.size() > 1000) {
        for (const auto r : roots)
            report.inverted_components += !(volume[r] > 0);
        return report;
    }
    for (const auto r : roots) {
        int depth = 0; // how many other components hold this one
        if (roots.size() > 1) {
            const Vec3 p = mesh.vertices[mesh.triangles[r][0]];
            std::vector<double> turns(mesh.triangles.size(), 0.0);
            for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
                const auto& tri = mesh.triangles[t];
                const std::uint32_t part = parts.root(t);
                if (part != r)
                    turns[part] +=
                        winding(p, mesh.vertices[tri[0]], mesh.vertices[tri[1]], mesh.vertices[tri[2]]);
            }
            for (const auto other : roots)
                depth += other != r && std::abs(turns[other]) > 0.5;
        }
        report.inverted_components += depth % 2 == 0 ? !(volume[r] > 0) : !(volume[r] < 0);
    }
    return report;
}

} // namespace calot::meshio
