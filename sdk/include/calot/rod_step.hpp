// A rod's step in C++ types, made of the contract's: what a model whose step takes a RodStep is given.
#pragma once

#include <calot/abi/rod.h>
#include <calot/math.hpp>
#include <calot/span.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace calot {

enum class RodEndMode {
    free,    ///< nothing holds it
    clamped, ///< the cross-section is at `position`, `orientation` at the step's end
    loaded,  ///< force and torque, constant in the world
    coupled, ///< base only: one-dimensional springs along and about the guide's direction
};

/// A capped spring-damper on one coordinate.
struct RodCoupling {
    double target = 0.0;   ///< m or rad, at the step's begin
    double velocity = 0.0; ///< m/s or rad/s of the target
    double stiffness = 0.0, damping = 0.0;
    double cap = 0.0; ///< N or N m
};

struct RodEnd {
    RodEndMode mode = RodEndMode::free;
    Vec3 position;
    Quat orientation; ///< unit
    Vec3 force, torque;
    RodCoupling axial, roll;
};

/// A straight frictionless sleeve. Material with (x - origin) . direction < 0 lies on its axis.
struct RodGuide {
    bool present = false;
    Vec3 origin, direction{0, 0, 1};
};

/// One point where the rod's surface touches, or nearly touches, something. Geometry is of the query's pose.
struct RodContact {
    std::int32_t segment = 0; ///< of the rod
    double along = 0.0;       ///< 0 at the segment's base-side node, 1 at the other
    Vec3 normal;              ///< unit, from the other side to the rod
    double gap = 0.0;         ///< m, between the surfaces; negative when they overlap
    Vec3 centre;           ///< m, the rod's centreline point at the query; in self-contact from the other's
    double friction = 0.0; ///< Coulomb coefficient of the other side
    Vec3 motion;           ///< m, displacement of the other side's surface, were there no contact,
                           ///< from the query to the step's end
    std::array<double, 9> compliance{}; ///< m/N, row by row: displacement of the other side at the step's end
                                        ///< for a force held over the step; zero if rigid
    std::uint64_t id = 0; ///< the same as long as the contact lasts; carries stick from step to step
    std::int32_t other_segment = -1; ///< of the rod itself, in self-contact
    double other_along = 0.0;
};

struct RodStep {
    double dt = 1e-3;      ///< s
    double farthest = 0.0; ///< m; the step may end early once a node has gone so far; 0: never
    Vec3 gravity;          ///< m/s^2
    RodEnd base, tip;
    RodGuide guide;
    std::span<const double> rest_darboux; ///< 3(N-1), 1/m; empty: unchanged since the last step
    std::span<const RodContact> contacts; ///< no more than the rod was made for
};

namespace detail {

inline RodCoupling rod_coupling(const calot_coupling& c) {
    return {c.target, c.velocity, c.stiffness, c.damping, c.limit};
}

inline RodEnd rod_end(const calot_rod_end& e) {
    RodEnd out;
    out.mode = e.mode == CALOT_END_CLAMPED   ? RodEndMode::clamped
               : e.mode == CALOT_END_COUPLED ? RodEndMode::coupled
               : e.mode == CALOT_END_LOADED  ? RodEndMode::loaded
                                             : RodEndMode::free;
    if (out.mode == RodEndMode::clamped) {
        out.position = vec3(e.pose.position);
        out.orientation = normalized(quat(e.pose.quaternion));
    }
    out.force = vec3(e.wrench.force), out.torque = vec3(e.wrench.torque);
    out.axial = rod_coupling(e.insertion), out.roll = rod_coupling(e.rotation);
    return out;
}

inline RodContact rod_contact(const calot_contact& c, double dt, std::span<const double> radius) {
    RodContact out;
    out.segment = static_cast<std::int32_t>(c.segment), out.along = c.t;
    out.normal = normalized(vec3(c.normal)), out.gap = c.gap, out.centre = vec3(c.axis_point);
    out.friction = c.friction, out.motion = vec3(c.free_position) - vec3(c.point), out.id = c.id;
    // The contract's compliance is per impulse; a force held over the step is an impulse of dt times it.
    for (std::size_t i = 0; i < 9; ++i)
        out.compliance[i] = c.compliance[i] * dt;
    if ((c.flags & CALOT_CONTACT_SELF) != 0) {
        out.other_segment = static_cast<std::int32_t>(c.other_segment), out.other_along = c.other_t;
        // Both sides move: what the rod follows is the way from the other axis to this one.
        out.centre -= vec3(c.point) - radius[c.other_segment] * out.normal;
        out.motion = {};
    }
    return out;
}

/// Keeps the contacts' room. `dt` (s) is the activation's, for steps that name no duration of their own.
class RodStepReader {
  public:
    RodStepReader() = default;
    RodStepReader(double dt, const calot_guide& guide, std::size_t max_contacts)
        : dt_(dt), contacts_(max_contacts) {
        if (guide.present != 0) guide_ = {true, vec3(guide.exit), vec3(guide.direction)};
    }

    /// Allocates nothing. What it returns refers to the input and to this reader.
    RodStep read(const calot_rod_input& in, std::span<const double> radius) {
        RodStep step;
        step.dt = in.duration > 0 ? in.duration : dt_, step.farthest = in.farthest;
        step.gravity = vec3(in.gravity);
        step.base = rod_end(in.base), step.tip = rod_end(in.tip);
        step.guide = guide_;
        step.rest_darboux = span(in.rest_darboux);
        const auto list = items<calot_contact>(in.contacts);
        const std::size_t count = std::min<std::size_t>(list.size(), contacts_.size());
        for (std::size_t i = 0; i < count; ++i)
            contacts_[i] = rod_contact(list[i], step.dt, radius);
        step.contacts = {contacts_.data(), count};
        return step;
    }

  private:
    double dt_ = 1e-3;
    RodGuide guide_;
    std::vector<RodContact> contacts_;
};

} // namespace detail
} // namespace calot
