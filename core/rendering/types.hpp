// What the renderer is given: plain data, no simulation types.
//
// Units: metres, seconds, radians. World frame: patient LPS (+x left, +y posterior, +z superior).
// Every pose of a camera or an endoscope tip has the tip's axes: +z looks forward, +y is up and +x is
// left on the screen (a right-handed frame).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace calot::rendering {

using Vec3 = std::array<double, 3>;
using Quat = std::array<double, 4>; // (w, x, y, z), unit length
using Rgb = std::array<float, 3>;   // linear light, 0..1

struct Pose {
    Vec3 position{0, 0, 0};
    Quat rotation{1, 0, 0, 0}; // columns of its matrix: the frame's axes in the world
};

/// A camera pose at `eye` that looks at `target`; `up` need not be perpendicular. When up is parallel to the
/// line of sight, or eye and target coincide, some valid pose is returned.
Pose look_at(const Vec3& eye, const Vec3& target, const Vec3& up);

/// A triangle mesh as the renderer takes it. Triangles are counter-clockwise seen from outside.
struct Surface {
    std::string name;
    std::vector<std::array<float, 3>> vertices; // metres
    std::vector<std::array<float, 3>> normals;  // unit, per vertex; empty: computed
    std::vector<std::array<std::uint8_t, 4>>
        colours; // per vertex tint rgb and ambient openness a; empty: white
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::string appearance = "serosa";            // an entry of appearance.toml, for the outer (front) side
    std::string inner_appearance;                 // for the side seen from within; empty: as outside
    std::vector<std::string> triangle_appearance; // outer side per triangle; empty: `appearance` for all
};

enum class SurfaceId : std::uint32_t {};

/// How the external view shows a surface. The endoscope's camera always shows what is not Hidden.
enum class Style : std::uint8_t {
    Solid,
    Translucent, // a veil, denser towards its outline: what is inside can be seen
    Outline,     // hardly more than its outline: the body's wall around everything
    Cut,         // without the part in front of the frame's cut plane
    Hidden,      // in neither view
    EndoscopeOnly,
};

struct SurfaceState {
    SurfaceId id{};
    Style style = Style::Solid;
    Pose pose; // object to world; identity for organs
};

/// The endoscope's shaft from base to tip.
struct ShaftState {
    std::vector<Vec3> centreline;
    std::vector<Quat> frames; // one for each point, +z along the shaft; empty: transported along the curve
    double radius = 0.006;
    double bending_length = 0.08; // of the angulated section, from the tip
};

struct PathMarker {
    std::vector<Vec3> points;
    Rgb colour{0.25f, 1.0f, 0.45f};
    double radius = 0.0008;
    double bead_spacing = 0.008; // 0: a plain tube
};

struct RingMarker {
    Vec3 centre{};
    Quat rotation{1, 0, 0, 0}; // the ring lies in its x-y plane
    double radius = 0.009;
    double tube_radius = 0.0009;
    Rgb colour{1.0f, 0.05f, 0.03f};
};

struct PointMarker {
    Vec3 position{};
    double radius = 0.0012;
    Rgb colour{0.1f, 0.35f, 1.0f};
};

struct SegmentMarker {
    Vec3 from{}, to{};
    double radius = 0.0005;
    Rgb colour{1.0f, 0.1f, 0.1f};
};

/// A plane through `point`; the external view drops what lies on the side that `normal` points to.
struct CutPlane {
    Vec3 point{};
    Vec3 normal{0, -1, 0};
};

struct ExternalCamera {
    bool on = true;
    Pose pose;
    double vertical_field = 0.6; // rad
};

/// One frame: everything that changes from picture to picture.
struct FrameState {
    double time = 0; // s; drives auto-exposure and the glow of markers
    Pose tip;        // the endoscope's camera
    ShaftState shaft;
    std::vector<SurfaceState> surfaces; // those not listed are Solid at identity
    std::vector<PathMarker> paths;
    std::vector<RingMarker> rings;
    std::vector<PointMarker> points;
    std::vector<SegmentMarker> segments;
    ExternalCamera external;
    std::optional<CutPlane> cut;
    double light = 1.0;                      // of the headlight, 0..1
    double fade = 0;                         // 1: black
    std::vector<std::string> endoscope_text; // lines beside or below the endoscope's picture
    std::vector<std::string> external_text;  // lines in the corner of the external view
};

/// Pixels, top row first, four bytes each (red, green, blue, 255).
struct Image {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba;
    std::span<const std::uint8_t, 4> pixel(int x, int y) const {
        return std::span<const std::uint8_t, 4>(
            rgba.data() + 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                               static_cast<std::size_t>(x)),
            4);
    }
};

} // namespace calot::rendering
