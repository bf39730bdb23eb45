#include "bench/self_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::bench {

// Ericson 2005, Real-Time Collision Detection, 5.1.9.
ClosestPair closest_points(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) {
    const Vec3 d1 = a1 - a0, d2 = b1 - b0, r = a0 - b0;
    const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r), c = dot(d1, r), b = dot(d1, d2);
    const double denominator = a * e - b * b;
    ClosestPair p;
    p.s = denominator > 1e-12 * a * e ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.5;
    p.t = (b * p.s + f) / e;
    if (p.t < 0)
        p.t = 0, p.s = std::clamp(-c / a, 0.0, 1.0);
    else if (p.t > 1)
        p.t = 1, p.s = std::clamp((b - c) / a, 0.0, 1.0);
    p.distance = norm(a0 + p.s * d1 - b0 - p.t * d2);
    return p;
}

SelfContacts::SelfContacts(const UniformRod& rod, double friction)
    : radius_(rod.radius), friction_(friction) {
    const double l = rod.length / (rod.nodes - 1);
    apart_ = 2 + static_cast<int>(std::ceil(2 * std::numbers::pi * rod.radius / l));
}

const std::vector<calot_contact>& SelfContacts::contacts(const BenchRod& rod, double reach,
                                                         std::size_t capacity) {
    list_.clear();
    const int segments = rod.nodes() - 1;
    const double l = rod.rod().length / segments, far = 2 * radius_ + reach;
    for (int i = 0; i < segments; ++i) {
        const Vec3 a0 = rod.position(i), a1 = rod.position(i + 1);
        for (int j = i + apart_; j < segments && list_.size() < capacity;) {
            const Vec3 b0 = rod.position(j), b1 = rod.position(j + 1);
            // Middles that are far apart stay so for as many segments as fit in between.
            const double between = norm(0.5 * (a0 + a1) - 0.5 * (b0 + b1)) - 1.01 * l - far;
            if (between > 0) {
                j += std::max(1, static_cast<int>(between / (1.01 * l)));
                continue;
            }
            const ClosestPair near = closest_points(a0, a1, b0, b1);
            // A corner belongs to the segment that begins there.
            const bool is_next = (near.s == 1 && i + 1 < segments) || (near.t == 1 && j + 1 < segments);
            if (!is_next && near.distance < far && near.distance > 1e-9) {
                const Vec3 p = a0 + near.s * (a1 - a0), q = b0 + near.t * (b1 - b0);
                const Vec3 normal = (1 / near.distance) * (p - q), surface = q + radius_ * normal;
                calot_contact c{};
                c.id = 1 + static_cast<std::uint64_t>(i) * static_cast<std::uint64_t>(segments) +
                       static_cast<std::uint64_t>(j);
                c.flags = CALOT_CONTACT_SELF;
                c.segment = static_cast<std::uint32_t>(i), c.t = near.s;
                c.other_segment = static_cast<std::uint32_t>(j), c.other_t = near.t;
                store(p, c.axis_point), store(surface, c.point), store(surface, c.free_position);
                store(normal, c.normal);
                c.gap = near.distance - 2 * radius_, c.friction = friction_;
                list_.push_back(c);
            }
            ++j;
        }
    }
    return list_;
}

} // namespace calot::bench
