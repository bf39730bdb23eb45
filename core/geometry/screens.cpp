#include "geometry/near_segment.hpp"
#include "geometry/surface_minima.hpp"
#include "geometry/triangle_scene.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace calot::geometry {
namespace {

void set_lane(float (&to)[3][8], std::uint32_t lane, Vec3 v) {
    for (int k = 0; k < 3; ++k)
        to[k][lane] = static_cast<float>(v[k]);
}

TriangleScene::EdgeBlock no_edges() {
    TriangleScene::EdgeBlock block{};
    std::fill_n(block.length, 8, -std::numeric_limits<float>::infinity());
    return block;
}

// The directions from which the parts of a leaf may be touched, each part's spanned by some.
class Directions {
  public:
    void clear() { all_.clear(), sum_ = {}, are_known_ = true; }
    void add(Vec3 unit) { all_.push_back(unit), sum_ = sum_ + unit; }
    void lose() { are_known_ = false; }

    // What all of them lead along, by a margin that covers the tilt up to which segments touch sharp rims;
    // nothing, if there is nothing of that kind.
    Vec3 upward() const {
        constexpr double least_rise = 2 * detail::rim_tilt;
        const Vec3 up = detail::unit_or_zero(sum_);
        const bool all_rise =
            std::all_of(all_.begin(), all_.end(), [&](Vec3 d) { return dot(d, up) > least_rise; });
        return are_known_ && all_rise ? up : Vec3{};
    }

  private:
    std::vector<Vec3> all_;
    Vec3 sum_;
    bool are_known_ = true;
};

// Do the triangles around a vertex close the circle, each edge joining two?
bool is_surrounded(const TriangleScene& scene, std::uint32_t vertex) {
    const auto count = [&](std::uint32_t neighbour) {
        std::size_t times = 0;
        for (const std::uint32_t position : scene.around(vertex))
            times += std::ranges::count(scene.triangles()[position].vertex, neighbour);
        return times;
    };
    for (const std::uint32_t position : scene.around(vertex))
        for (const std::uint32_t other : scene.triangles()[position].vertex)
            if (other != vertex && count(other) != 2) return false;
    return true;
}

// Can the vertex be nearest to any point in front? The directions it is nearest to form a cone, polar to the
// edges that leave it; if there is one, some cross products of two of these edges span it.
bool salient(const TriangleScene& scene, std::uint32_t vertex, Directions& directions) {
    using namespace detail;
    constexpr std::size_t most_edges = 32; // above: not worth asking
    constexpr double tolerance = 1e-6;
    std::array<Vec3, most_edges> away;
    const auto uncertain = [&] {
        directions.lose();
        return true;
    };
    std::size_t count = 0;
    const Vec3 v = scene.vertices()[vertex];
    for (const std::uint32_t position : scene.around(vertex))
        for (const std::uint32_t other : scene.triangles()[position].vertex) {
            const Vec3 w = unit_or_zero(scene.vertices()[other] - v);
            if (other == vertex || std::find(away.begin(), away.begin() + count, w) != away.begin() + count)
                continue;
            if (count == most_edges) return uncertain();
            away[count++] = w;
        }
    const auto leads_off = [&](Vec3 d) {
        return std::all_of(away.begin(), away.begin() + count,
                           [&](Vec3 w) { return dot(d, w) <= tolerance; });
    };
    const Vec3 outward = vertex_outward(scene, vertex);
    bool is_salient = false, is_straight = false, is_behind = false;
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t j = 0; j < i; ++j) {
            Vec3 d = cross(away[i], away[j]);
            if (norm(d) < 1e-3) {
                if (dot(away[i], away[j]) > 0.0) return uncertain(); // folded
                is_straight = true; // the cone is flat, and spanned by what other edges have with these
                continue;
            }
            d = (dot(d, outward) < 0.0 ? -1.0 : 1.0) / norm(d) * d;
            if (leads_off(d)) {
                directions.add(d);
                is_salient = true;
            } else if (leads_off(-d)) {
                is_behind = true;
            }
        }
    if (is_straight && !is_salient) return uncertain();
    // A corner that is turned inside out, or open.
    if (is_salient && (is_behind || !is_surrounded(scene, vertex))) directions.lose();
    return is_salient;
}

TriangleScene::SalientVertex salient_vertex(const TriangleScene& scene, std::uint32_t vertex) {
    TriangleScene::SalientVertex result{};
    const Vec3 v = scene.vertices()[vertex];
    result.vertex = vertex;
    for (int k = 0; k < 3; ++k)
        result.place[k] = static_cast<float>(v[k]);
    std::array<std::uint32_t, 8> neighbours;
    std::uint32_t count = 0;
    for (const std::uint32_t position : scene.around(vertex))
        for (const std::uint32_t other : scene.triangles()[position].vertex) {
            const auto end = neighbours.begin() + count;
            if (count == neighbours.size() || other == vertex ||
                std::find(neighbours.begin(), end, other) != end)
                continue;
            neighbours[count] = other;
            set_lane(result.away, count++, detail::unit_or_zero(scene.vertices()[other] - v));
        }
    return result;
}

} // namespace

void TriangleScene::make_screens() {
    using namespace detail;
    const std::uint32_t leaves = tree_.leaf_count();
    double farthest = 0.0;
    for (const Vec3& v : vertices_)
        farthest = std::max({farthest, std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
    if (farthest > 10.0) return; // single precision is too coarse
    // Offsets and points err by 2^-24 of their size each, products add as much again; 10 um are left for thin
    // triangles, whose planes are the less certain the thinner they are.
    screen_tolerance_ = static_cast<float>(1e-5 + 1e-6 * farthest);

    faces_.resize(leaves);
    salient_.assign(vertices_.size(), false);
    leaf_edges_.assign(1, 0);
    leaf_vertex_begins_.assign(1, 0);
    leaf_planes_.resize(leaves);
    Directions directions;
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
        FaceBlock& block = faces_[leaf];
        block = {};
        std::fill_n(block.offset, 8, std::numeric_limits<float>::infinity());
        const std::uint32_t first = tree_.leaf_begin(leaf);
        std::uint32_t edge_count = 0;
        directions.clear();
        for (std::uint32_t i = first; i < tree_.leaf_begin(leaf + 1); ++i) {
            const Triangle& t = triangles_[i];
            const std::uint32_t lane = i - first;
            const Vec3 a = corner(t, 0), n = cross(corner(t, 1) - a, corner(t, 2) - a);
            const double area = norm(n);
            const double longest2 = std::max(
                {norm2(corner(t, 1) - a), norm2(corner(t, 2) - corner(t, 1)), norm2(a - corner(t, 2))});
            block.offset[lane] = 0.0f;
            if (area > 1e-6 * longest2) { // thinner ones pass every screen
                const Vec3 unit = (1.0 / area) * n;
                directions.add(unit);
                set_lane(block.normal, lane, unit);
                block.offset[lane] = static_cast<float>(dot(unit, a));
                for (int k = 0; k < 3; ++k) {
                    const Vec3 m = cross(unit, corner(t, (k + 1) % 3) - corner(t, k));
                    const Vec3 inward = (1.0 / norm(m)) * m;
                    set_lane(block.inward[k], lane, inward);
                    block.inward_offset[k][lane] = static_cast<float>(dot(inward, corner(t, k)));
                }
            } else {
                directions.lose();
            }
            for (int k = 0; k < 3; ++k) {
                if ((t.owns >> (3 + k) & 1) && salient(*this, t.vertex[k], directions)) {
                    leaf_vertices_.push_back(salient_vertex(*this, t.vertex[k]));
                    salient_[t.vertex[k]] = true;
                }
                if (!(t.owns >> k & 1)) continue;
                const Edge& edge = edges_[t.edge[k]];
                const EdgeFrame frame = edge_frame(*this, edge);
                if (!frame.convex) continue;
                if (edge_count % 8 == 0) edge_blocks_.push_back(no_edges());
                EdgeBlock& to = edge_blocks_.back();
                const std::uint32_t at = edge_count++ % 8;
                const double length = norm(frame.along);
                const Vec3 n0 = area_vector(*this, edge.triangle[0]);
                const bool turned = dot(cross(frame.along, frame.inward0), n0) < 0.0;
                set_lane(to.start, at, turned ? frame.start + frame.along : frame.start);
                set_lane(to.along, at, ((turned ? -1.0 : 1.0) / length) * frame.along);
                to.length[at] = static_cast<float>(length);
                // Towards a face that is hardly there nothing is refused.
                const auto unit_or_none = [&](Vec3 m) {
                    return norm(m) > 1e-6 * length ? (1.0 / norm(m)) * m : Vec3{};
                };
                set_lane(to.inward0, at, unit_or_none(frame.inward0));
                set_lane(to.inward1, at, unit_or_none(frame.inward1));
                // From its one face's side a border is touched from anywhere.
                if (edge.triangle[1] == none) directions.lose();
                for (const std::uint32_t position : edge.triangle)
                    if (position != none) directions.add(unit_or_zero(area_vector(*this, position)));
                const bool blunt =
                    edge.triangle[1] != none && dot(n0, area_vector(*this, edge.triangle[1])) > 0.0;
                to.tilt[at] = static_cast<float>(blunt ? frame.tilt : -frame.tilt);
                to.edge[at] = t.edge[k];
            }
        }
        const Vec3 up = directions.upward();
        LeafPlane& plane = leaf_planes_[leaf];
        for (int k = 0; k < 3; ++k)
            plane.normal[k] = static_cast<float>(up[k]);
        double lowest = std::numeric_limits<double>::infinity();
        for (std::uint32_t i = first; i < tree_.leaf_begin(leaf + 1); ++i)
            for (int k = 0; k < 3; ++k)
                lowest = std::min(lowest, detail::height_over(plane, corner(triangles_[i], k)));
        plane.lowest = rounded_down(lowest);
        leaf_edges_.push_back(static_cast<std::uint32_t>(edge_blocks_.size()));
        leaf_vertex_begins_.push_back(static_cast<std::uint32_t>(leaf_vertices_.size()));
    }
}

} // namespace calot::geometry
