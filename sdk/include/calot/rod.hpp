// Rod models in C++: derive from calot::Rod and export with CALOT_PLUGIN (plugin.hpp).
#pragma once

#include <calot/abi/rod.h>
#include <calot/instance.hpp>

namespace calot {

// Inputs are checked before a function is called: struct and span sizes, finite numbers, bounds that
// abi/rod.h states, unit directions, contacts' segments and count. Spans that abi/rod.h lets be empty may be.
class Rod : public Instance {
  public:
    // The rod's shape and properties; may throw. The spans live until it returns.
    virtual void configure(const calot_rod_setup& setup) = 0;
    // Real-time, like the two below: neither throw nor allocate; unless they return ok, nothing has changed.
    virtual Result set_segments(const calot_rod_segments& segments) = 0;
    virtual Result step(const calot_rod_input& input, calot_rod_output& output) = 0;
    // The present state, without a step.
    virtual Result read(calot_rod_output& output) = 0;
};

namespace detail {

struct RodCell final : Cell {
    Rod* rod = nullptr;
    std::uint64_t nodes = 0;
};

struct RodFunctions {
    static RodCell& cell(void* self) { return static_cast<RodCell&>(*static_cast<Cell*>(self)); }

    static calot_status configure(void* self, const calot_rod_setup* setup, calot_error* error) {
        RodCell& c = cell(self);
        if (!may_configure(c)) return only_while_inactive(error, "configure");
        Checker check(error);
        if (!check.whole(setup, "setup")) return check.status();
        check.require(setup->node_count >= 3, CALOT_CODE_OUT_OF_RANGE, "setup.node_count",
                      "a rod has at least 3 nodes");
        const std::uint64_t n = setup->node_count, m = n - 1;
        check.sized(setup->position, 3 * n, false, "setup.position");
        check.reals("setup.position", setup->position);
        check.sized(setup->frame, 4 * m, true, "setup.frame");
        check.reals("setup.frame", setup->frame);
        check.sized(setup->length, m, true, "setup.length");
        check.at_least("setup.length", setup->length, 0, true);
        check.sized(setup->rest_darboux, 3 * m, true, "setup.rest_darboux");
        check.reals("setup.rest_darboux", setup->rest_darboux);
        check_segments(check, setup->segments, m, false);
        check.reals("setup.guide.exit", setup->guide.exit, 3);
        if (setup->guide.present != 0) check.unit("setup.guide.direction", setup->guide.direction, 3);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] {
            c.rod->configure(*setup);
            c.nodes = n;
            c.life = Life::configured;
            return CALOT_OK;
        });
    }
    static calot_status set_segments(void* self, const calot_rod_segments* segments, calot_error* error) {
        RodCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "set_segments");
        Checker check(error);
        if (!check.whole(segments, "segments")) return check.status();
        check_segments(check, *segments, c.nodes - 1, true);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.rod->set_segments(*segments)); });
    }
    static calot_status step(void* self, const calot_rod_input* input, calot_rod_output* output,
                             calot_error* error) {
        RodCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "step");
        Checker check(error);
        if (!check.whole(input, "input") || !check.whole(output, "output")) return check.status();
        const std::uint64_t m = c.nodes - 1;
        check.reals("input.gravity", input->gravity, 3);
        const double longest = 1e-9 * static_cast<double>(c.activation.step_nanoseconds);
        check.require(input->duration >= 0 && input->duration <= longest * (1 + 1e-9),
                      CALOT_CODE_OUT_OF_RANGE, "input.duration",
                      "must be positive, no longer than the activation's step, or 0");
        check.require(input->farthest >= 0 && input->farthest < 1e9, CALOT_CODE_OUT_OF_RANGE,
                      "input.farthest", "must be finite and not negative");
        check_end(check, input->base, true);
        check_end(check, input->tip, false);
        check.sized(input->rest_darboux, 3 * m, true, "input.rest_darboux");
        check.reals("input.rest_darboux", input->rest_darboux);
        check.list<calot_contact>(input->contacts, c.activation.max_contacts, "input.contacts");
        if (check.is_ok()) check_contacts(check, input->contacts, m);
        check_output(check, *output, c.nodes, input->contacts.count);
        if (!check.is_ok()) return check.status();
        output->elapsed = 0;
        return guarded(error, [&] { return give(error, c.rod->step(*input, *output)); });
    }
    static calot_status read(void* self, calot_rod_output* output, calot_error* error) {
        RodCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "read");
        Checker check(error);
        if (!check.whole(output, "output")) return check.status();
        check_output(check, *output, c.nodes, output->contact_impulse.size / 3);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.rod->read(*output)); });
    }
    static const calot_rod* functions() {
        static const calot_rod table{sizeof(calot_rod), &configure, &set_segments, &step, &read};
        return &table;
    }

    static void check_segments(Checker& check, const calot_rod_segments& s, std::uint64_t m,
                               bool may_be_empty) {
        check.whole(&s, "segments");
        const auto one = [&](const char* field, calot_reals span, bool is_exclusive) {
            check.sized(span, m, may_be_empty, field);
            check.at_least(field, span, 0, is_exclusive);
        };
        one("segments.mass_per_length", s.mass_per_length, true);
        one("segments.radius", s.radius, true);
        one("segments.bending_x", s.bending_x, true);
        one("segments.bending_y", s.bending_y, true);
        one("segments.torsion", s.torsion, true);
        one("segments.bending_damping", s.bending_damping, false);
        one("segments.torsion_damping", s.torsion_damping, false);
        one("segments.drag", s.drag, false);
        one("segments.friction", s.friction, false);
    }
    static void check_coupling(Checker& check, const char* field, const calot_coupling& c) {
        const double values[5] = {c.target, c.velocity, c.stiffness, c.damping, c.limit};
        check.reals(field, values, 5);
        check.require(c.stiffness >= 0 && c.damping >= 0 && c.limit >= 0, CALOT_CODE_OUT_OF_RANGE, field,
                      "stiffness, damping and limit must not be negative");
    }
    static void check_end(Checker& check, const calot_rod_end& end, bool is_base) {
        const char* const mode = is_base ? "input.base.mode" : "input.tip.mode";
        check.require(end.mode <= CALOT_END_LOADED && (is_base || end.mode != CALOT_END_COUPLED),
                      CALOT_CODE_INVALID_ARGUMENT, mode, "is not a way in which this end can be held");
        check.reals(is_base ? "input.base.pose.position" : "input.tip.pose.position", end.pose.position, 3);
        const char* const turn = is_base ? "input.base.pose.quaternion" : "input.tip.pose.quaternion";
        if (end.mode == CALOT_END_CLAMPED)
            check.unit(turn, end.pose.quaternion, 4);
        else
            check.reals(turn, end.pose.quaternion, 4);
        check.reals(is_base ? "input.base.wrench.force" : "input.tip.wrench.force", end.wrench.force, 3);
        check.reals(is_base ? "input.base.wrench.torque" : "input.tip.wrench.torque", end.wrench.torque, 3);
        check_coupling(check, is_base ? "input.base.insertion" : "input.tip.insertion", end.insertion);
        check_coupling(check, is_base ? "input.base.rotation" : "input.tip.rotation", end.rotation);
    }
    static void check_contacts(Checker& check, calot_structs list, std::uint64_t m) {
        const auto contacts = items<calot_contact>(list);
        for (std::uint64_t i = 0; i < contacts.size() && check.is_ok(); ++i) {
            const calot_contact& k = contacts[i];
            const char* const name = "input.contacts";
            const bool is_self = (k.flags & CALOT_CONTACT_SELF) != 0;
            check.require(k.segment < m && (!is_self || k.other_segment < m), CALOT_CODE_OUT_OF_RANGE,
                          "input.contacts.segment", "the rod has no such segment");
            check.element(name, i, "t", &k.t, 1);
            check.element(name, i, "axis_point", k.axis_point, 3);
            check.element(name, i, "point", k.point, 3);
            check.element(name, i, "normal", k.normal, 3);
            check.element(name, i, "gap", &k.gap, 1);
            check.element(name, i, "friction", &k.friction, 1);
            check.element(name, i, "free_position", k.free_position, 3);
            check.element(name, i, "compliance", k.compliance, 9);
            check.element(name, i, "other_t", &k.other_t, 1);
            if (!check.is_ok()) return;
            const double square =
                k.normal[0] * k.normal[0] + k.normal[1] * k.normal[1] + k.normal[2] * k.normal[2];
            check.require(std::abs(square - 1) <= 1e-4, CALOT_CODE_OUT_OF_RANGE, "input.contacts.normal",
                          "must have unit length");
            check.require(k.t >= 0 && k.t <= 1 && (!is_self || (k.other_t >= 0 && k.other_t <= 1)),
                          CALOT_CODE_OUT_OF_RANGE, "input.contacts.t", "must lie in [0, 1]");
            check.require(k.friction >= 0, CALOT_CODE_OUT_OF_RANGE, "input.contacts.friction",
                          "must not be negative");
        }
    }
    static void check_output(Checker& check, const calot_rod_output& o, std::uint64_t n,
                             std::uint64_t contacts) {
        check.sized(o.position, 3 * n, true, "output.position");
        check.sized(o.velocity, 3 * n, true, "output.velocity");
        check.sized(o.frame, 4 * (n - 1), true, "output.frame");
        check.sized(o.angular_velocity, 3 * (n - 1), true, "output.angular_velocity");
        check.sized(o.contact_impulse, 3 * contacts, true, "output.contact_impulse");
    }
};

} // namespace detail
} // namespace calot
