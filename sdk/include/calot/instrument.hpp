// Instruments in C++: derive from calot::Instrument and export with CALOT_PLUGIN (plugin.hpp).
#pragma once

#include <calot/abi/instrument.h>
#include <calot/instance.hpp>

namespace calot {

class Instrument : public Instance {
  public:
    // Texts and spans live as long as the instance. Called after init; may throw.
    virtual void sheet(calot_instrument_sheet& out) = 0;
    virtual void part(std::uint32_t index, calot_part& out) = 0;
    virtual void configure(const calot_instrument_setup& setup) = 0;
    // Real-time: neither throws nor allocates; unless it returns ok, nothing has changed.
    virtual Result step(const calot_instrument_input& input, calot_instrument_output& output) = 0;
};

namespace detail {

struct InstrumentCell final : Cell {
    Instrument* instrument = nullptr;
};

struct InstrumentFunctions {
    static InstrumentCell& cell(void* self) {
        return static_cast<InstrumentCell&>(*static_cast<Cell*>(self));
    }

    static calot_status sheet(void* self, calot_instrument_sheet* out, calot_error* error) {
        InstrumentCell& c = cell(self);
        if (c.life == Life::created) return wrong_state(error, "sheet", "can only be called after init");
        Checker check(error);
        if (!check.whole(out, "out")) return check.status();
        return guarded(error, [&] {
            c.instrument->sheet(*out);
            return CALOT_OK;
        });
    }
    static calot_status part(void* self, std::uint32_t index, calot_part* out, calot_error* error) {
        InstrumentCell& c = cell(self);
        if (c.life == Life::created) return wrong_state(error, "part", "can only be called after init");
        Checker check(error);
        if (!check.whole(out, "out")) return check.status();
        return guarded(error, [&] {
            calot_instrument_sheet sheet{};
            sheet.struct_size = sizeof sheet;
            c.instrument->sheet(sheet);
            if (index >= sheet.part_count)
                throw Error(CALOT_CODE_OUT_OF_RANGE, "index", "the instrument has no such part");
            c.instrument->part(index, *out);
            return CALOT_OK;
        });
    }
    static calot_status configure(void* self, const calot_instrument_setup* setup, calot_error* error) {
        InstrumentCell& c = cell(self);
        if (!may_configure(c)) return only_while_inactive(error, "configure");
        Checker check(error);
        if (!check.whole(setup, "setup")) return check.status();
        check.real("setup.channel_diameter", setup->channel_diameter);
        check.require(setup->channel_diameter > 0, CALOT_CODE_OUT_OF_RANGE, "setup.channel_diameter",
                      "must be greater than 0");
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] {
            c.instrument->configure(*setup);
            c.life = Life::configured;
            return CALOT_OK;
        });
    }
    static calot_status step(void* self, const calot_instrument_input* input, calot_instrument_output* output,
                             calot_error* error) {
        InstrumentCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "step");
        Checker check(error);
        if (!check.whole(input, "input") || !check.whole(output, "output")) return check.status();
        check.reals("input.mount.position", input->mount.position, 3);
        check.unit("input.mount.quaternion", input->mount.quaternion, 4);
        check.reals("input.mount_twist.linear", input->mount_twist.linear, 3);
        check.reals("input.mount_twist.angular", input->mount_twist.angular, 3);
        check.real("input.insertion", input->insertion);
        check.real("input.opening", input->opening);
        check.real("input.rotation", input->rotation);
        check.list<calot_contact>(input->contacts, c.activation.max_contacts, "input.contacts");
        check.list<calot_reaction>(input->reactions, c.activation.max_actions, "input.reactions");
        if (check.is_ok()) check_lists(check, *input);
        check.list_out<calot_capsule>(output->shapes, "output.shapes");
        check.list_out<calot_pose>(output->parts, "output.parts");
        check.list_out<calot_action>(output->actions, "output.actions");
        check.sized(output->contact_impulse, 3 * input->contacts.count, true, "output.contact_impulse");
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] { return give(error, c.instrument->step(*input, *output)); });
    }
    static const calot_instrument* functions() {
        static const calot_instrument table{sizeof(calot_instrument), &sheet, &part, &configure, &step};
        return &table;
    }

    static void check_lists(Checker& check, const calot_instrument_input& in) {
        std::uint64_t i = 0;
        for (const calot_contact& k : items<calot_contact>(in.contacts)) {
            check.element("input.contacts", i, "point", k.point, 3);
            check.element("input.contacts", i, "normal", k.normal, 3);
            check.element("input.contacts", i, "axis_point", k.axis_point, 3);
            check.element("input.contacts", i, "free_position", k.free_position, 3);
            check.element("input.contacts", i, "compliance", k.compliance, 9);
            const double values[3] = {k.t, k.gap, k.friction};
            check.element("input.contacts", i++, "t, gap, friction", values, 3);
        }
        i = 0;
        for (const calot_reaction& r : items<calot_reaction>(in.reactions)) {
            check.element("input.reactions", i, "wrench_force", r.wrench_force, 3);
            check.element("input.reactions", i, "wrench_torque", r.wrench_torque, 3);
            check.element("input.reactions", i++, "amount", &r.amount, 1);
        }
    }
};

} // namespace detail
} // namespace calot
