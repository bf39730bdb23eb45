// Shapes swept along curves: the endoscope's shaft and the guidance markers.
#pragma once

#include "rendering/types.hpp"

#include <Eigen/Core>

namespace calot::rendering {

/// A point of a smooth curve with a frame whose z runs along it; x and y do not twist but for the frames
/// given.
struct CurvePoint {
    Eigen::Vector3d position{0, 0, 0}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    double arc = 0; // from the first point
};

/// Catmull-Rom curve through the points (Catmull & Rom 1974), stations at most `step` apart. `frames` (one a
/// point, or none) fix the roll; without them x is transported along the curve. Points closer together than
/// a micrometre are merged; fewer than two leave an empty curve.
std::vector<CurvePoint> smooth_curve(const std::vector<Vec3>& points, const std::vector<Quat>& frames,
                                     double step);

enum class ShaftPart : std::uint8_t { Tube, HardTip, Face };

struct ShaftVertex {
    std::array<float, 3> position, normal;
    std::array<float, 4> place; // arc length from the tip, angle, ShaftPart, radius across the face 0..1
};

struct ShaftMesh {
    std::vector<ShaftVertex> vertices;
    std::vector<std::uint32_t> indices;
};
void sweep_shaft(const ShaftState&, ShaftMesh& out);

struct MarkerVertex {
    std::array<float, 3> position, normal;
    std::array<std::uint8_t, 4> colour; // linear light; alpha scales the halo
};

struct MarkerMesh {
    std::vector<MarkerVertex> vertices;
    struct Part {
        std::vector<std::uint32_t> far,
            near; // near: within kLensClearance of the endoscope's lens, left out of its view
    } cores, halos;
};
inline constexpr double kLensClearance = 0.012; // m; marker.frag fades what is a little farther

/// All markers of a frame; at `time` the rings' halos breathe a little.
void build_markers(const FrameState&, MarkerMesh& out);

} // namespace calot::rendering
