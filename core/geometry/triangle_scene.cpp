#include "geometry/triangle_scene.hpp"

#include "geometry/distance.hpp"

#include <algorithm>
#include <stdexcept>
#include <unordered_map>

namespace calot::geometry {
namespace {

constexpr double farthest_coordinate = 1000.0;

[[noreturn]] void refuse(const OrganSurface& organ, const std::string& what) {
    throw std::invalid_argument("organ '" + std::string(organ.name) + "': " + what);
}

bool acceptable(double coordinate) {
    return std::fabs(coordinate) <= farthest_coordinate;
} // false for NaN

struct CoordinatesHash {
    std::size_t operator()(const Vec3& v) const {
        const std::hash<double> hash; // equal for 0.0 and -0.0
        std::size_t h = hash(v.x);
        h = h * 0x9e3779b97f4a7c15ull + hash(v.y);
        h = h * 0x9e3779b97f4a7c15ull + hash(v.z);
        return h;
    }
};

// Area at which a triangle counts as having none, relative to its longest edge: its height is lost in
// rounding.
bool has_area(Vec3 a, Vec3 b, Vec3 c) {
    const double longest2 = std::max({norm2(b - a), norm2(c - b), norm2(a - c)});
    return norm2(cross(b - a, c - a)) > 1e-24 * longest2 * longest2;
}

} // namespace

TriangleScene::TriangleScene(std::span<const OrganSurface> organs) {
    if (organs.size() > most_organs) throw std::invalid_argument("more than 256 organs in one scene");
    std::size_t total = 0;
    for (const OrganSurface& organ : organs)
        total += organ.triangles.size() / 3;
    if (total > most_triangles) throw std::invalid_argument("more than 4,000,000 triangles in one scene");
    triangles_.reserve(total);
    for (const OrganSurface& organ : organs)
        add_organ(organ);
    connect();
}

void TriangleScene::add_organ(const OrganSurface& organ) {
    if (organ.vertices.size() % 3 != 0) refuse(organ, "the number of coordinates is no multiple of three");
    if (organ.triangles.size() % 3 != 0) refuse(organ, "the number of indices is no multiple of three");
    const std::size_t vertex_count = organ.vertices.size() / 3, triangle_count = organ.triangles.size() / 3;
    if (!organ.regions.empty() && organ.regions.size() != triangle_count)
        refuse(organ, "has " + std::to_string(triangle_count) + " triangles but " +
                          std::to_string(organ.regions.size()) + " region numbers");
    if (organ.friction.size() > 65536) refuse(organ, "has more than 65,536 regions");
    for (std::size_t r = 0; r < organ.friction.size(); ++r)
        if (!std::isfinite(organ.friction[r]) || organ.friction[r] < 0.0)
            refuse(organ, "the friction of region " + std::to_string(r) + " is negative or not finite");

    const auto organ_index = static_cast<std::uint32_t>(friction_.size());
    friction_.emplace_back(organ.friction.begin(), organ.friction.end());
    if (organ.friction.empty()) friction_.back().push_back(0.0);

    std::unordered_map<Vec3, std::uint32_t, CoordinatesHash> merged;
    merged.reserve(vertex_count);
    const std::size_t first_source = source_to_vertex_.size();
    for (std::size_t v = 0; v < vertex_count; ++v) {
        const Vec3 p{organ.vertices[3 * v], organ.vertices[3 * v + 1], organ.vertices[3 * v + 2]};
        if (!acceptable(p.x) || !acceptable(p.y) || !acceptable(p.z))
            refuse(organ,
                   "vertex " + std::to_string(v) + " is not finite or farther than 1 km from the origin");
        const auto [place, added] = merged.try_emplace(p, static_cast<std::uint32_t>(vertices_.size()));
        if (added) vertices_.push_back(p);
        source_to_vertex_.push_back(place->second);
    }
    for (std::size_t t = 0; t < triangle_count; ++t) {
        Triangle triangle{};
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t index = organ.triangles[3 * t + k];
            if (index >= vertex_count)
                refuse(organ, "triangle " + std::to_string(t) + " uses vertex " + std::to_string(index) +
                                  " of " + std::to_string(vertex_count));
            triangle.vertex[k] = source_to_vertex_[first_source + index];
        }
        triangle.organ = organ_index;
        triangle.region = organ.regions.empty() ? 0 : organ.regions[t];
        triangle.id = static_cast<std::uint32_t>(t);
        if (organ.friction.size() > 1 && triangle.region >= organ.friction.size())
            refuse(organ, "triangle " + std::to_string(t) + " is of region " +
                              std::to_string(triangle.region) + ", friction is given for " +
                              std::to_string(organ.friction.size()));
        if (!has_area(corner(triangle, 0), corner(triangle, 1), corner(triangle, 2))) {
            ++skipped_;
            continue;
        }
        triangle.key = static_cast<std::uint32_t>(triangles_.size());
        triangles_.push_back(triangle);
    }
}

Box TriangleScene::triangle_box(const Triangle& triangle) const {
    const Vec3 a = corner(triangle, 0), b = corner(triangle, 1), c = corner(triangle, 2);
    Box box = box_of(a, b, 0.0);
    box.merge(box_of(c, c, 0.0));
    return box;
}

// Builds the tree, puts the triangles into its order, and finds edges and fans.
void TriangleScene::connect() {
    boxes_.resize(triangles_.size());
    for (std::size_t i = 0; i < triangles_.size(); ++i)
        boxes_[i] = triangle_box(triangles_[i]);
    tree_.build(boxes_);
    std::vector<Triangle> given = std::move(triangles_);
    std::vector<Box> given_boxes = std::move(boxes_);
    triangles_.resize(given.size());
    boxes_.resize(given.size());
    for (std::size_t i = 0; i < given.size(); ++i) {
        triangles_[i] = given[tree_.order()[i]];
        boxes_[i] = given_boxes[tree_.order()[i]];
    }

    struct HalfEdge {
        std::uint32_t low, high, triangle;
        std::uint8_t side;
    };
    std::vector<HalfEdge> halves;
    halves.reserve(3 * triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
        for (std::uint8_t k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(triangles_[t].vertex[k], triangles_[t].vertex[(k + 1) % 3]);
            halves.push_back({low, high, t, k});
        }
    std::sort(halves.begin(), halves.end(), [&](const HalfEdge& a, const HalfEdge& b) {
        if (a.low != b.low) return a.low < b.low;
        if (a.high != b.high) return a.high < b.high;
        return triangles_[a.triangle].key < triangles_[b.triangle].key;
    });
    edges_.reserve(halves.size() / 2);
    for (std::size_t i = 0; i < halves.size();) {
        std::size_t end = i + 1;
        while (end < halves.size() && halves[end].low == halves[i].low && halves[end].high == halves[i].high)
            ++end;
        Edge edge{{halves[i].low, halves[i].high}, {none, none}, {none, none}};
        for (std::size_t h = i; h < end; ++h) {
            if (h - i < 2) {
                edge.triangle[h - i] = halves[h].triangle;
                edge.opposite[h - i] = triangles_[halves[h].triangle].vertex[(halves[h].side + 2) % 3];
            }
            triangles_[halves[h].triangle].edge[halves[h].side] = static_cast<std::uint32_t>(edges_.size());
        }
        triangles_[halves[i].triangle].owns |= static_cast<std::uint8_t>(1u << halves[i].side);
        if (end - i > 2) ++irregular_edges_;
        edges_.push_back(edge);
        i = end;
    }

    fan_starts_.assign(vertices_.size() + 1, 0);
    for (const Triangle& triangle : triangles_)
        for (const std::uint32_t v : triangle.vertex)
            ++fan_starts_[v + 1];
    for (std::size_t v = 0; v < vertices_.size(); ++v)
        fan_starts_[v + 1] += fan_starts_[v];
    fans_.resize(3 * triangles_.size());
    std::vector<std::uint32_t> filled(fan_starts_.begin(), fan_starts_.end() - 1);
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
        for (const std::uint32_t v : triangles_[t].vertex)
            fans_[filled[v]++] = t;
    for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
        if (around(v).empty()) continue; // used by triangles without area only, or by none
        const auto key = [&](std::uint32_t a, std::uint32_t b) {
            return triangles_[a].key < triangles_[b].key;
        };
        Triangle& owner = triangles_[*std::min_element(around(v).begin(), around(v).end(), key)];
        for (int k = 0; k < 3; ++k)
            if (owner.vertex[k] == v) owner.owns |= static_cast<std::uint8_t>(8u << k);
    }
}

bool TriangleScene::move_vertices(std::span<const double> vertices) {
    if (vertices.size() != 3 * source_to_vertex_.size()) return false;
    if (!std::all_of(vertices.begin(), vertices.end(), acceptable)) return false;
    for (std::size_t v = 0; v < source_to_vertex_.size(); ++v)
        vertices_[source_to_vertex_[v]] = {vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]};
    for (std::size_t i = 0; i < triangles_.size(); ++i)
        boxes_[i] = triangle_box(triangles_[i]);
    tree_.refit(boxes_);
    ++generation_;
    return true;
}

NearestPoint nearest_point(const TriangleScene& scene, Vec3 p, double reach) {
    NearestPoint best;
    if (!is_finite(p) || !(reach >= 0.0)) return best;
    double best_distance2 = reach * reach;
    std::uint32_t best_key = TriangleScene::none;
    scene.tree().nearest(p, best_distance2, [&](std::uint32_t first, std::uint32_t last) {
        for (std::uint32_t i = first; i < last; ++i) {
            const TriangleScene::Triangle& t = scene.triangles()[i];
            const Vec3 point =
                closest_on_triangle(p, scene.corner(t, 0), scene.corner(t, 1), scene.corner(t, 2)).point;
            const double distance2 = norm2(p - point);
            if (distance2 < best_distance2 || (distance2 == best_distance2 && t.key < best_key)) {
                best_distance2 = distance2;
                best_key = t.key;
                best.position = i;
                best.point = point;
            }
        }
        return best_distance2;
    });
    if (best) best.distance = std::sqrt(best_distance2);
    return best;
}

} // namespace calot::geometry
