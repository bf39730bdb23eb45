// What colonoscopy relies on in the checked-in colon: a whole mesh, a way to the caecum, folds to find.
#include "test_geometry.hpp"

#include <calot/meshio/check.hpp>
#include <calot/meshio/read.hpp>
#include <calot/meshio/sha256.hpp>
#include <calot/meshio/write.hpp>

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

namespace {

using namespace calot::meshio;

const std::filesystem::path folder = std::filesystem::path(CALOT_SOURCE_DIR) / "assets/anatomy/colon";
constexpr double colonoscope_radius = 0.0064; // m

/// Distance from p along the unit vector `d` to the first triangle, or infinity.
double ray(const TriangleMesh& mesh, const Vec3& p, const Vec3& d) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - p, e1 = mesh.vertices[t[1]] - mesh.vertices[t[0]],
                   e2 = mesh.vertices[t[2]] - mesh.vertices[t[0]];
        const Vec3 n = cross(e1, e2);
        const double slope = dot(n, d);
        if (slope == 0) continue;
        const double at = dot(n, a) / slope;
        if (at < 0 || at > nearest) continue;
        const Vec3 hit = at * d - a;
        const double nn = dot(n, n), u = dot(cross(hit, e2), n) / nn, v = dot(cross(e1, hit), n) / nn;
        if (u >= 0 && v >= 0 && u + v <= 1) nearest = at;
    }
    return nearest;
}

class Colon : public testing::Test {
  protected:
    toml::table list = toml::parse_file((folder / "anatomy.toml").string());
    TriangleMesh wall = read_mesh(folder / "colon.glb");
    std::vector<Vec3> path = [this] {
        std::vector<Vec3> points;
        for (auto& p : *list["landmark"]["path"]["points"].as_array())
            points.push_back(vec(toml::node_view<toml::node>(p)));
        return points;
    }();
    double length_to(std::size_t end) const {
        double sum = 0;
        for (std::size_t i = 0; i < end; ++i)
            sum += norm(path[i + 1] - path[i]);
        return sum;
    }
};

TEST_F(Colon, is_the_closed_outward_boundary_of_a_wall) {
    const MeshReport r = check(wall);
    EXPECT_EQ(r.problem(), "");
    EXPECT_LE(r.triangles, 45'000u);
}

TEST_F(Colon, was_made_from_the_description_beside_it) {
    std::string made_from;
    for (const auto& [key, value] : read_glb_extras(folder / "colon.glb"))
        if (key == "description_sha256") made_from = value;
    EXPECT_EQ(made_from, sha256_file(folder / "colon.toml")) << "mesh it again with calot-mesher";
}

TEST_F(Colon, is_as_long_as_a_colon) {
    const double length = length_to(path.size() - 1);
    EXPECT_GE(length, 1.2) << "m, facts.tsv colon.length";
    EXPECT_LE(length, 1.5) << "m";
}

TEST_F(Colon, lets_the_endoscope_pass_to_the_caecum) {
    for (std::size_t i = 0; i < path.size(); ++i) {
        if (i + 1 < path.size()) {
            EXPECT_LE(norm(path[i + 1] - path[i]), 0.010) << "after point " << i;
        }
        EXPECT_GE(clearance(wall, path[i]), colonoscope_radius) << "m, of point " << i;
        EXPECT_FALSE(inside(wall, path[i])) << "point " << i << " lies in the wall";
    }
}

TEST_F(Colon, bends_no_tighter_than_the_endoscope_can) {
    for (std::size_t i = 2; i + 2 < path.size(); ++i) { // the circle through three points, 32 mm apart
        const Vec3 a = path[i] - path[i - 2], b = path[i + 2] - path[i];
        const double area = norm(cross(a, b));
        if (area < 1e-9) continue;
        EXPECT_GE(norm(a) * norm(b) * norm(path[i + 2] - path[i - 2]) / (2 * area), 0.025)
            << "bend radius in m at point " << i << "; facts.tsv endoscope.min_bend_radius";
    }
}

TEST_F(Colon, opens_where_the_guide_stands_and_points) {
    const Vec3 guide = vec(list["landmark"]["guide"]["position"]),
               direction = vec(list["landmark"]["guide"]["direction"]);
    EXPECT_NEAR(norm(direction), 1, 1e-3);
    EXPECT_LT(norm(path[0] - guide), 1e-3);
    EXPECT_GT(dot(direction, path[1] - path[0]) / norm(path[1] - path[0]), 0.99);
    EXPECT_EQ(ray(wall, guide, -1 * direction), std::numeric_limits<double>::infinity())
        << "nothing lies before the anus";
}

// From the axis to the wall along the transverse colon, in twelve directions: each fold is a dip where its
// third of the circumference is looked at, and there is none on a taenia.
TEST_F(Colon, has_half_moon_folds_between_taeniae) {
    constexpr double from = 0.76, to = 1.05; // m along the path
    std::vector<std::size_t> dips;
    for (int direction = 0; direction < 12; ++direction) {
        Vec3 side{};
        std::vector<double> depth;
        for (std::size_t i = 1; i + 1 < path.size(); ++i) {
            const Vec3 d = (1 / norm(path[i + 1] - path[i - 1])) * (path[i + 1] - path[i - 1]);
            if (i == 1) {
                const Vec3 any = cross(d, Vec3{1, 0, 0}), u = (1 / norm(any)) * any, v = cross(d, u);
                const double angle = std::numbers::pi * direction / 6;
                side = std::cos(angle) * u + std::sin(angle) * v;
            } else { // carried along without twist
                side = side - dot(side, d) * d;
                side = (1 / norm(side)) * side;
            }
            const double at = length_to(i);
            if (at < from || at > to) continue;
            for (int k = 0; k < 4; ++k)
                depth.push_back(ray(wall, path[i] + (0.25 * k) * (path[i + 1] - path[i]), side));
        }
        std::size_t count = 0;
        for (std::size_t i = 5; i + 5 < depth.size(); ++i) { // 2 mm apart
            const double before = *std::max_element(depth.begin() + i - 5, depth.begin() + i),
                         after = *std::max_element(depth.begin() + i + 1, depth.begin() + i + 6);
            if (std::min(before, after) - depth[i] > 0.004) ++count, i += 5;
        }
        dips.push_back(count);
    }
    std::sort(dips.begin(), dips.end());
    EXPECT_LE(dips.front(), 1u) << "folds of 4 mm and more across a taenia";
    const double apart = (to - from) / static_cast<double>(dips.back());
    EXPECT_GE(apart, 0.030) << dips.back()
                            << " folds of 4 mm and more; m between two, facts.tsv colon.fold_spacing";
    EXPECT_LE(apart, 0.045) << dips.back() << " folds of 4 mm and more; m between two";
}

} // namespace
