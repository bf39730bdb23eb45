#include "app/case_picture.hpp"

#include "rendering/mesh_surface.hpp"

#include <algorithm>
#include <cmath>

namespace calot::app {
namespace {

rendering::Pose pose(const calot_pose& p) {
    return {{p.position[0], p.position[1], p.position[2]},
            {p.quaternion[0], p.quaternion[1], p.quaternion[2], p.quaternion[3]}};
}

std::vector<rendering::Vec3> points(const std::vector<double>& flat) {
    std::vector<rendering::Vec3> list(flat.size() / 3);
    for (std::size_t i = 0; i < list.size(); ++i)
        list[i] = {flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]};
    return list;
}

// What is done is dimmed.
rendering::Rgb colour(const simulation::Marker& marker) {
    const double factor = marker.is_done ? 0.25 : 1;
    return {static_cast<float>(factor * marker.colour[0]), static_cast<float>(factor * marker.colour[1]),
            static_cast<float>(factor * marker.colour[2])};
}

std::string appearance_of(const simulation::Organ& organ, const std::string& region) {
    const auto found = organ.region_appearance.find(region);
    if (found != organ.region_appearance.end()) return found->second;
    return organ.appearance.empty() ? "serosa" : organ.appearance;
}

bool shows(const simulation::Organ& organ, const char* prefix) {
    if (organ.appearance.starts_with(prefix)) return true;
    return std::any_of(organ.region_appearance.begin(), organ.region_appearance.end(),
                       [&](const auto& entry) { return entry.second.starts_with(prefix); });
}

// In the external view the body's wall is an outline and hollow organs are veils, so that what is inside is
// seen.
rendering::Style style_of(const simulation::Organ& organ) {
    if (shows(organ, "skin") || shows(organ, "peritoneum")) return rendering::Style::Outline;
    return shows(organ, "mucosa") || shows(organ, "ligament") ? rendering::Style::Translucent
                                                              : rendering::Style::Solid;
}

} // namespace

CasePicture::CasePicture(const simulation::World& world, const std::vector<simulation::TaskState>& tasks)
    : world_(world) {
    for (const simulation::TaskState& task : tasks)
        titles_[task.id] = task.title;
    // The external view shows the paths that the anatomy knows; without any, all organs.
    rendering::Vec3 least{1e9, 1e9, 1e9}, most{-1e9, -1e9, -1e9};
    const auto include = [&](const auto& p) {
        for (int k = 0; k < 3; ++k)
            least[k] = std::min(least[k], p[k]), most[k] = std::max(most[k], p[k]);
    };
    for (const simulation::Landmark& landmark : world.anatomy.landmarks)
        for (const auto& p : landmark.points)
            include(p);
    if (least[0] > most[0])
        for (const simulation::Organ& organ : world.anatomy.organs)
            for (const auto& v : organ.mesh.vertices)
                include(v);
    if (least[0] > most[0]) return;
    double square = 0;
    for (int k = 0; k < 3; ++k) {
        centre_[k] = 0.5 * (least[k] + most[k]);
        square += 0.25 * (most[k] - least[k]) * (most[k] - least[k]);
    }
    radius_ = std::max(0.02, 1.25 * std::sqrt(square)); // with what lies around
}

rendering::RendererSettings CasePicture::settings(int width, int height) const {
    rendering::RendererSettings settings;
    settings.width = width;
    settings.height = height;
    const simulation::CameraOptics& camera = world_.endoscope.camera;
    if (camera.field_of_view > 0) settings.optics.field_of_view = camera.field_of_view;
    settings.optics.light_exponent = camera.light_exponent;
    return settings;
}

void CasePicture::add_surfaces(rendering::Renderer& renderer) {
    surfaces_.clear();
    for (const simulation::Organ& organ : world_.anatomy.organs) {
        const rendering::SurfaceId id = renderer.add(rendering::to_surface(
            organ.mesh, [&](const std::string& region) { return appearance_of(organ, region); }));
        surfaces_.push_back({id, style_of(organ), {}});
    }
}

rendering::FrameState CasePicture::frame(const simulation::Snapshot& snapshot) const {
    rendering::FrameState frame;
    frame.time = snapshot.seconds();
    frame.tip = pose(snapshot.camera);
    frame.fade = snapshot.fade;
    frame.surfaces = surfaces_;
    frame.cut = rendering::CutPlane{centre_, {0, -1, 0}};
    frame.shaft.centreline = points(snapshot.position);
    frame.shaft.radius = world_.endoscope.outer_radius();
    frame.shaft.bending_length = world_.endoscope.bending_length();
    for (const simulation::Marker& marker : snapshot.markers.all()) {
        switch (marker.kind) {
        case CALOT_MARKER_PATH: {
            rendering::PathMarker path;
            path.points = points(marker.points);
            path.colour = colour(marker);
            if (path.points.size() >= 2) frame.paths.push_back(std::move(path));
            break;
        }
        case CALOT_MARKER_RING: {
            rendering::RingMarker ring;
            ring.centre = marker.position;
            ring.rotation = rendering::look_at({0, 0, 0}, marker.normal, {0, 0, 1}).rotation;
            ring.radius = marker.radius;
            ring.colour = colour(marker);
            frame.rings.push_back(ring);
            break;
        }
        case CALOT_MARKER_POINT: {
            rendering::PointMarker point;
            point.position = marker.position;
            point.colour = colour(marker);
            frame.points.push_back(point);
            break;
        }
        case CALOT_MARKER_LINE: {
            const auto line = points(marker.points);
            for (std::size_t i = 0; i + 1 < line.size(); ++i) {
                rendering::SegmentMarker segment;
                segment.from = line[i], segment.to = line[i + 1];
                segment.colour = colour(marker);
                frame.segments.push_back(segment);
            }
            break;
        }
        default:
            break;
        }
    }
    return frame;
}

launcher::CaseStatus CasePicture::status(const simulation::Snapshot& snapshot) const {
    launcher::CaseStatus status;
    status.seconds = snapshot.seconds();
    const auto title = titles_.find(snapshot.task.view());
    status.task = title == titles_.end() ? std::string(snapshot.task.view()) : title->second;
    status.message = std::string(snapshot.message.view());
    status.push_force = snapshot.feedback.insertion_force;
    status.turn_torque = snapshot.feedback.rotation_torque;
    status.tissue_force = snapshot.tissue_force;
    status.late_ticks = snapshot.late.late;
    status.slipped_ticks = snapshot.late.slipped;
    status.is_paused = snapshot.is_paused;
    status.is_finished = snapshot.is_finished;
    return status;
}

} // namespace calot::app
