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

// The section with wheel and wires approaches its balance at half the rate at which its own motion dies away
// (drag over mass), within these: then they never shake each other up (Routh: a chain of frequency w with
// damping d/2, and wires that follow at r, is stable for r < d at any w).
constexpr double slowest_wires = 2, fastest_wires = 20; // 1/s
constexpr double least_outside = 0.01;                  // m of the shaft, where the hand holds it
constexpr double least_change = 2e-3;                   // of a property, before the rod is told
constexpr double clear_twist = 0.02; // rad/m: a twentieth of what turns a shaft of 0.4 N m2 by 0.2 N m

// Rotation vector from the frame before joint i to that behind it.
Vec3 turn(std::span<const double> frame, std::size_t i) {
    const Quat q = conjugate(quat(&frame[4 * (i - 1)])) * quat(&frame[4 * i]);
    const Vec3 v{q.x, q.y, q.z};
    const double s = norm(v);
    if (s < 1e-12) return (q.w < 0 ? -2.0 : 2.0) * v;
    return (2 * std::atan2(q.w < 0 ? -s : s, std::abs(q.w)) / s) * v;
}

} // namespace

Endoscope::Endoscope(const EndoscopeDatasheet& sheet, std::uint32_t nodes)
    : room_(divide(sheet, nodes)), angulation_(sheet.angulation), warmth_(sheet.warmth),
      torque_asymmetry_(sheet.torque_asymmetry), total_(sheet.working_length),
      bent_length_(sheet.bending_length()), content_(sheet.channels.size()), mass_(room_.mass),
      bending_(room_.bending), torsion_(room_.torsion) {
    const std::size_t segments = room_.length.size();
    // The last segment is the rigid tip that holds the camera. What bends are the joints between the curved
    // segments, and half of those at either end of them: one segment's length less than the section.
    for (std::size_t i = room_.first_bending; i + 1 < segments; ++i)
        joint_length_ += room_.length[i];
    warm_.assign(segments, 0.0);
    added_bending_.assign(segments, 0.0);
    added_mass_.assign(segments, 0.0);
    rest_darboux_.assign(3 * segments, 0.0);
    rate_ = fastest_wires;
    for (std::size_t i = room_.first_bending; i < segments; ++i)
        rate_ = std::min(rate_, 0.5 * room_.drag[i] / room_.mass[i]);
    rate_ = std::max(rate_, slowest_wires);
    for (WirePair& wires : wires_)
        wires = WirePair(
            {angulation_.wire_stiffness, angulation_.pull_limit, angulation_.friction, angulation_.slack});
    condition(segments, {}, 0);
}

calot_rod_segments Endoscope::segments() const {
    return {.struct_size = sizeof(calot_rod_segments),
            .mass_per_length = reals(mass_),
            .radius = reals(room_.radius),
            .bending_x = reals(bending_),
            .bending_y = reals(bending_),
            .torsion = reals(torsion_),
            .bending_damping = reals(room_.bending_damping),
            .torsion_damping = reals(room_.torsion_damping),
            .drag = reals(room_.drag),
            .friction = reals(room_.friction)};
}

void Endoscope::set_channel(std::size_t channel, const ChannelContent& content) {
    content_.at(channel) = content;
    double begin = 0;
    for (std::size_t i = 0; i < room_.length.size(); ++i) {
        added_bending_[i] = added_mass_[i] = 0;
        for (const ChannelContent& c : content_) {
            // A segment that is filled in part is stiffened in part: the joint at the instrument's end moves
            // through it without a jump.
            const double filled = std::clamp((c.reach - begin) / room_.length[i], 0.0, 1.0);
            added_bending_[i] += filled * c.flexural_rigidity;
            added_mass_[i] += filled * c.mass_per_length;
        }
        begin += room_.length[i];
    }
}

void Endoscope::start_warm(std::size_t first_inside) {
    for (std::size_t i = 0; i < warm_.size(); ++i)
        warm_[i] = i >= first_inside ? 1 : 0;
    condition(first_inside, {}, 0);
}

bool Endoscope::condition(std::size_t first_inside, std::span<const double> frame, double dt) {
    const double share = 1 - std::exp(-dt / warmth_.warm_up);
    bool is_changed = false;
    // Twice over: whether anything changed enough, then all of it at once.
    for (const bool writes : {false, true}) {
        if (writes && !is_changed) break;
        for (std::size_t i = 0; i < warm_.size(); ++i) {
            if (!writes) warm_[i] += share * ((i >= first_inside ? 1 : 0) - warm_[i]);
            const double w = i < room_.first_bending ? warm_[i] : 0; // rings of metal do not soften
            const double bending =
                room_.bending[i] * (1 + w * (warmth_.bending_factor - 1)) + added_bending_[i];
            const double mass = room_.mass[i] + added_mass_[i];
            const double torsion = room_.torsion[i] * (1 + w * (warmth_.torsion_factor - 1)) *
                                   (1 - 0.5 * torque_asymmetry_ * (1 - twist_side(frame, i)));
            const auto differs = [](double now, double told) {
                return std::abs(now - told) > least_change * told;
            };
            if (writes)
                bending_[i] = bending, mass_[i] = mass, torsion_[i] = torsion;
            else
                is_changed = is_changed || differs(bending, bending_[i]) || differs(mass, mass_[i]) ||
                             differs(torsion, torsion_[i]);
        }
    }
    if (is_changed) update_rest();
    return is_changed;
}

// Between -1 and 1: how far the twist in front of and behind a segment is left- or right-handed.
double Endoscope::twist_side(std::span<const double> frame, std::size_t i) const {
    if (frame.empty() || torque_asymmetry_ == 0) return 0;
    const std::size_t last = room_.length.size() - 1;
    double twist = 0;
    if (i > 0) twist += turn(frame, i).z / (room_.length[i - 1] + room_.length[i]);
    if (i < last) twist += turn(frame, i + 1).z / (room_.length[i] + room_.length[i + 1]);
    return std::tanh(twist / clear_twist);
}

void Endoscope::steer(const double wheel[2], const std::uint32_t brake[2], std::span<const double> frame,
                      double dt) {
    std::array<double, 2> asked{};
    for (int k = 0; k < 2; ++k) {
        if (brake[k] == 0) wheel_[k] = wheel[k];
        asked[k] = angulation_.wheel_ratio * wheel_[k];
    }
    asked = limited(angulation_, asked);
    const std::array<double, 2> bent = angulation(frame);
    const double stiffness = section_stiffness(), step = angulation_.max_speed * dt;
    for (int k = 0; k < 2; ++k) {
        command_[k] += std::clamp(asked[k] - command_[k], -step, step);
        wires_[k].step(command_[k], bent[k], stiffness, rate_, dt);
    }
    update_rest();
}

void Endoscope::set_bending(const double wheel[2]) {
    wheel_ = {wheel[0], wheel[1]};
    command_ = limited(angulation_, {angulation_.wheel_ratio * wheel[0], angulation_.wheel_ratio * wheel[1]});
    for (int k = 0; k < 2; ++k)
        wires_[k].balance(command_[k], section_stiffness());
    update_rest();
}

// The wires' tension is the same all along, so the moment is.
void Endoscope::update_rest() {
    const double scale = bent_length_ / joint_length_;
    for (std::size_t i = room_.first_bending; i + 1 < room_.length.size(); ++i) {
        rest_darboux_[3 * i] = -scale * wires_[0].moment() / bending_[i];
        rest_darboux_[3 * i + 1] = scale * wires_[1].moment() / bending_[i];
    }
}

// N m/rad: moment for each rad of a free section.
double Endoscope::section_stiffness() const {
    double compliance = 0;
    for (std::size_t i = room_.first_bending; i + 1 < room_.length.size(); ++i)
        compliance += room_.length[i] / bending_[i];
    return joint_length_ / (bent_length_ * compliance);
}

// What the wires' lengths see: the sum of the turns about the wheels' axes, in whatever order.
std::array<double, 2> Endoscope::angulation(std::span<const double> frame) const {
    Vec3 sum{};
    for (std::size_t i = room_.first_bending; i < room_.length.size(); ++i)
        sum = sum + turn(frame, i);
    return {-sum.x, sum.y};
}

std::array<double, 2> Endoscope::wheel_torque() const {
    return {angulation_.wheel_ratio * wires_[0].pull(), angulation_.wheel_ratio * wires_[1].pull()};
}

calot_pose Endoscope::camera(std::span<const double> position, std::span<const double> frame) const {
    return pose(vec3(&position[position.size() - 3]), normalized(quat(&frame[frame.size() - 4])));
}

calot_twist Endoscope::camera_twist(std::span<const double> velocity, std::span<const double> angular) const {
    const double *v = &velocity[velocity.size() - 3], *w = &angular[angular.size() - 3];
    return {{v[0], v[1], v[2]}, {w[0], w[1], w[2]}};
}

std::vector<double> Endoscope::laid_along(const calot_guide& guide, std::span<const geometry::Vec3> path,
                                          double insertion) const {
    if (insertion > total_ - least_outside)
        throw std::invalid_argument("the endoscope is shorter than the insertion");
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
    std::vector<double> nodes(3 * room_.length.size() + 3);
    store(at, &nodes[3 * room_.length.size()]);
    for (std::size_t i = room_.length.size(); i-- > 0;) {
        // The nearest point of the line behind `at` that is a segment's length away: on the first piece whose
        // beginning is farther than that.
        while (norm(line[piece] - at) < room_.length[i])
            --piece;
        const Vec3 a = line[piece], d = normalized((piece + 1 < line.size() ? line[piece + 1] : at) - a);
        const Vec3 to = at - a;
        const double along = dot(to, d);
        const double off2 = std::max(dot(to, to) - along * along, 0.0);
        at = a + (along - std::sqrt(std::max(room_.length[i] * room_.length[i] - off2, 0.0))) * d;
        store(at, &nodes[3 * i]);
    }
    return nodes;
}

std::vector<double> Endoscope::frames_along(std::span<const double> position, double rotation) const {
    const auto tangent = [&](std::size_t i) {
        return normalized(vec3(&position[3 * i + 3]) - vec3(&position[3 * i]));
    };
    std::vector<double> frames(4 * room_.length.size());
    // y as near to world -y as it can be, then turned.
    const Vec3 z = tangent(0), anterior{0, -1, 0};
    const Quat to_z = between({0, 0, 1}, z);
    Vec3 y = anterior - dot(anterior, z) * z;
    y = norm(y) > 1e-3 ? normalized(y) : rotate(to_z, {0, 1, 0});
    const Vec3 back = rotate_back(to_z, y);
    Quat q = to_z * axis_angle({0, 0, 1}, std::atan2(-back.x, back.y) + rotation);
    for (std::size_t i = 0; i < room_.length.size(); ++i) {
        if (i > 0) q = normalized(between(tangent(i - 1), tangent(i)) * q);
        store(q, &frames[4 * i]);
    }
    return frames;
}

} // namespace calot::simulation
