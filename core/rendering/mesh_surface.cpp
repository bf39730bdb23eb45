#include "rendering/mesh_surface.hpp"

namespace calot::rendering {
namespace {

std::array<float, 3> to_floats(const meshio::Vec3& v) {
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

} // namespace

Surface to_surface(const meshio::TriangleMesh& mesh,
                   const std::function<std::string(const std::string&)>& appearance_of) {
    Surface s;
    s.name = mesh.name;
    s.vertices.reserve(mesh.vertices.size());
    s.normals.reserve(mesh.normals.size());
    s.colours.reserve(mesh.colours.size());
    s.triangle_appearance.reserve(mesh.region.size());
    for (const auto& v : mesh.vertices)
        s.vertices.push_back(to_floats(v));
    for (const auto& n : mesh.normals)
        s.normals.push_back(to_floats(n));
    for (const auto& c : mesh.colours)
        s.colours.push_back({255, 255, 255, c[0]});
    s.triangles = mesh.triangles;
    if (mesh.region.empty()) {
        s.appearance = appearance_of(mesh.region_names.empty() ? std::string() : mesh.region_names.front());
        return s;
    }
    std::vector<std::string> looks;
    looks.reserve(mesh.region_names.size());
    for (const std::string& region : mesh.region_names)
        looks.push_back(appearance_of(region));
    for (const std::uint16_t region : mesh.region)
        s.triangle_appearance.push_back(region < looks.size() ? looks[region] : appearance_of(std::string()));
    return s;
}

} // namespace calot::rendering
