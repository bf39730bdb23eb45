// Procedures in C++: derive from calot::Procedure and export with CALOT_PLUGIN (plugin.hpp).
#pragma once

#include <calot/abi/procedure.h>
#include <calot/abi/tissue.h>
#include <calot/instance.hpp>
#include <calot/math.hpp>

namespace calot {

// Texts of these tables must outlive the library: use literals.
struct TaskInfo {
    std::string_view id, title, goal;
    bool is_required = true;
};
struct MetricInfo {
    std::string_view id, title, unit, definition, task;
};
struct FailureInfo {
    std::string_view id, title;
};

// The snapshot's queries. Real-time.
class SnapshotView {
  public:
    explicit SnapshotView(const calot_snapshot& s) : s_(s) {}
    bool pose(std::string_view id, calot_pose& out) const { return s_.pose(s_.self, string(id), &out) != 0; }
    // Position, normal, radius and polyline of what the anatomy marks by this id.
    bool landmark(std::string_view id, calot_marker& out) const {
        out.struct_size = sizeof out;
        return s_.landmark(s_.self, string(id), &out) != 0;
    }
    // UINT32_MAX where the scene has no such organ.
    std::uint32_t organ(std::string_view id) const { return s_.organ(s_.self, string(id)); }
    bool quantity(std::string_view id, double& out) const {
        return s_.quantity(s_.self, string(id), &out) != 0;
    }
    std::size_t node_count() const { return s_.centreline.size / 3; }
    Vec3 node(std::size_t i) const { return vec3(s_.centreline.data + 3 * i); }

  private:
    const calot_snapshot& s_;
};

// Queue of commands. Real-time. All return false when the queue is full.
class Commands {
  public:
    explicit Commands(const calot_commands& queue) : queue_(queue) {}

    bool set_marker(calot_marker marker) {
        marker.struct_size = sizeof marker;
        calot_command c = command(CALOT_COMMAND_MARKER_SET, marker.id);
        c.marker = &marker;
        return push(c);
    }
    bool remove_marker(std::string_view id) { return push(command(CALOT_COMMAND_MARKER_REMOVE, string(id))); }
    bool begin_task(std::string_view id) { return push(command(CALOT_COMMAND_TASK_BEGIN, string(id))); }
    bool complete_task(std::string_view id) { return push(command(CALOT_COMMAND_TASK_COMPLETE, string(id))); }
    bool metric(std::string_view id, double value, std::string_view task) {
        calot_command c = command(CALOT_COMMAND_METRIC, string(id));
        c.value = value;
        c.text = string(task);
        return push(c);
    }
    bool event(std::string_view id, std::string_view text) {
        calot_command c = command(CALOT_COMMAND_EVENT, string(id));
        c.text = string(text);
        return push(c);
    }
    bool message(std::string_view text, double seconds) {
        calot_command c = command(CALOT_COMMAND_MESSAGE, {});
        c.text = string(text);
        c.value = seconds;
        return push(c);
    }
    bool fail(std::string_view id) { return push(command(CALOT_COMMAND_FAILURE, string(id))); }
    bool finish() { return push(command(CALOT_COMMAND_FINISH, {})); }
    // Whatever has no function of its own here.
    bool push(const calot_command& c) { return queue_.push(queue_.self, &c) == CALOT_OK; }

    static calot_command command(std::uint32_t kind, calot_string id) {
        calot_command c{};
        c.struct_size = sizeof c;
        c.kind = kind;
        c.id = id;
        c.pose.quaternion[0] = 1;
        return c;
    }

  private:
    const calot_commands& queue_;
};

class Procedure : public Instance {
  public:
    // TOML as docs/scenes.md says. Called after init; may throw.
    virtual std::string scene() = 0;
    // In the order in which they are performed; the same for the whole life of the instance.
    virtual std::span<const TaskInfo> tasks() const = 0;
    virtual std::span<const MetricInfo> metrics() const { return {}; }
    virtual std::span<const FailureInfo> failures() const { return {}; }
    // What the host built from the scene; may throw.
    virtual void configure(const calot_procedure_setup& setup) = 0;
    // Real-time: neither throws nor allocates.
    virtual Result update(const calot_snapshot& snapshot, Commands& commands) = 0;
};

namespace detail {

struct ProcedureCell final : Cell {
    Procedure* procedure = nullptr;
    std::uint64_t nodes = 0;
};

struct ProcedureFunctions {
    static ProcedureCell& cell(void* self) { return static_cast<ProcedureCell&>(*static_cast<Cell*>(self)); }

    static calot_status scene(void* self, const calot_sink* sink, calot_error* error) {
        ProcedureCell& c = cell(self);
        if (c.life == Life::created) return wrong_state(error, "scene", "can only be called after init");
        Checker check(error);
        if (!check.whole(sink, "sink")) return check.status();
        return guarded(error, [&] {
            const std::string text = c.procedure->scene();
            const calot_bytes all{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
            if (sink->write(sink->self, all) != CALOT_OK)
                throw Error(CALOT_CODE_CAPACITY, "sink", "the sink did not take the scene");
            return CALOT_OK;
        });
    }
    static std::uint32_t task_count(void* self) {
        return static_cast<std::uint32_t>(cell(self).procedure->tasks().size());
    }
    static calot_status task(void* self, std::uint32_t index, calot_task* out, calot_error* error) {
        return entry(cell(self).procedure->tasks(), index, out, error, [](const TaskInfo& t, calot_task& o) {
            o.id = string(t.id), o.title = string(t.title), o.goal = string(t.goal);
            o.is_required = t.is_required, o.reserved = 0;
        });
    }
    static std::uint32_t metric_count(void* self) {
        return static_cast<std::uint32_t>(cell(self).procedure->metrics().size());
    }
    static calot_status metric(void* self, std::uint32_t index, calot_metric* out, calot_error* error) {
        return entry(cell(self).procedure->metrics(), index, out, error,
                     [](const MetricInfo& m, calot_metric& o) {
                         o.id = string(m.id), o.title = string(m.title), o.unit = string(m.unit);
                         o.definition = string(m.definition), o.task = string(m.task);
                     });
    }
    static std::uint32_t failure_count(void* self) {
        return static_cast<std::uint32_t>(cell(self).procedure->failures().size());
    }
    static calot_status failure(void* self, std::uint32_t index, calot_failure* out, calot_error* error) {
        return entry(
            cell(self).procedure->failures(), index, out, error,
            [](const FailureInfo& f, calot_failure& o) { o.id = string(f.id), o.title = string(f.title); });
    }
    static calot_status configure(void* self, const calot_procedure_setup* setup, calot_error* error) {
        ProcedureCell& c = cell(self);
        if (!may_configure(c)) return only_while_inactive(error, "configure");
        Checker check(error);
        if (!check.whole(setup, "setup")) return check.status();
        check.real("setup.shaft_radius", setup->shaft_radius);
        check.real("setup.shaft_length", setup->shaft_length);
        check.require(setup->shaft_radius > 0 && setup->shaft_length > 0, CALOT_CODE_OUT_OF_RANGE,
                      "setup.shaft_length", "the shaft must have a radius and a length");
        check.require(setup->node_count >= 3, CALOT_CODE_OUT_OF_RANGE, "setup.node_count",
                      "a centreline has at least 3 nodes");
        check_snapshot(check, setup->start, setup->node_count, "setup.start");
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] {
            c.procedure->configure(*setup);
            c.nodes = setup->node_count;
            c.life = Life::configured;
            return CALOT_OK;
        });
    }
    static calot_status update(void* self, const calot_snapshot* snapshot, const calot_commands* commands,
                               calot_error* error) {
        ProcedureCell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "update");
        Checker check(error);
        if (!check.whole(commands, "commands")) return check.status();
        check_snapshot(check, snapshot, c.nodes, "snapshot");
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] {
            Commands queue(*commands);
            return give(error, c.procedure->update(*snapshot, queue));
        });
    }
    static const calot_procedure* functions() {
        static const calot_procedure table{
            sizeof(calot_procedure), &scene,   &task_count, &task,  &metric_count, &metric,
            &failure_count,          &failure, &configure,  &update};
        return &table;
    }

    static void check_snapshot(Checker& check, const calot_snapshot* s, std::uint64_t nodes,
                               const char* field) {
        if (!check.whole(s, field)) return;
        check.require(s->pose != nullptr && s->landmark != nullptr && s->organ != nullptr &&
                          s->quantity != nullptr,
                      CALOT_CODE_INVALID_ARGUMENT, "snapshot.pose", "a query is missing");
        check.pose("snapshot.tip", s->tip);
        check.reals("snapshot.tip_twist.linear", s->tip_twist.linear, 3);
        check.reals("snapshot.tip_twist.angular", s->tip_twist.angular, 3);
        check.sized(s->centreline, 3 * nodes, false, "snapshot.centreline");
        check.reals("snapshot.centreline", s->centreline);
        check.sized(s->velocity, 3 * nodes, true, "snapshot.velocity");
        check.reals("snapshot.velocity", s->velocity);
        check.list<calot_contact_report>(s->contacts, UINT32_MAX, "snapshot.contacts");
        check.list<calot_clip>(s->clips, UINT32_MAX, "snapshot.clips");
        check.list<calot_leak>(s->leaks, UINT32_MAX, "snapshot.leaks");
        check.list<calot_tissue_event>(s->events, UINT32_MAX, "snapshot.events");
        check.list<calot_seen_strand>(s->strands, UINT32_MAX, "snapshot.strands");
        check.list<calot_seen_instrument>(s->instruments, UINT32_MAX, "snapshot.instruments");
        check.list<calot_action>(s->actions, UINT32_MAX, "snapshot.actions");
        if (!check.is_ok()) return;
        std::uint64_t i = 0;
        for (const calot_contact_report& k : items<calot_contact_report>(s->contacts)) {
            check.element("snapshot.contacts", i, "point", k.point, 3);
            check.element("snapshot.contacts", i, "normal", k.normal, 3);
            check.element("snapshot.contacts", i++, "force", k.force, 3);
        }
    }

  private:
    template<class Info, class Out, class Fill>
    static calot_status entry(std::span<const Info> table, std::uint32_t index, Out* out, calot_error* error,
                              Fill fill) {
        Checker check(error);
        if (!check.whole(out, "out")) return check.status();
        if (index >= table.size())
            return detail::fail(error, CALOT_ERROR, CALOT_CODE_OUT_OF_RANGE, "index",
                                "there is no such entry");
        fill(table[index], *out);
        return CALOT_OK;
    }
};

} // namespace detail
} // namespace calot
