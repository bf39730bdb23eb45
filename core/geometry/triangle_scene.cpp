#include "geometry/triangle_scene.hpp"

#include <algorithm>
#include <atomic>
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

using Float4 = float __attribute__((vector_size(16)));

template<class Vertex4>
Float4 load4(const Vertex4& v) {
    static_assert(sizeof v == sizeof(Float4) && alignof(Vertex4) == alignof(Float4));
    return *reinterpret_cast<const Float4*>(&v);
}
Float4 less(Float4 a, Float4 b) {
    return a < b ? a : b;
}
Float4 more(Float4 a, Float4 b) {
    return a > b ? a : b;
}

// Never shown to anyone and never part of a result: only tells contents apart.
std::uint64_t next_version() {
    static std::atomic<std::uint64_t> last{0};
    return ++last;
}

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

TriangleScene::Surface::Surface(const Surface&) : number(next_version()) {}
TriangleScene::Surface& TriangleScene::Surface::operator=(const Surface& other) {
    if (this != &other) number = next_version();
    return *this;
}

TriangleScene::TriangleScene(std::span<const OrganSurface> organs) {
    if (organs.size() > most_organs) throw std::invalid_argument("more than 256 organs in one scene");
    std::size_t total = 0;
    for (const OrganSurface& organ : organs)
        total += organ.triangles.size() / 3;
    if (total > most_triangles) throw std::invalid_argument("more than 1,000,000 triangles in one scene");
    triangles_.reserve(total);
    for (const OrganSurface& organ : organs)
        add_organ(organ);
    sort_into_leaves();
    find_edges();
    find_fans();
    make_screens();
    version_ = surface_.number = next_version();
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

void TriangleScene::sort_into_leaves() {
    rounded_.resize(vertices_.size());
    for (std::size_t v = 0; v < vertices_.size(); ++v)
        rounded_[v] = {static_cast<float>(vertices_[v].x), static_cast<float>(vertices_[v].y),
                       static_cast<float>(vertices_[v].z), 0.0f};
    std::vector<Box> boxes(triangles_.size());
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const Vec3 a = corner(triangles_[i], 0), b = corner(triangles_[i], 1), c = corner(triangles_[i], 2);
        boxes[i] = box_of(a, b, 0.0);
        boxes[i].merge(box_of(c, c, 0.0));
    }
    tree_.build(boxes);
    const std::vector<Triangle> given = std::move(triangles_);
    triangles_.resize(given.size());
    corners_.resize(given.size());
    for (std::size_t i = 0; i < given.size(); ++i) {
        triangles_[i] = given[tree_.order()[i]];
        corners_[i] = triangles_[i].vertex;
    }
}

void TriangleScene::find_edges() {
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
}

void TriangleScene::find_fans() {
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
    owners_.assign(vertices_.size(), none);
    for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
        if (around(v).empty()) continue; // used by triangles without area only, or by none
        const auto key = [&](std::uint32_t a, std::uint32_t b) {
            return triangles_[a].key < triangles_[b].key;
        };
        owners_[v] = *std::min_element(around(v).begin(), around(v).end(), key);
        Triangle& owner = triangles_[owners_[v]];
        for (int k = 0; k < 3; ++k)
            if (owner.vertex[k] == v) owner.owns |= static_cast<std::uint8_t>(8u << k);
    }
}

bool TriangleScene::move_vertices(std::span<const double> vertices) {
    if (vertices.size() != 3 * source_to_vertex_.size()) return false;
    bool all_acceptable = true;
    for (const double coordinate : vertices)
        all_acceptable &= acceptable(coordinate);
    if (!all_acceptable) return false;
    Float4 farthest{}, largest{};
    for (std::size_t v = 0; v < source_to_vertex_.size(); ++v) {
        const double* p = &vertices[3 * v];
        const std::uint32_t to = source_to_vertex_[v];
        vertices_[to] = {p[0], p[1], p[2]};
        const Float4 now{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), 0.0f};
        const Float4 way = now - load4(rounded_[to]);
        farthest = more(farthest, more(way, -way));
        largest = more(largest, more(now, -now));
        rounded_[to] = {now[0], now[1], now[2], 0.0f};
    }
    // Single precision errs by 2^-24 of the coordinates at either end of the way; twice that is left.
    const auto length = [](Float4 v) { return norm(Vec3{v[0], v[1], v[2]}); };
    moved_ += (1 + 1e-6) * length(farthest) + 3e-7 * length(largest);
    tree_.refit([this](std::uint32_t leaf) { return leaf_box(leaf); });
    faces_.clear();
    version_ = next_version();
    return true;
}

// Rounding to float is monotonous: the least of rounded coordinates, rounded down once more, bounds the exact
// ones.
Box TriangleScene::leaf_box(std::uint32_t leaf) const {
    const auto load = [&](std::uint32_t v) { return load4(rounded_[v]); };
    const std::uint32_t first = tree_.leaf_begin(leaf), last = tree_.leaf_begin(leaf + 1);
    Float4 lo = load(corners_[first][0]), hi = lo;
    for (std::uint32_t i = first; i < last; ++i) {
        const Float4 a = load(corners_[i][0]), b = load(corners_[i][1]), c = load(corners_[i][2]);
        lo = less(less(lo, a), less(b, c));
        hi = more(more(hi, a), more(b, c));
    }
    Box box;
    for (int k = 0; k < 3; ++k) {
        box.lo[k] = rounded_down(lo[k]);
        box.hi[k] = rounded_up(hi[k]);
    }
    return box;
}

} // namespace calot::geometry
