#include "navigation.hpp"

#include <algorithm>
#include <cmath>

namespace calot::transgastric {
namespace {

std::vector<Vec3> points_of(const calot_marker& landmark) {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i + 2 < landmark.polyline.size; i += 3)
        points.push_back(vec3(landmark.polyline.data + i));
    return points;
}

} // namespace

std::optional<Passage> passage(const SnapshotView& shaft, const Ring& ring) {
    const auto height = [&](const Vec3& p) { return dot(p - ring.centre, ring.normal); };
    double beyond = 0;
    Vec3 outer = shaft.node(shaft.node_count() - 1);
    if (height(outer) <= 0) return {};
    for (std::size_t i = shaft.node_count() - 1; i-- > 0;) {
        const Vec3 inner = shaft.node(i);
        const double from = height(inner), to = height(outer);
        if (from <= 0) {
            const Vec3 crossing = inner + (from / (from - to)) * (outer - inner);
            const double offset = norm(crossing - ring.centre);
            if (offset >= ring.radius) return {};
            return Passage{beyond + norm(outer - crossing), offset};
        }
        beyond += norm(outer - inner);
        outer = inner;
    }
    return {};
}

double distance(const Vec3& point, const std::vector<Vec3>& polyline) {
    if (polyline.empty()) return 0;
    double best = norm(point - polyline.front());
    for (std::size_t i = 1; i < polyline.size(); ++i) {
        const Vec3 along = polyline[i] - polyline[i - 1];
        const double square = dot(along, along);
        const double t = square > 0 ? clamp(dot(point - polyline[i - 1], along) / square, 0, 1) : 0;
        best = std::min(best, norm(point - polyline[i - 1] - t * along));
    }
    return best;
}

void Navigation::configure(const SnapshotView& scene) {
    calot_marker incision{};
    if (!scene.landmark("viscerotomy", incision) || incision.radius <= 0)
        throw Error(
            CALOT_CODE_INVALID_ARGUMENT, "scene.viscerotomy",
            "the anatomy marks no incision with this name; add its position, normal and ring_diameter");
    ring_ = {vec3(incision.position), normalized(vec3(incision.normal)), incision.radius};

    calot_marker way{};
    path_.clear();
    if (scene.landmark("path", way)) path_ = points_of(way);

    calot_marker oesophagus{};
    has_junction_ = false;
    if (scene.landmark("oesophagus", oesophagus)) {
        const auto line = points_of(oesophagus);
        if (line.size() >= 2) {
            junction_ = line.back();
            junction_direction_ = normalized(line.back() - line[line.size() - 2]);
            has_junction_ = true;
        }
    }
    state_ = {};
}

void Navigation::update(std::int64_t tick, const SnapshotView& shaft) {
    State& s = state_;
    if (s.is_done) return;
    const Vec3 tip = shaft.node(shaft.node_count() - 1);
    if (s.stomach_tick < 0 && has_junction_ && dot(tip - junction_, junction_direction_) > 0)
        s.stomach_tick = tick;
    if (s.ring_tick < 0) {
        s.deviation += distance(tip, path_);
        ++s.samples;
    }
    const auto through = passage(shaft, ring_);
    if (through && s.ring_tick < 0) s.ring_tick = tick;
    if (!through || through->beyond < needed_beyond) {
        s.through_since = -1;
        return;
    }
    if (s.through_since < 0) s.through_since = tick;
    if (seconds(tick - s.through_since) < needed_time) return;
    s.offset = through->offset;
    s.is_done = true;
}

void Navigation::save(StateWriter& to) const {
    const State& s = state_;
    to.value(s.stomach_tick), to.value(s.ring_tick), to.value(s.through_since), to.value(s.samples);
    to.value(s.deviation), to.value(s.offset), to.value(s.is_done);
}

void Navigation::load(StateReader& from) {
    State s;
    from.value(s.stomach_tick), from.value(s.ring_tick), from.value(s.through_since), from.value(s.samples);
    from.value(s.deviation), from.value(s.offset);
    s.is_done = from.value<std::uint8_t>() != 0;
    state_ = s;
}

} // namespace calot::transgastric
