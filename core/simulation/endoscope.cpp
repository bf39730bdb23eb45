#include "simulation/endoscope.hpp"

#include <calot/math.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace calot::simulation {

namespace {

calot_reals reals(const std::vector<double>& values) {
    return {values.data(), values.size()};
}

// Inside the ellipse through the four largest angulations: both wheels together reach less than each alone.
std::array<double, 2> limited(const Angulation& a, std::array<double, 2> b) {
    const double most[2] = {b[0] >= 0 ? a.up : a.down, b[1] >= 0 ? a.left : a.right};
    double sum = 0;
    for (int k = 0; k < 2; ++k) {
        b[k] = std::clamp(b[k], -most[k], most[k]);
        if (most[k] > 0) sum += (b[k] / most[k]) * (b[k] / most[k]);
    }
    if (sum > 1)
        for (double& value : b)
            value /= std::sqrt(sum);
    return b;
}

} // namespace

Endoscope::Endoscope(const EndoscopeDatasheet& sheet, std::uint32_t nodes) : angulation_(sheet.angulation) {
    if (nodes < 20 || nodes > 2000) throw std::invalid_argument("a shaft has 20 to 2000 nodes");
    const std::uint32_t segments = nodes - 1;
    const double share = sheet.bending_section.length / sheet.working_length;
    const auto bending = static_cast<std::uint32_t>(
        std::clamp(std::round(share * segments), 3.0, static_cast<double>(segments - 3)));
    first_bending_ = segments - bending;
    for (std::uint32_t i = 0; i < segments; ++i) {
        const bool bends = i >= first_bending_;
        const ShaftSection& s = bends ? sheet.bending_section : sheet.insertion_tube;
        length_.push_back(s.length / (bends ? bending : first_bending_));
        radius_.push_back(s.outer_radius);
        mass_.push_back(s.mass_per_length);
        bending_x_.push_back(s.flexural_rigidity);
        torsion_.push_back(s.torsional_rigidity);
        bending_damping_.push_back(s.bending_damping);
        torsion_damping_.push_back(s.torsion_damping);
        drag_.push_back(s.drag);
        friction_.push_back(s.friction_factor);
        total_ += length_.back();
    }
    rest_darboux_.assign(3 * segments, 0.0);
}

calot_rod_segments Endoscope::segments() const {
    return {.struct_size = sizeof(calot_rod_segments),
            .mass_per_length = reals(mass_),
            .radius = reals(radius_),
            .bending_x = reals(bending_x_),
            .bending_y = reals(bending_x_),
            .torsion = reals(torsion_),
            .bending_damping = reals(bending_damping_),
            .torsion_damping = reals(torsion_damping_),
            .drag = reals(drag_),
            .friction = reals(friction_)};
}

void Endoscope::steer(const double wheel[2], const std::uint32_t brake[2], double dt) {
    std::array<double, 2> next = bending_;
    for (int k = 0; k < 2; ++k) {
        if (brake[k] == 0) wheel_[k] = wheel[k];
        const double most[2] = {k == 0 ? angulation_.down : angulation_.right,
                                k == 0 ? angulation_.up : angulation_.left};
        const double asked = std::clamp(angulation_.wheel_ratio * wheel_[k], -most[0], most[1]);
        // The play operator: nothing moves until the wire is taut again.
        const double slack = 0.5 * angulation_.backlash;
        const double taut = std::clamp(bending_[k], asked - slack, asked + slack);
        const double step = angulation_.max_speed * dt;
        next[k] = bending_[k] + std::clamp(taut - bending_[k], -step, step);
    }
    next = limited(angulation_, next);
    if (next == bending_) return;
    bending_ = next;
    update_rest();
}

void Endoscope::set_bending(const double wheel[2]) {
    wheel_ = {wheel[0], wheel[1]};
    bending_ = limited(angulation_, {angulation_.wheel_ratio * wheel[0], angulation_.wheel_ratio * wheel[1]});
    update_rest();
}

// The last segment is the rigid tip that holds the camera. What bends are the joints between the curved
// segments, and half of those at either end of them: one segment's length less than the section.
void Endoscope::update_rest() {
    double curved = 0;
    for (std::size_t i = first_bending_; i + 1 < length_.size(); ++i)
        curved += length_[i];
    for (std::size_t i = first_bending_; i + 1 < length_.size(); ++i) {
        rest_darboux_[3 * i] = -bending_[0] / curved;
        rest_darboux_[3 * i + 1] = bending_[1] / curved;
    }
}

calot_pose Endoscope::camera(std::span<const double> position, std::span<const double> frame) const {
    return pose(vec3(&position[position.size() - 3]), normalized(quat(&frame[frame.size() - 4])));
}

calot_twist Endoscope::camera_twist(std::span<const double> velocity, std::span<const double> angular) const {
    const double *v = &velocity[velocity.size() - 3], *w = &angular[angular.size() - 3];
    return {{v[0], v[1], v[2]}, {w[0], w[1], w[2]}};
}

std::array<double, 2> Endoscope::wheel_torque(std::span<const double> frame) const {
    double up = 0, left = 0, angle_up = 0, angle_left = 0;
    int joints = 0;
    for (std::size_t i = first_bending_; i + 1 < length_.size(); ++i, ++joints) {
        // Twice the vector part of the turn from one frame to the next: curvature times length.
        const Quat turn = conjugate(quat(&frame[4 * (i - 1)])) * quat(&frame[4 * i]);
        const double sign = turn.w < 0 ? -2 : 2, l = 0.5 * (length_[i - 1] + length_[i]);
        angle_up = -sign * turn.x / l, angle_left = sign * turn.y / l;
        up += bending_x_[i] * (-rest_darboux_[3 * i] - angle_up);
        left += bending_x_[i] * (rest_darboux_[3 * i + 1] - angle_left);
    }
    const double scale = angulation_.wheel_ratio / std::max(joints, 1);
    return {scale * up, scale * left};
}

std::vector<double> Endoscope::laid_along(const calot_guide& guide, std::span<const geometry::Vec3> path,
                                          double insertion) const {
    const Vec3 exit = vec3(guide.exit), inwards = vec3(guide.direction);
    // The line from far inside the guide to the end of the path.
    std::vector<Vec3> line{exit - (2 * total_ + 1) * inwards, exit};
    for (const geometry::Vec3& p : path) {
        const Vec3 point{p.x, p.y, p.z};
        if (norm(point - line.back()) > 1e-3) line.push_back(point);
    }
    // The tip: `insertion` beyond the exit.
    std::size_t piece = 1;
    double left = insertion;
    while (piece + 1 < line.size() && left > norm(line[piece + 1] - line[piece])) {
        left -= norm(line[piece + 1] - line[piece]);
        ++piece;
    }
    if (piece + 1 >= line.size()) throw std::invalid_argument("the path is shorter than the insertion");
    Vec3 at = line[piece] + left * normalized(line[piece + 1] - line[piece]);
    std::vector<double> nodes(3 * length_.size() + 3);
    store(at, &nodes[3 * length_.size()]);
    for (std::size_t i = length_.size(); i-- > 0;) {
        // The nearest point of the line behind `at` that is a segment's length away: on the first piece whose
        // beginning is farther than that.
        while (norm(line[piece] - at) < length_[i])
            --piece;
        const Vec3 a = line[piece], d = normalized((piece + 1 < line.size() ? line[piece + 1] : at) - a);
        const Vec3 to = at - a;
        const double along = dot(to, d);
        const double off2 = std::max(dot(to, to) - along * along, 0.0);
        at = a + (along - std::sqrt(std::max(length_[i] * length_[i] - off2, 0.0))) * d;
        store(at, &nodes[3 * i]);
    }
    return nodes;
}

std::vector<double> Endoscope::frames_along(std::span<const double> position, double rotation) const {
    const auto tangent = [&](std::size_t i) {
        return normalized(vec3(&position[3 * i + 3]) - vec3(&position[3 * i]));
    };
    std::vector<double> frames(4 * length_.size());
    // y as near to world -y as it can be, then turned.
    const Vec3 z = tangent(0), anterior{0, -1, 0};
    const Quat to_z = between({0, 0, 1}, z);
    Vec3 y = anterior - dot(anterior, z) * z;
    y = norm(y) > 1e-3 ? normalized(y) : rotate(to_z, {0, 1, 0});
    const Vec3 back = rotate_back(to_z, y);
    Quat q = to_z * axis_angle({0, 0, 1}, std::atan2(-back.x, back.y) + rotation);
    for (std::size_t i = 0; i < length_.size(); ++i) {
        if (i > 0) q = normalized(between(tangent(i - 1), tangent(i)) * q);
        store(q, &frames[4 * i]);
    }
    return frames;
}

} // namespace calot::simulation
