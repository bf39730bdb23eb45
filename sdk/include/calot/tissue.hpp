// Tissue models in C++: derive from calot::Tissue and export with CALOT_PLUGIN (plugin.hpp).
#pragma once

#include <calot/abi/tissue.h>
#include <calot/instance.hpp>

namespace calot {

// Inputs are checked before a function is called: sizes, indices in range, finite numbers, bounds of
// materials.
class Tissue : public Instance {
  public:
    // May throw. The spans live until it returns.
    virtual void configure(const calot_tissue_setup& setup) = 0;
    // Real-time, like those below: neither throw nor allocate; unless they return ok, nothing has changed.
    virtual Result step(const calot_tissue_input& input, calot_tissue_output& output) = 0;
    virtual Result read(calot_tissue_output& output) = 0;
    // Fills free_position and compliance of each answer.
    virtual Result answer(calot_structs_out& answers) = 0;
    // The surface point nearest to a world point (m): its triangle and its weights there.
    virtual Result closest(const double point[3], std::uint32_t& triangle, double weight[3]) = 0;
};

namespace detail {

struct TissueCell final : Cell {
    Tissue* tissue = nullptr;
    std::uint64_t anchors = 0;
    std::uint64_t max_vertices = 0;
    std::uint64_t max_triangles = 0;
};

struct TissueFunctions {
    static TissueCell& cell(void* self) { return static_cast<TissueCell&>(*static_cast<Cell*>(self)); }

    static calot_status configure(void* self, const calot_tissue_setup* setup, calot_error* error) {
        TissueCell& c = cell(self);
        if (!may_configure(c)) return only_while_inactive(error, "configure");
        Checker check(error);
        if (!check.whole(setup, "setup")) return check.status();
        check_setup(check, *setup);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] {
            c.tissue->configure(*setup);
            c.anchors = setup->anchors.size;
            c.max_vertices = setup->max_vertices;
            c.max_triangles = setup->max_triangles;
            c.life = Life::configured;
            return CALOT_OK;
        });
    }
    static calot_status step(void* self, const calot_tissue_input* input, calot_tissue_output* output,
                             calot_error* error) {
        TissueCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "step");
        Checker check(error);
        if (!check.whole(input, "input") || !check.whole(output, "output")) return check.status();
        check.reals("input.gravity", input->gravity, 3);
        check.sized(input->anchor_position, 3 * c.anchors, false, "input.anchor_position");
        check.reals("input.anchor_position", input->anchor_position);
        check.list<calot_surface_impulse>(input->impulses, c.activation.max_contacts, "input.impulses");
        check.list<calot_action>(input->actions, c.activation.max_actions, "input.actions");
        if (check.is_ok()) check_lists(check, *input, c.max_triangles);
        check_output(check, c, *output);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.tissue->step(*input, *output)); });
    }
    static calot_status read(void* self, calot_tissue_output* output, calot_error* error) {
        TissueCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "read");
        Checker check(error);
        if (!check.whole(output, "output")) return check.status();
        check_output(check, c, *output);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.tissue->read(*output)); });
    }
    static calot_status answer(void* self, calot_structs_out* answers, calot_error* error) {
        TissueCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "answer");
        Checker check(error);
        if (answers == nullptr || answers->count > answers->capacity)
            return fail(error, CALOT_ERROR, CALOT_CODE_INVALID_ARGUMENT, "answers", "is missing or too long");
        check.list_out<calot_surface_answer>(*answers, "answers");
        for (std::uint64_t i = 0; i < answers->count && check.is_ok(); ++i) {
            const auto& a = item<calot_surface_answer>(*answers, i);
            check.require(a.triangle < c.max_triangles, CALOT_CODE_OUT_OF_RANGE, "answers.triangle",
                          "the surface has no such triangle");
            check.element("answers", i, "weight", a.weight, 3);
        }
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.tissue->answer(*answers)); });
    }
    static calot_status closest(void* self, const double point[3], std::uint32_t* triangle, double weight[3],
                                calot_error* error) {
        TissueCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "closest");
        if (point == nullptr || triangle == nullptr || weight == nullptr)
            return fail(error, CALOT_ERROR, CALOT_CODE_INVALID_ARGUMENT, "point", "an argument is missing");
        Checker check(error);
        check.reals("point", point, 3);
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.tissue->closest(point, *triangle, weight)); });
    }
    static const calot_tissue* functions() {
        static const calot_tissue table{sizeof(calot_tissue), &configure, &step, &read, &answer, &closest};
        return &table;
    }

    static void indices_below(Checker& check, const char* field, calot_indices s, std::uint64_t limit,
                              std::uint64_t multiple) {
        if (!check.present(s, field)) return;
        check.require(s.size % multiple == 0, CALOT_CODE_INVALID_ARGUMENT, field,
                      "has an incomplete element");
        for (std::uint64_t i = 0; i < s.size && check.is_ok(); ++i)
            check.require(s.data[i] < limit, CALOT_CODE_OUT_OF_RANGE, field,
                          "has an index that is too large");
    }
    static void check_setup(Checker& check, const calot_tissue_setup& s) {
        check.reals("setup.position", s.position);
        check.require(s.position.size % 3 == 0 && s.position.size > 0, CALOT_CODE_INVALID_ARGUMENT,
                      "setup.position", "must have three reals for each of at least one vertex");
        const std::uint64_t vertices = s.position.size / 3;
        indices_below(check, "setup.tetrahedra", s.tetrahedra, vertices, 4);
        indices_below(check, "setup.shells", s.shells, vertices, 3);
        indices_below(check, "setup.strands", s.strands, vertices, 2);
        indices_below(check, "setup.surface", s.surface, vertices, 3);
        indices_below(check, "setup.anchors", s.anchors, vertices, 1);
        check.list<calot_material>(s.materials, UINT32_MAX, "setup.materials");
        check.list<calot_region>(s.regions, UINT32_MAX, "setup.regions");
        if (!check.is_ok()) return;
        indices_below(check, "setup.surface_region", s.surface_region, s.regions.count, 1);
        check.sized(s.surface_region, s.surface.size / 3, false, "setup.surface_region");
        check.require(s.max_vertices >= vertices, CALOT_CODE_OUT_OF_RANGE, "setup.max_vertices",
                      "is less than the vertices there are");
        check.require(s.max_triangles >= s.surface.size / 3, CALOT_CODE_OUT_OF_RANGE, "setup.max_triangles",
                      "is less than the triangles there are");
        std::uint64_t i = 0;
        for (const calot_material& m : items<calot_material>(s.materials)) {
            const double values[9] = {m.density,  m.youngs,     m.poisson,     m.loss_factor, m.thickness,
                                      m.friction, m.tear_force, m.tear_stress, m.burn_energy};
            check.element("setup.materials", i++, "values", values, 9);
            check.require(m.density > 0 && m.youngs > 0 && m.poisson >= 0 && m.poisson < 0.5 &&
                              m.loss_factor >= 0 && m.thickness >= 0 && m.friction >= 0 &&
                              m.tear_force >= 0 && m.tear_stress >= 0 && m.burn_energy >= 0,
                          CALOT_CODE_OUT_OF_RANGE, "setup.materials", "a property is out of its bounds");
        }
        for (const calot_region& r : items<calot_region>(s.regions)) {
            check.real("setup.regions.lumen_pressure", r.lumen_pressure);
            const std::uint64_t elements = r.kind == CALOT_REGION_SOLID    ? s.tetrahedra.size / 4
                                           : r.kind == CALOT_REGION_SHELL  ? s.shells.size / 3
                                           : r.kind == CALOT_REGION_STRAND ? s.strands.size / 2
                                                                           : 0;
            check.require(r.material < s.materials.count && r.kind <= CALOT_REGION_STRAND &&
                              std::uint64_t{r.first} + r.count <= elements,
                          CALOT_CODE_OUT_OF_RANGE, "setup.regions",
                          "a region's kind, material or elements do not exist");
        }
    }
    static void check_lists(Checker& check, const calot_tissue_input& in, std::uint64_t triangles) {
        std::uint64_t i = 0;
        for (const calot_surface_impulse& p : items<calot_surface_impulse>(in.impulses)) {
            check.require(p.triangle < triangles, CALOT_CODE_OUT_OF_RANGE, "input.impulses.triangle",
                          "the surface has no such triangle");
            check.element("input.impulses", i, "weight", p.weight, 3);
            check.element("input.impulses", i++, "impulse", p.impulse, 3);
        }
        i = 0;
        for (const calot_action& a : items<calot_action>(in.actions)) {
            check.element("input.actions", i, "from", a.from, 3);
            check.element("input.actions", i, "to", a.to, 3);
            check.element("input.actions", i, "sweep", a.sweep, 3);
            check.element("input.actions", i, "normal", a.normal, 3);
            const double values[3] = {a.radius, a.extent, a.amount};
            check.element("input.actions", i, "radius, extent, amount", values, 3);
            check.element("input.actions", i, "pose.position", a.pose.position, 3);
            check.element("input.actions", i, "pose.quaternion", a.pose.quaternion, 4);
            check.element("input.actions", i, "twist.linear", a.twist.linear, 3);
            check.element("input.actions", i++, "twist.angular", a.twist.angular, 3);
        }
    }
    static void check_output(Checker& check, const TissueCell& c, const calot_tissue_output& o) {
        check.sized(o.position, 3 * c.max_vertices, true, "output.position");
        check.sized(o.velocity, 3 * c.max_vertices, true, "output.velocity");
        check.sized(o.anchor_force, 3 * c.anchors, true, "output.anchor_force");
        check.sized(o.surface, 3 * c.max_triangles, true, "output.surface");
        check.sized(o.surface_region, c.max_triangles, true, "output.surface_region");
        check.list_out<calot_range>(o.dirty, "output.dirty");
        check.list_out<calot_reaction>(o.reactions, "output.reactions");
        check.list_out<calot_tissue_event>(o.events, "output.events");
        check.list_out<calot_leak>(o.leaks, "output.leaks");
        check.list_out<calot_range>(o.removed, "output.removed");
        check.list_out<calot_range>(o.added, "output.added");
        check.list_out<calot_new_vertex>(o.new_vertices, "output.new_vertices");
    }
};

} // namespace detail
} // namespace calot
