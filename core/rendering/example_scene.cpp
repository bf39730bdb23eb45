#include "rendering/example_scene.hpp"

#include "rendering/linear.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::rendering {
namespace {
constexpr double kTau = 2 * std::numbers::pi;
double smooth(double a, double b, double x) {
    const double t = std::clamp((x - a) / (b - a), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}
} // namespace

Surface swept_surface(const std::string& name, const std::function<Vec3(double)>& axis,
                      const std::function<double(double, double)>& radius, int along, int around) {
    Surface s;
    s.name = name;
    Eigen::Vector3d x(1, 0, 0);
    for (int i = 0; i <= along; ++i) {
        const double t = static_cast<double>(i) / along;
        const Eigen::Vector3d p = to_eigen(axis(t));
        const Eigen::Vector3d z =
            (to_eigen(axis(std::min(t + 1e-3, 1.0))) - to_eigen(axis(std::max(t - 1e-3, 0.0)))).normalized();
        x = (x - z * z.dot(x)).normalized();
        const Eigen::Vector3d y = z.cross(x);
        for (int k = 0; k < around; ++k) {
            const double angle = kTau * k / around;
            const Eigen::Vector3d v = p + radius(t, angle) * (std::cos(angle) * x + std::sin(angle) * y);
            s.vertices.push_back(
                {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
        }
    }
    for (int i = 0; i < along; ++i)
        for (int k = 0; k < around; ++k) {
            const auto at = [&](int row, int column) {
                return static_cast<std::uint32_t>(row * around + column % around);
            };
            s.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k)});
            s.triangles.push_back({at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)});
        }
    return s;
}

Surface ball(const std::string& name, const Vec3& centre, double radius, int rings) {
    return swept_surface(
        name,
        [&](double t) {
            return Vec3{centre[0], centre[1], centre[2] - radius * std::cos(t * kTau / 2)};
        },
        [&](double t, double) { return radius * std::max(std::sin(t * kTau / 2), 1e-4); }, rings, 2 * rings);
}

ExampleScene make_example_scene(int triangles) {
    ExampleScene scene;
    const int n = std::max(12, static_cast<int>(std::sqrt(triangles * 0.7 / 4)));
    const auto axis = [](double t) {
        // Down the gullet, then left and forward through the body, ending in the antrum on the right.
        const double u = smooth(0.35, 1.0, t);
        return Vec3{0.01 + 0.055 * std::sin(u * 2.6), -0.02 - 0.06 * smooth(0.4, 0.75, t),
                    0.16 - 0.20 * t + 0.03 * smooth(0.8, 1.0, t)};
    };
    const auto radius = [](double t, double angle) {
        const double gullet =
            0.0095 * (1 + 0.10 * std::cos(5 * angle + 9 * t)) * (1 + 0.06 * std::sin(60 * t));
        const double body = 0.034 + 0.004 * std::sin(3 * t + angle);
        const double rugae =
            0.0032 * (1 - smooth(0.75, 0.95, t)) *
            std::pow(0.5 + 0.5 * std::sin(11 * angle + 2.2 * std::sin(14 * t) + 1.3 * std::sin(31 * t)), 2.0);
        const double mix = smooth(0.36, 0.52, t);
        return std::max(1e-4, ((1 - mix) * gullet + mix * (body - rugae)) *
                                  std::sqrt(std::max(0.0, 1 - std::pow(t, 14))));
    };
    Surface stomach = swept_surface("stomach", axis, radius, 2 * n, 2 * n);
    stomach.appearance = "serosa";
    stomach.inner_appearance = "mucosa-stomach";
    scene.surfaces.push_back(std::move(stomach));

    const int m = std::max(6, static_cast<int>(std::sqrt(triangles * 0.15 / 4)));
    Surface liver = ball("liver", {0, 0, 0}, 1, m);
    for (auto& v : liver.vertices) {
        const float lobe = 1 + 0.25f * std::tanh(-3 * v[0]);
        v = {-0.075f + 0.075f * v[0], -0.045f + 0.045f * lobe * v[1],
             0.075f + 0.045f * lobe * v[2] - 0.1f * v[0] * 0.2f};
    }
    liver.appearance = "liver";
    scene.surfaces.push_back(std::move(liver));
    Surface gallbladder = swept_surface(
        "gallbladder",
        [](double t) {
            return Vec3{-0.065 - 0.02 * t, -0.07 - 0.03 * t, 0.045 - 0.035 * t};
        },
        [](double t, double) {
            return std::max(1e-4,
                            0.013 * std::sqrt(std::max(0.0, 1 - std::pow(2 * t - 1, 2))) * (0.7 + 0.5 * t));
        },
        m, m);
    gallbladder.appearance = "gallbladder";
    scene.surfaces.push_back(std::move(gallbladder));

    FrameState& f = scene.frame;
    std::vector<Vec3> path;
    for (int i = 0; i <= 40; ++i)
        path.push_back(axis(i / 40.0 * 0.56));
    const Vec3 eye = axis(0.5);
    const Vec3 target = axis(0.8);
    f.tip = look_at(eye, target, {0, -1, 0});
    std::vector<Vec3> line;
    for (int i = 0; i <= 50; ++i)
        line.push_back(axis(i / 50.0 * 0.5));
    f.shaft.centreline = line;
    f.shaft.radius = 0.0049;
    const Vec3 hole = axis(0.66);
    f.rings.push_back({{hole[0] + 0.004, hole[1] - 0.028, hole[2]},
                       look_at(hole, {hole[0], hole[1] - 1, hole[2]}, {0, 0, 1}).rotation});
    path.push_back(axis(0.62));
    path.push_back({hole[0] + 0.003, hole[1] - 0.012, hole[2] + 0.001});
    path.push_back(f.rings[0].centre);
    f.paths.push_back({path});
    f.external.pose = look_at({0.10, -0.42, 0.17}, {0.0, -0.04, 0.05}, {0, 0, 1});
    f.endoscope_text = {"Navigation", "Find the red ring and pass through it", "00:12"};
    f.external_text = {"External view"};
    f.surfaces = {{SurfaceId{0}, Style::Translucent, {}}};
    return scene;
}

} // namespace calot::rendering
