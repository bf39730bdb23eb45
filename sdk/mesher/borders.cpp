#include "borders.hpp"

#include <map>
#include <utility>

namespace calot::mesher {
namespace {

Vec gradient(const Shape& shape, Vec p) {
    constexpr double h = 0.05; // mm
    const auto slope = [&](Vec d) { return (shape.value(p + d) - shape.value(p - d)) / (2 * h); };
    return {slope({h, 0, 0}), slope({0, h, 0}), slope({0, 0, h})};
}

/// p moved along the surface onto the border, or p when that would take more than `reach`.
Vec slid(Vec p, const Shape& solid, const Shape& border, double reach) {
    Vec q = p;
    for (int step = 0; step < 4; ++step) {
        const Vec n = normalised(gradient(solid, q)), g = gradient(border, q), along = g - dot(g, n) * n;
        const double slope2 = dot(along, along);
        if (slope2 < 0.04) return p; // the two surfaces are nearly parallel here: no clear curve
        q = q - (border.value(q) / slope2) * along;
        q = q - solid.value(q) * n;
        if (!(norm(q - p) <= reach)) return p;
    }
    return std::abs(border.value(q)) < 0.02 ? q : p;
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;
Edge edge(std::uint32_t a, std::uint32_t b) {
    return {std::min(a, b), std::max(a, b)};
}

} // namespace

void cut_along(Surface& surface, const Shape& solid, const Shape& border,
               const std::function<bool(Vec)>& leave) {
    auto& points = surface.points;
    std::vector<double> shortest(points.size(), 1e9), side(points.size());
    for (const auto& t : surface.triangles)
        for (int i = 0; i < 3; ++i) {
            const auto a = t[i], b = t[(i + 1) % 3];
            const double length = norm(points[a] - points[b]);
            shortest[a] = std::min(shortest[a], length), shortest[b] = std::min(shortest[b], length);
        }
    for (std::size_t i = 0; i < points.size(); ++i) {
        side[i] = border.value(points[i]);
        if (std::abs(side[i]) > shortest[i] || leave(points[i])) continue;
        points[i] = slid(points[i], solid, border, 0.3 * shortest[i]);
        side[i] = border.value(points[i]);
        if (std::abs(side[i]) < 0.03 * shortest[i]) side[i] = 0;
    }

    std::map<Edge, std::uint32_t> middle; // of the edges to split
    for (const auto& t : surface.triangles)
        for (int i = 0; i < 3; ++i) {
            const auto a = t[i], b = t[(i + 1) % 3];
            if (!(side[a] * side[b] < 0) || middle.contains(edge(a, b))) continue;
            Vec in = points[side[a] < 0 ? a : b], out = points[side[a] < 0 ? b : a];
            if (leave(0.5 * (in + out))) continue;
            const Vec from = in, to = out;
            for (int step = 0; step < 30; ++step) {
                const Vec m = 0.5 * (in + out);
                (border.value(m) < 0 ? in : out) = m;
            }
            const double share = norm(0.5 * (in + out) - from) / norm(to - from);
            middle.emplace(edge(a, b), static_cast<std::uint32_t>(points.size()));
            points.push_back(from + std::clamp(share, 0.08, 0.92) * (to - from)); // no slivers
        }

    std::vector<std::array<std::uint32_t, 3>> cut;
    for (auto t : surface.triangles) {
        const auto split = [&](int i) {
            const auto at = middle.find(edge(t[i], t[(i + 1) % 3]));
            return at == middle.end() ? ~0u : at->second;
        };
        int count = 0;
        for (int i = 0; i < 3; ++i)
            count += split(i) != ~0u;
        if (count == 0) {
            cut.push_back(t);
            continue;
        }
        // Turned so that the first edge is split, and with two so that the third is whole; a border crosses
        // two at most, but its field may wiggle.
        while (split(0) == ~0u || (count == 2 && split(2) != ~0u))
            std::rotate(t.begin(), t.begin() + 1, t.end());
        const auto m = split(0), k = split(1), l = split(2);
        if (count == 1) {
            cut.push_back({t[0], m, t[2]}), cut.push_back({m, t[1], t[2]});
        } else if (count == 2) {
            cut.push_back({m, t[1], k});
            if (norm(points[m] - points[t[2]]) < norm(points[t[0]] - points[k]))
                cut.push_back({t[0], m, t[2]}), cut.push_back({m, k, t[2]});
            else
                cut.push_back({t[0], m, k}), cut.push_back({t[0], k, t[2]});
        } else {
            cut.push_back({t[0], m, l}), cut.push_back({m, t[1], k}), cut.push_back({l, k, t[2]}),
                cut.push_back({m, k, l});
        }
    }
    surface.triangles = std::move(cut);
}

} // namespace calot::mesher
