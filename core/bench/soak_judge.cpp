#include "bench/soak_judge.hpp"

#include <algorithm>
#include <cmath>

namespace calot::bench {

using geometry::Vec3;

namespace {

// Closed halves: a line through an edge crosses both of its triangles.
bool crosses_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = cross(b - a, c - a);
    const double from = dot(n, p - a), to = dot(n, q - a);
    if ((from > 0 && to > 0) || (from < 0 && to < 0) || from == to) return false;
    const Vec3 line = q - p;
    const double u = dot(line, cross(a - p, b - p)), v = dot(line, cross(b - p, c - p)),
                 w = dot(line, cross(c - p, a - p));
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

// What a shaft can hold that is bent everywhere as tightly as its bending section can be (radius 25 mm,
// facts.tsv endoscope.min_bend_radius), twisted by the coupling's torque (1 N m) throughout, and moves at
// 2 m/s, faster than a tip that snaps through.
double energy_of_the_worst(const simulation::EndoscopeDatasheet& sheet) {
    constexpr double tightest = 0.025, torque = 1, speed = 2;
    double sum = 0;
    for (const simulation::ShaftSegment& s : sheet.segments)
        sum += s.length * (s.flexural_rigidity.at(0.5) / (2 * tightest * tightest) +
                           torque * torque / (2 * s.torsional_rigidity.at(0.5)) +
                           0.5 * s.mass_per_length * speed * speed);
    return sum;
}

} // namespace

bool crosses(const geometry::TriangleScene& scene, const Vec3& a, const Vec3& b) {
    bool found = false;
    scene.tree().overlapping(geometry::box_of(a, b, 0.0), [&](std::uint32_t leaf) {
        for (std::uint32_t i = scene.tree().leaf_begin(leaf); i < scene.tree().leaf_begin(leaf + 1); ++i) {
            const geometry::TriangleScene::Triangle& t = scene.triangles()[i];
            found =
                found || crosses_triangle(a, b, scene.corner(t, 0), scene.corner(t, 1), scene.corner(t, 2));
        }
    });
    return found;
}

std::size_t nodes_outside(const geometry::TriangleScene& scene, const std::vector<double>& position) {
    const std::size_t n = position.size() / 3;
    const auto node = [&](std::size_t i) {
        return Vec3{position[3 * i], position[3 * i + 1], position[3 * i + 2]};
    };
    for (std::size_t i = 0; i + 1 < n; ++i)
        if (crosses(scene, node(i), node(i + 1))) return n - 1 - i;
    return 0;
}

SoakJudge::SoakJudge(const simulation::World& world, int period)
    : world_(world), period_(period),
      smallest_radius_(
          std::min_element(world.endoscope.segments.begin(), world.endoscope.segments.end(),
                           [](const auto& a, const auto& b) { return a.outer_radius < b.outer_radius; })
              ->outer_radius),
      energy_bound_(energy_of_the_worst(world.endoscope)) {}

void SoakJudge::ticked(const simulation::Snapshot& s) {
    ++ticks_;
    if (s.penetration.now > deepest_) deepest_ = s.penetration.now, deepest_tick_ = s.tick;
    streak_ = s.penetration.now > 1e-3 ? streak_ + 1 : 0;
    longest_ = std::max(longest_, streak_);
    top_energy_ = std::max(top_energy_, s.bending_energy + s.twist_energy + s.kinetic_energy);
    top_force_ = std::max(top_force_, s.tissue_force);
    shortest_inside_ = std::min(shortest_inside_, s.insertion);
    longest_inside_ = std::max(longest_inside_, s.insertion);
    double fastest2 = 0;
    for (std::size_t i = 0; i + 2 < s.velocity.size(); i += 3) {
        const double* v = &s.velocity[i];
        fastest2 = std::max(fastest2, v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
    top_speed_ = std::max(top_speed_, std::sqrt(fastest2));
    if (s.tick % period_ == 0 || s.penetration.now > 1e-3)
        most_outside_ = std::max(most_outside_, nodes_outside(world_.surfaces, s.position));
}

std::vector<Row> SoakJudge::rows(const Row& like, double wanted) const {
    std::vector<Row> all;
    const auto add = [&](const char* quantity, double measured, double reference, double error,
                         double bound) {
        Row r = like;
        r.quantity = quantity, r.measured = measured, r.reference = reference;
        r.error = std::isfinite(error) ? error : std::numeric_limits<double>::infinity(), r.bound = bound;
        all.push_back(r);
    };
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    constexpr double unjudged = std::numeric_limits<double>::infinity();
    const double seconds = static_cast<double>(ticks_) * 1e-3;
    add("duration", seconds, wanted, std::abs(seconds - wanted), 1e-3);
    add("penetration", deepest_, 0, deepest_, 0.5 * smallest_radius_);
    const double over = static_cast<double>(longest_) * 1e-3;
    add("over_1mm", over, 0, over, 0.010 + 1e-9);
    add("nodes_outside", static_cast<double>(most_outside_), 0, static_cast<double>(most_outside_), 0);
    add("energy", top_energy_, none, top_energy_, energy_bound_);
    add("force", top_force_, none, 0, unjudged);
    add("speed", top_speed_, none, 0, unjudged);
    add("shortest_inside", shortest_inside_, none, 0, unjudged);
    add("longest_inside", longest_inside_, none, 0, unjudged);
    return all;
}

} // namespace calot::bench
