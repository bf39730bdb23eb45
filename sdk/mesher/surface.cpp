#include "surface.hpp"

#include "ordered_memory.hpp"

#define CGAL_ALLOCATOR(T) calot::mesher::OrderedAllocator<T> // before CGAL's own

#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/IO/facets_in_complex_2_to_triangle_mesh.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/Surface_mesher/Standard_criteria.h>
#include <CGAL/make_surface_mesh.h>

#include <algorithm>

namespace calot::mesher {
namespace {

using Triangulation = CGAL::Surface_mesh_default_triangulation_3;
using Complex = CGAL::Complex_2_in_triangulation_3<Triangulation>;
using Traits = Triangulation::Geom_traits;
using Point = Traits::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

Vec vec(const Point& p) {
    return {p.x(), p.y(), p.z()};
}

struct Field {
    const SurfaceRequest* request;
    using FT = Traits::FT;
    using Point = Traits::Point_3;
    FT operator()(const Point& p) const { return request->field(vec(p)); }
};

using Criterion = CGAL::Surface_mesher::Refine_criterion<Triangulation>;

/// A facet is bad where its surface ball is larger, or its centre farther from the surface, than asked for
/// there.
class LocalCriterion final : public Criterion {
  public:
    LocalCriterion(const SurfaceRequest& request, const Triangulation& triangulation)
        : request_(request), triangulation_(triangulation) {}
    bool is_bad(const Facet& f, Quality& quality) const override {
        if (triangulation_.number_of_vertices() > request_.most_points)
            throw SurfaceError(
                "needs more than " + std::to_string(request_.most_points) +
                " points: raise 'edge' or 'deviation', soften the relief, or raise 'triangles'");
        const Point& a = f.first->vertex((f.second + 1) & 3)->point();
        const Point& b = f.first->vertex((f.second + 2) & 3)->point();
        const Point& c = f.first->vertex((f.second + 3) & 3)->point();
        const Point centre = f.first->get_facet_surface_center(f.second);
        const double radius =
            request_.edge(vec(centre)) / 1.7320508; // circumradius of an equilateral triangle
        const double deviation = request_.deviation(vec(centre));
        const double size = radius * radius / CGAL::squared_distance(a, centre);
        const double off = CGAL::squared_distance(CGAL::circumcenter(a, b, c), centre);
        quality = off > 0 ? std::min(size, deviation * deviation / off) : size;
        return quality < 1;
    }

  private:
    const SurfaceRequest& request_;
    const Triangulation& triangulation_;
};

class Criteria {
  public:
    using Facet = Triangulation::Facet;
    using Standard = CGAL::Surface_mesher::Standard_criteria<Criterion>;
    using Quality = Standard::Quality;

    Criteria(const SurfaceRequest& request, const Triangulation& triangulation)
        : shape_(25), local_(request, triangulation), standard_({&shape_, &local_}) {}
    bool is_bad(const Facet& f, Quality& q) const { return standard_.is_bad(f, q); }

  private:
    CGAL::Surface_mesher::Aspect_ratio_criterion<Triangulation> shape_;
    LocalCriterion local_;
    Standard standard_;
};

Mesh to_mesh(const Surface& surface) {
    Mesh mesh;
    std::vector<Mesh::Vertex_index> at;
    for (const Vec& p : surface.points)
        at.push_back(mesh.add_vertex({p.x, p.y, p.z}));
    for (const auto& t : surface.triangles)
        if (mesh.add_face(at[t[0]], at[t[1]], at[t[2]]) == Mesh::null_face())
            throw SurfaceError("the triangles do not join to a surface");
    return mesh;
}

/// The mesh with vertices sorted by position and triangles by their corners: CGAL numbers both by the
/// addresses they happened to have in memory.
Surface in_order(const Mesh& mesh) {
    std::vector<Mesh::Vertex_index> order(mesh.vertices().begin(), mesh.vertices().end());
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return mesh.point(a) < mesh.point(b); });
    Surface surface;
    std::vector<std::uint32_t> number(mesh.num_vertices());
    for (const auto v : order) {
        number[v] = static_cast<std::uint32_t>(surface.points.size());
        surface.points.push_back(vec(mesh.point(v)));
    }
    for (const auto f : mesh.faces()) {
        auto h = mesh.halfedge(f);
        std::array<std::uint32_t, 3> t{};
        for (auto& corner : t) {
            corner = number[mesh.target(h)];
            h = mesh.next(h);
        }
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        surface.triangles.push_back(t);
    }
    std::sort(surface.triangles.begin(), surface.triangles.end());
    return surface;
}

} // namespace

Surface extract_surface(const SurfaceRequest& request) {
    const Vec centre = 0.5 * (request.bounds.low + request.bounds.high);
    const double radius = 0.5 * norm(request.bounds.high - request.bounds.low) + 10;
    Triangulation triangulation;
    Complex complex(triangulation);
    const CGAL::Implicit_surface_3<Traits, Field> implicit(
        Field{&request}, Traits::Sphere_3({centre.x, centre.y, centre.z}, radius * radius), 1e-4 / radius);
    for (const Vec& p : request.seeds)
        triangulation.insert(Point(p.x, p.y, p.z));
    CGAL::make_surface_mesh(complex, implicit, Criteria(request, triangulation), CGAL::Manifold_tag(), 0);

    Mesh mesh;
    CGAL::facets_in_complex_2_to_triangle_mesh(complex, mesh);
    if (!CGAL::is_closed(mesh)) throw SurfaceError("the surface came out open: refine 'edge'");
    CGAL::Polygon_mesh_processing::orient_to_bound_a_volume(mesh);
    return in_order(mesh);
}

std::size_t self_intersections(const Surface& surface) {
    const Mesh mesh = to_mesh(surface);
    std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
    CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(pairs));
    return pairs.size();
}

} // namespace calot::mesher
