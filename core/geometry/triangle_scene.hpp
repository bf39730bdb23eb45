// The surfaces of several organs merged into one scene of triangles under one hierarchy.
//
// Organs are closed solids, triangles counter-clockwise seen from outside. Open surfaces are accepted (plates
// in tests); only their front side is touched. Immutable once built, except through move_vertices; const
// functions may be called from any number of threads at once.
#pragma once

#include "geometry/bvh.hpp"
#include "geometry/vec3.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace calot::geometry {

// One organ's surface, in the caller's memory; read during build only.
struct OrganSurface {
    std::string_view name;                    // for messages
    std::span<const double> vertices;         // 3 V: x y z of each vertex, m, world LPS
    std::span<const std::uint32_t> triangles; // 3 T: vertex indices
    std::span<const std::uint32_t> regions;   // T, or empty: region 0 throughout
    std::span<const double> friction;         // Coulomb coefficient by region, or one for all; empty: 0
};

class TriangleScene {
  public:
    static constexpr std::size_t most_organs = 256;
    static constexpr std::size_t most_triangles = 1'000'000;
    static constexpr std::uint32_t none = 0xffffffffu;

    struct Triangle {
        std::array<std::uint32_t, 3> vertex; // into vertices()
        std::array<std::uint32_t, 3> edge;   // into edges(); edge k joins vertices k and (k + 1) % 3
        std::uint32_t organ, region;
        std::uint32_t id;  // index in the organ, as given
        std::uint32_t key; // rank in the order in which organs and triangles were given: breaks ties
        // Every edge and vertex belongs to one of its triangles, the one given first: bits 0-2 its own edges,
        // bits 3-5 its own vertices. Whoever visits parts by triangle meets each part once.
        std::uint8_t owns;
    };

    struct Edge {
        std::array<std::uint32_t, 2> vertex; // ends
        std::array<std::uint32_t, 2>
            triangle; // positions of the triangles it joins; second `none` at a border
        std::array<std::uint32_t, 2> opposite; // the vertex of each that is not on the edge
    };

    // What may be touched from outside, in single precision and packed by leaf, for quick refusals that leave
    // a margin of screen_tolerance(): the decision is always the double precision's.
    struct alignas(32) FaceBlock {     // of one leaf, lane by lane; unused lanes lie infinitely deep
        float normal[3][8], offset[8]; // height over the plane: normal . p - offset
        float inward[3][3][8], inward_offset[3][8]; // of edge k, in the plane: likewise
    };
    struct alignas(
        32) EdgeBlock { // up to eight convex edges of one leaf, lane by lane; unused lanes pass nothing
        float start[3][8], along[3][8],
            length[8]; // along: unit, so turned that along x inward0 is the face's normal
        float inward0[3][8], inward1[3][8]; // unit, in the planes of its faces; 0 where there is none
        float tilt[8]; // allowed to segments, rad; negative: turns by more than 90 degrees
        std::uint32_t edge[8];
    };

    struct alignas(32) SalientVertex { // one that can be nearest to something outside
        float away[3][8];              // unit, towards up to eight of its neighbours; 0 in unused lanes
        float place[3];
        std::uint32_t vertex;
    };
    // Whatever touches a leaf's parts from outside is not below this plane: the directions from which its
    // faces, convex edges and salient vertices are touched all lead upwards. No normal: nothing is known.
    struct LeafPlane {
        float normal[3], lowest; // of all that is in the leaf
    };

    TriangleScene() = default;

    // Merges the organs; vertices of one organ with identical coordinates become one, so that meshes split at
    // seams for drawing are whole again. Triangles without area are left out (skipped_triangles()).
    // Throws std::invalid_argument with the organ's name and the index of what is wrong: spans of wrong size,
    // indices out of range, coordinates that are not finite or beyond 1 km, negative or non-finite friction,
    // a region without friction, too many organs or triangles.
    explicit TriangleScene(std::span<const OrganSurface> organs);

    // Moves the vertices (3 V for all organs in the order given to build, as they were given) and refits the
    // tree. Neither allocates nor checks for degenerate triangles: they are handled by every query.
    // Returns false, and changes nothing, when the size is wrong or a coordinate is not finite or beyond 1
    // km.
    bool move_vertices(std::span<const double> vertices);

    // Another number for any other content, within this process: candidates kept for another are void.
    std::uint64_t version() const { return version_; }
    // How far, m, its vertices have moved at most since it was built, all ways added up; and the number that
    // tells its surface from any other's, a copy's too, however it moves.
    double moved() const { return moved_; }
    std::uint64_t surface() const { return surface_.number; }

    bool empty() const { return triangles_.empty(); }
    std::size_t organ_count() const { return friction_.size(); }
    std::size_t skipped_triangles() const { return skipped_; }
    // Edges that more than two triangles share; contact directions there consider the first two only.
    std::size_t irregular_edges() const { return irregular_edges_; }

    // Triangles, in the order of the tree's leaves ("positions").
    std::span<const Triangle> triangles() const { return triangles_; }
    std::span<const Vec3> vertices() const { return vertices_; }
    // Edges, in an order that does not depend on the tree.
    std::span<const Edge> edges() const { return edges_; }
    // Positions of the triangles around a vertex, ascending.
    std::span<const std::uint32_t> around(std::uint32_t vertex) const {
        return std::span(fans_).subspan(fan_starts_[vertex], fan_starts_[vertex + 1] - fan_starts_[vertex]);
    }
    double friction(const Triangle& triangle) const {
        const auto& table = friction_[triangle.organ];
        return table[triangle.region < table.size() ? triangle.region : 0];
    }
    Vec3 corner(const Triangle& triangle, int k) const { return vertices_[triangle.vertex[k]]; }
    // The triangle that owns a vertex; none for one that no triangle uses.
    std::uint32_t owner(std::uint32_t vertex) const { return owners_[vertex]; }
    const Bvh& tree() const { return tree_; }

    // Screens exist until vertices are moved: of moving surfaces candidates screen what is near for
    // themselves.
    bool has_screens() const { return !faces_.empty(); }
    const FaceBlock& faces(std::uint32_t leaf) const { return faces_[leaf]; }
    std::span<const EdgeBlock> convex_edges(std::uint32_t leaf) const {
        return std::span(edge_blocks_).subspan(leaf_edges_[leaf], leaf_edges_[leaf + 1] - leaf_edges_[leaf]);
    }
    // By the leaf of their owner.
    std::span<const SalientVertex> salient_vertices(std::uint32_t leaf) const {
        return std::span(leaf_vertices_)
            .subspan(leaf_vertex_begins_[leaf], leaf_vertex_begins_[leaf + 1] - leaf_vertex_begins_[leaf]);
    }
    const LeafPlane& plane(std::uint32_t leaf) const { return leaf_planes_[leaf]; }
    // Asks the processor for what belongs to a leaf.
    void prefetch(std::uint32_t leaf) const {
        const auto ask = [](const auto& block) {
            for (std::size_t at = 0; at < sizeof block; at += 64)
                __builtin_prefetch(reinterpret_cast<const std::byte*>(&block) + at);
        };
        ask(faces_[leaf]);
        for (const EdgeBlock& edges : convex_edges(leaf))
            ask(edges);
        for (const SalientVertex& vertex : salient_vertices(leaf))
            ask(vertex);
    }
    bool is_salient(std::uint32_t vertex) const { return salient_[vertex]; }
    float screen_tolerance() const { return screen_tolerance_; }

  private:
    void add_organ(const OrganSurface& organ);
    void sort_into_leaves();
    void find_edges();
    void find_fans();
    void make_screens();
    Box leaf_box(std::uint32_t leaf) const;

    std::vector<Triangle> triangles_;
    std::vector<Vec3> vertices_;
    std::vector<std::uint32_t> source_to_vertex_; // vertices as given -> merged
    std::vector<Edge> edges_;
    std::vector<std::uint32_t> fan_starts_, fans_, owners_;
    std::vector<std::vector<double>> friction_; // [organ][region]
    // A copy moves on its own: it gets a number of its own.
    struct Surface {
        std::uint64_t number = 0;
        Surface() = default;
        Surface(const Surface&);
        Surface(Surface&&) = default;
        Surface& operator=(const Surface&);
        Surface& operator=(Surface&&) = default;
    };
    Bvh tree_;
    Surface surface_;
    double moved_ = 0;
    std::uint64_t version_ = 0;
    std::size_t skipped_ = 0, irregular_edges_ = 0;

    // What moving touches, small: triangles' vertices by position, and the vertices in single precision.
    struct alignas(16) Vertex4 {
        float x, y, z, unused;
    };
    std::vector<std::array<std::uint32_t, 3>> corners_;
    std::vector<Vertex4> rounded_;

    std::vector<FaceBlock> faces_;
    std::vector<EdgeBlock> edge_blocks_;
    std::vector<std::uint32_t> leaf_edges_, leaf_vertex_begins_;
    std::vector<SalientVertex> leaf_vertices_;
    std::vector<LeafPlane> leaf_planes_;
    std::vector<bool> salient_;
    float screen_tolerance_ = 0;
};

// The nearest point of the scene to p not farther than `reach`.
struct NearestPoint {
    std::uint32_t position = TriangleScene::none; // into triangles(); none: nothing within reach
    Vec3 point;
    double distance = 0;

    explicit operator bool() const { return position != TriangleScene::none; }
};

// Ties go to the triangle given first. A p that is not finite finds nothing. No allocation; any thread.
NearestPoint nearest_point(const TriangleScene& scene, Vec3 p, double reach);

// How many times each organ's surface winds around p (1: inside a closed solid oriented outwards, 0:
// outside), written to `winding` by organ index, organs past its size ignored. Exact crossing parity along a
// ray, retried in other directions while a crossing is too close to an edge to call; only closed organs have
// a meaning. Returns false for a p that is not finite. No allocation; any thread.
bool winding_numbers(const TriangleScene& scene, Vec3 p, std::span<int> winding);

// Index of the first organ whose solid contains p, or TriangleScene::none.
std::uint32_t organ_containing(const TriangleScene& scene, Vec3 p);

} // namespace calot::geometry
