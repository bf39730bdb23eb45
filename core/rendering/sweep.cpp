#include "rendering/sweep.hpp"

#include "rendering/linear.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::rendering {
namespace {

using Eigen::Vector3d;
constexpr double kTau = 2 * std::numbers::pi;
constexpr double kMerge = 1e-6; // m
constexpr std::size_t kMostStations = 20000;

std::array<float, 3> to_floats(const Vector3d& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

Vector3d catmull_rom(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d, double t) {
    const double t2 = t * t, t3 = t2 * t;
    return 0.5 * ((2 * b) + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t2 + (3 * b - a - 3 * c + d) * t3);
}

void ring_indices(std::vector<std::uint32_t>& out, std::size_t first, std::size_t sides) {
    // Two rings of sides + 1 vertices one after the other; outward when the second lies along +z.
    for (std::size_t i = 0; i < sides; ++i) {
        const auto a = static_cast<std::uint32_t>(first + i),
                   b = static_cast<std::uint32_t>(first + sides + 1 + i);
        out.insert(out.end(), {a, a + 1, b, a + 1, b + 1, b});
    }
}

} // namespace

std::vector<CurvePoint> smooth_curve(const std::vector<Vec3>& points, const std::vector<Quat>& frames,
                                     double step) {
    std::vector<Vector3d> p;
    std::vector<Vector3d> roll;
    const bool framed = frames.size() == points.size();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vector3d v = to_eigen(points[i]);
        if (!v.allFinite() || (!p.empty() && (v - p.back()).norm() < kMerge)) continue;
        p.push_back(v);
        if (framed) roll.push_back(to_matrix(frames[i]).col(0));
    }
    std::vector<CurvePoint> out;
    if (p.size() < 2) return out;
    std::vector<Vector3d> wanted;
    for (std::size_t i = 0; i + 1 < p.size(); ++i) {
        const Vector3d& b = p[i];
        const Vector3d& c = p[i + 1];
        const Vector3d a = i > 0 ? p[i - 1] : Vector3d(2 * b - c);
        const Vector3d d = i + 2 < p.size() ? p[i + 2] : Vector3d(2 * c - b);
        const auto pieces = static_cast<int>(std::clamp(std::ceil((c - b).norm() / step), 1.0, 64.0));
        for (int k = 0; k < pieces + (i + 2 == p.size() ? 1 : 0); ++k) {
            if (out.size() >= kMostStations) return out;
            const double t = static_cast<double>(k) / pieces;
            CurvePoint point;
            point.position = catmull_rom(a, b, c, d, t);
            point.arc = out.empty() ? 0 : out.back().arc + (point.position - out.back().position).norm();
            out.push_back(point);
            if (framed) wanted.push_back((1 - t) * roll[i] + t * roll[i + 1]);
        }
    }
    for (std::size_t i = 0; i < out.size(); ++i) {
        const Vector3d ahead =
            out[std::min(i + 1, out.size() - 1)].position - out[i > 0 ? i - 1 : 0].position;
        out[i].z = ahead.norm() > 0 ? Vector3d(ahead.normalized()) : Vector3d::UnitZ();
        Vector3d x = framed ? wanted[i] : i > 0 ? out[i - 1].x : perpendicular(out[0].z);
        x -= out[i].z * out[i].z.dot(x);
        if (x.norm() < 1e-9)
            x = i > 0 ? out[i - 1].x - out[i].z * out[i].z.dot(out[i - 1].x) : perpendicular(out[i].z);
        out[i].x = x.norm() > 1e-9 ? Vector3d(x.normalized()) : perpendicular(out[i].z);
        out[i].y = out[i].z.cross(out[i].x);
    }
    return out;
}

void sweep_shaft(const ShaftState& shaft, ShaftMesh& mesh) {
    constexpr std::size_t kSides = 22;
    constexpr double kHardTip = 0.012; // m, typical of gastroscopes
    constexpr double kChamfer = 0.0008;
    mesh.vertices.clear();
    mesh.indices.clear();
    const std::vector<CurvePoint> curve = smooth_curve(shaft.centreline, shaft.frames, 0.004);
    if (curve.size() < 2 || !(shaft.radius > 0)) return;
    const double end = curve.back().arc;

    const auto ring = [&](const CurvePoint& c, double radius, double along, double s, ShaftPart part) {
        for (std::size_t i = 0; i <= kSides; ++i) {
            const double angle = kTau * static_cast<double>(i) / kSides;
            const Vector3d out = std::cos(angle) * c.x + std::sin(angle) * c.y;
            const Vector3d normal = (out * std::sqrt(1 - along * along) + c.z * along).normalized();
            mesh.vertices.push_back(
                {to_floats(c.position + radius * out),
                 to_floats(normal),
                 {static_cast<float>(s), static_cast<float>(angle), static_cast<float>(part), 1.0f}});
        }
    };
    const auto band = [&](std::size_t first) { ring_indices(mesh.indices, first, kSides); };

    bool hard = false;
    for (std::size_t i = 0; i < curve.size(); ++i) {
        const double s = end - curve[i].arc;
        if (s < kChamfer && i > 0) break;
        const bool now_hard = s < kHardTip;
        if (i > 0) {
            if (now_hard && !hard)
                ring(curve[i], shaft.radius, 0, s, ShaftPart::Tube);
            else
                ring(curve[i], shaft.radius, 0, s, now_hard ? ShaftPart::HardTip : ShaftPart::Tube);
            band(mesh.vertices.size() - 2 * (kSides + 1));
        }
        if (i == 0 || (now_hard && !hard))
            ring(curve[i], shaft.radius, 0, s, now_hard ? ShaftPart::HardTip : ShaftPart::Tube);
        hard = now_hard;
    }
    // Chamfer and face.
    const CurvePoint& tip = curve.back();
    CurvePoint rim = tip;
    rim.position -= kChamfer * tip.z;
    ring(rim, shaft.radius, 0, kChamfer, ShaftPart::HardTip);
    band(mesh.vertices.size() - 2 * (kSides + 1));
    ring(rim, shaft.radius, 0.5, kChamfer, ShaftPart::HardTip);
    ring(tip, shaft.radius - kChamfer, 0.9, 0, ShaftPart::HardTip);
    band(mesh.vertices.size() - 2 * (kSides + 1));
    const auto centre = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(
        {to_floats(tip.position), to_floats(tip.z), {0, 0, static_cast<float>(ShaftPart::Face), 0}});
    // The face interpolates angle and radius, so each sector has its own centre-side ring of small radius.
    for (const double fraction : {0.02, 0.35, 0.7, 1.0})
        for (std::size_t i = 0; i <= kSides; ++i) {
            const double angle = kTau * static_cast<double>(i) / kSides;
            const Vector3d out = std::cos(angle) * tip.x + std::sin(angle) * tip.y;
            mesh.vertices.push_back({to_floats(tip.position + fraction * (shaft.radius - kChamfer) * out),
                                     to_floats(tip.z),
                                     {0, static_cast<float>(angle), static_cast<float>(ShaftPart::Face),
                                      static_cast<float>(fraction)}});
        }
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t i = 0; i < kSides; ++i) {
            const auto a = static_cast<std::uint32_t>(centre + 1 + r * (kSides + 1) + i);
            const auto b = static_cast<std::uint32_t>(a + kSides + 1);
            mesh.indices.insert(mesh.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
        }
    for (std::size_t i = 0; i < kSides; ++i)
        mesh.indices.insert(mesh.indices.end(), {centre, static_cast<std::uint32_t>(centre + 1 + i),
                                                 static_cast<std::uint32_t>(centre + 2 + i)});
}

namespace {

class MarkerBuilder {
  public:
    MarkerBuilder(MarkerMesh& mesh, const Vec3& lens) : mesh_(mesh), lens_(to_eigen(lens)) {}

    void tube(const std::vector<CurvePoint>& curve, double radius, const Rgb& colour, float alpha,
              MarkerMesh::Part& part, std::size_t sides) {
        for (std::size_t i = 0; i < curve.size(); ++i) {
            for (std::size_t k = 0; k <= sides; ++k) {
                const double angle = kTau * static_cast<double>(k) / static_cast<double>(sides);
                const Vector3d out = std::cos(angle) * curve[i].x + std::sin(angle) * curve[i].y;
                add(curve[i].position + radius * out, out, colour, alpha);
            }
            if (i > 0)
                ring_indices(choose(part, curve[i].position), mesh_.vertices.size() - 2 * (sides + 1), sides);
        }
    }

    void ball(const Vector3d& centre, double radius, const Rgb& colour, float alpha, MarkerMesh::Part& part,
              std::size_t sides) {
        const std::size_t rows = sides / 2;
        for (std::size_t r = 0; r <= rows; ++r) {
            const double polar = std::numbers::pi * (1 - static_cast<double>(r) / static_cast<double>(rows));
            for (std::size_t k = 0; k <= sides; ++k) {
                const double angle = kTau * static_cast<double>(k) / static_cast<double>(sides);
                const Vector3d out(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                                   std::cos(polar));
                add(centre + radius * out, out, colour, alpha);
            }
            if (r > 0) ring_indices(choose(part, centre), mesh_.vertices.size() - 2 * (sides + 1), sides);
        }
    }

    void torus(const RingMarker& ring, double tube_radius, float alpha, MarkerMesh::Part& part) {
        constexpr std::size_t kAround = 64;
        const Eigen::Matrix3d axes = to_matrix(ring.rotation);
        std::vector<CurvePoint> curve(kAround + 1);
        for (std::size_t i = 0; i <= kAround; ++i) {
            const double angle = kTau * static_cast<double>(i) / kAround;
            const Vector3d out = std::cos(angle) * axes.col(0) + std::sin(angle) * axes.col(1);
            curve[i].position = to_eigen(ring.centre) + ring.radius * out;
            curve[i].x = out;
            curve[i].z = -std::sin(angle) * axes.col(0) + std::cos(angle) * axes.col(1);
            curve[i].y = curve[i].z.cross(curve[i].x);
        }
        tube(curve, tube_radius, ring.colour, alpha, part, 14);
    }

  private:
    void add(const Vector3d& position, const Vector3d& normal, const Rgb& c, float alpha) {
        const auto byte = [](float v) {
            return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255));
        };
        mesh_.vertices.push_back(
            {to_floats(position), to_floats(normal), {byte(c[0]), byte(c[1]), byte(c[2]), byte(alpha)}});
    }
    std::vector<std::uint32_t>& choose(MarkerMesh::Part& part, const Vector3d& where) const {
        return (where - lens_).norm() < kLensClearance ? part.near : part.far;
    }

    MarkerMesh& mesh_;
    Vector3d lens_;
};

} // namespace

void build_markers(const FrameState& frame, MarkerMesh& mesh) {
    mesh.vertices.clear();
    for (MarkerMesh::Part* part : {&mesh.cores, &mesh.halos}) {
        part->far.clear();
        part->near.clear();
    }
    MarkerBuilder build(mesh, frame.tip.position);
    constexpr double kHalo = 3.2; // radius of the halo over that of the core
    for (const PathMarker& path : frame.paths) {
        const std::vector<CurvePoint> curve = smooth_curve(path.points, {}, 0.005);
        const bool beads = path.bead_spacing > 0;
        build.tube(curve, path.radius * (beads ? 0.35 : 1.0), path.colour, 1, mesh.cores, 5);
        build.tube(curve, path.radius * kHalo * (beads ? 0.7 : 1.0), path.colour, 0.4f, mesh.halos, 7);
        double next = 0;
        for (const CurvePoint& c : curve)
            if (beads && c.arc >= next) {
                build.ball(c.position, path.radius, path.colour, 1, mesh.cores, 8);
                next = c.arc + path.bead_spacing;
            }
    }
    for (const RingMarker& ring : frame.rings) {
        const auto breath = static_cast<float>(0.85 + 0.15 * std::sin(frame.time * 3.0));
        build.torus(ring, ring.tube_radius, 1, mesh.cores);
        build.torus(ring, ring.tube_radius * kHalo, breath, mesh.halos);
    }
    for (const PointMarker& point : frame.points) {
        build.ball(to_eigen(point.position), point.radius, point.colour, 1, mesh.cores, 16);
        build.ball(to_eigen(point.position), point.radius * 2.4, point.colour, 0.8f, mesh.halos, 16);
    }
    for (const SegmentMarker& segment : frame.segments) {
        const std::vector<CurvePoint> curve = smooth_curve({segment.from, segment.to}, {}, 0.02);
        build.tube(curve, segment.radius, segment.colour, 1, mesh.cores, 6);
        build.tube(curve, segment.radius * kHalo, segment.colour, 0.7f, mesh.halos, 7);
    }
}

} // namespace calot::rendering
