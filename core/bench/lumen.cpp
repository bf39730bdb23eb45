#include "bench/lumen.hpp"

#include <algorithm>
#include <cmath>

namespace calot::bench {

namespace {
constexpr double spacing = 5e-4; // m, of the axis
}

calot_contact node_contact(const BenchRod& rod, int i, std::uint64_t id, const Vec3& point,
                           const Vec3& normal, double gap, double friction) {
    calot_contact c{};
    c.id = id;
    c.segment = static_cast<std::uint32_t>(i - 1);
    c.t = 1;
    store(rod.position(i), c.axis_point);
    store(point, c.point), store(point, c.free_position);
    store(normal, c.normal);
    c.gap = gap, c.friction = friction;
    return c;
}

Lumen::Lumen(std::vector<Vec3> axis, double radius, bool is_closed, double friction)
    : axis_(std::move(axis)), radius_(radius), friction_(friction), is_closed_(is_closed) {}

std::vector<Vec3> Lumen::random_axis(Random& random, double length, double tightest) {
    struct Wave {
        double amplitude, number, phase;
    };
    Wave waves[2][3];
    for (auto& component : waves)
        for (Wave& w : component)
            w = {random.uniform(0.5, 1) / (3 * std::sqrt(2.0) * tightest), random.uniform(20, 90),
                 random.uniform(0, 6.283)};
    std::vector<Vec3> axis;
    Quat q = along_x;
    Vec3 p{};
    for (int i = 0; i * spacing <= length; ++i) {
        const double s = i * spacing;
        axis.push_back(p);
        // Straight at the mouth, then bending more and more until 30 mm in.
        const double grown = std::min(1.0, s / 0.03);
        double k[2] = {};
        for (int c = 0; c < 2; ++c)
            for (const Wave& w : waves[c])
                k[c] += grown * w.amplitude * std::sin(w.number * s + w.phase);
        const Vec3 turn = rotate(q, {k[0], k[1], 0});
        q = normalized(axis_angle(normalized(turn), norm(turn) * spacing) * q);
        p += rotate(q, {0, 0, spacing});
    }
    return axis;
}

std::vector<Vec3> Lumen::bend(double lead, double radius, double angle, double tail) {
    std::vector<Vec3> axis;
    const double arc = radius * angle;
    for (int i = 0; i * spacing <= lead + arc + tail; ++i) {
        const double s = i * spacing;
        const double a = std::clamp((s - lead) / radius, 0.0, angle), rest = std::max(0.0, s - lead - arc);
        axis.push_back({std::min(s, lead) + radius * std::sin(a) + rest * std::cos(a),
                        radius * (1 - std::cos(a)) + rest * std::sin(a), 0});
    }
    return axis;
}

// Downhill from where the node was: the axis is smooth and a node moves less than its bends in a step.
std::size_t Lumen::nearest(const Vec3& p, std::size_t at) const {
    const auto d = [&](std::size_t k) { return dot(p - axis_[k], p - axis_[k]); };
    while (at + 1 < axis_.size() && d(at + 1) < d(at))
        ++at;
    while (at > 0 && d(at - 1) < d(at))
        --at;
    return at;
}

const std::vector<calot_contact>& Lumen::contacts(const BenchRod& rod, double reach) {
    list_.clear();
    const auto n = static_cast<std::size_t>(rod.nodes());
    // At first a node is looked for from where its neighbour is: across a bend of more than a right angle,
    // downhill from the mouth would end on the way.
    const bool is_first = near_.size() != n;
    // So near its end that a tip may touch it.
    const double apart = norm(axis_.back() - axis_[axis_.size() - 2]);
    const auto last = static_cast<std::size_t>(8 + 2 * (rod.rod().radius + reach) / apart);
    if (is_first) near_.assign(n, 0);
    for (std::size_t i = 1; i < n; ++i) {
        const Vec3 p = rod.position(static_cast<int>(i));
        near_[i] = nearest(p, is_first ? near_[i - 1] : near_[i]);
        const std::size_t k = std::min(near_[i], axis_.size() - 2);
        const Vec3 a = axis_[k > 0 ? k - 1 : 0], t = normalized(axis_[k + 1] - a);
        const double along = dot(p - axis_[near_[i]], t);
        const bool is_last = near_[i] + 1 >= axis_.size();
        if (is_closed_ && i == n - 1 && near_[i] + last >= axis_.size()) {
            const Vec3 end = axis_.back(), out = -t;
            const double gap = dot(p - end, out) - rod.rod().radius;
            if (gap < reach)
                list_.push_back(node_contact(rod, static_cast<int>(i), n + i + 1, end, out, gap, friction_));
        }
        if ((near_[i] == 0 && along < 0) || (is_last && along > 0 && !is_closed_)) continue;
        const Vec3 off = p - axis_[near_[i]] - along * t;
        const double d = norm(off), gap = radius_ - rod.rod().radius - d;
        if (d < 1e-9 || gap > reach) continue;
        const Vec3 in = -1.0 / d * off;
        list_.push_back(node_contact(rod, static_cast<int>(i), i + 1, p - (gap + rod.rod().radius) * in, in,
                                     gap, friction_));
    }
    return list_;
}

} // namespace calot::bench
