// What plugins of every kind are built on: a class with virtual functions, and the adapter that makes the
// contract's functions of it.
//
// The adapter keeps the order of life (create, init, configure, activate, step..., deactivate), refuses calls
// out of it with CALOT_CODE_WRONG_STATE, checks what comes in, keeps the parameters, frames the state's bytes
// and lets no exception out. The class only does its work.
#pragma once

#include <calot/abi/common.h>
#include <calot/check.hpp>
#include <calot/error.hpp>
#include <calot/host.hpp>
#include <calot/span.hpp>
#include <calot/state.hpp>

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace calot {

namespace detail {
struct Cell;
}

// One parameter of a model. Texts must outlive the library: use literals.
struct Parameter {
    std::string_view id;    // stable, lower-case words with hyphens
    std::string_view title; // for people
    std::string_view unit;  // SI, "" for a plain number
    double minimum = 0;
    double maximum = 1;
    double initial = 0;
    bool is_integer = false;
};

class Instance {
  public:
    Instance() = default;
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;
    virtual ~Instance() = default;

    // All of these may throw Error, Discard or any std::exception; the instance must then be as before.

    // Second part of construction: host() is there; may read assets.
    virtual void init() {}
    // Size every buffer here: steps must not allocate.
    virtual void activate(const calot_activation&) {}
    // Must not fail: join threads, close what was opened at activate.
    virtual void deactivate() {}
    // Back to the state just after activate, with this seed.
    virtual void reset(std::uint64_t seed) = 0;
    // Everything that steers the future, warm starts included.
    virtual void save(StateWriter& to) const = 0;
    // Reads what save wrote. If it throws, the adapter loads the former state again.
    virtual void load(StateReader& from) = 0;
    // Raise it when what save writes changes its meaning.
    virtual std::uint32_t state_version() const { return 1; }
    // The same table for the whole life of the instance. Values are asked for with parameter().
    virtual std::span<const Parameter> parameters() const { return {}; }
    // Functions of a feature that this layer does not know, or null. They are given the same self.
    virtual const void* extension(std::string_view) { return nullptr; }
    // Steps of another length are refused before activate is called. Nanoseconds.
    virtual std::int64_t shortest_step() const { return 1'000; }
    virtual std::int64_t longest_step() const { return 1'000'000'000; }

  protected:
    const Host& host() const { return host_; }
    double parameter(std::size_t index) const { return values_[index]; }

  private:
    friend struct detail::Cell;
    Host host_;
    std::vector<double> values_;
};

// Mixed in by a model that can say what the parts of its last step cost.
class Costed {
  public:
    virtual ~Costed() = default;
    virtual void enable_cost(bool is_on) = 0;
    virtual std::uint32_t cost_part_count() const = 0;
    virtual std::string_view cost_name(std::uint32_t index) const = 0;
    virtual double cost_seconds(std::uint32_t index) const = 0;
};

namespace detail {

enum class Life { created, initialised, configured, active };

// What `self` points to: the object, and where it is in its life.
struct Cell {
    std::unique_ptr<Instance> object;
    Costed* costed = nullptr;
    Life life = Life::created;
    bool needs_configure = true; // kinds without configure go from init to activate
    std::uint64_t model = 0;
    calot_activation activation{};

    virtual ~Cell() = default;
    // Functions of the extensions that this layer knows, beyond calot.cost/1.
    virtual const void* known_extension(std::string_view) { return nullptr; }

    void attach(std::unique_ptr<Instance> made, const calot_host* host, std::string_view id) {
        object = std::move(made);
        object->host_ = Host(host);
        for (const Parameter& p : object->parameters())
            object->values_.push_back(p.initial);
        costed = dynamic_cast<Costed*>(object.get());
        model = fnv1a(id);
    }
    std::vector<double>& values() { return object->values_; }
    bool can_activate() const {
        return life == Life::configured || (!needs_configure && life == Life::initialised);
    }
    Life inactive() const { return needs_configure ? Life::configured : Life::initialised; }
};

inline calot_status wrong_state(calot_error* error, const char* function, const char* when) noexcept {
    return fail(error, CALOT_ERROR, CALOT_CODE_WRONG_STATE, function, when);
}
inline calot_status only_while_active(calot_error* error, const char* function) noexcept {
    return wrong_state(error, function, "can only be called between activate and deactivate");
}
inline bool may_configure(const Cell& cell) {
    return cell.life == Life::initialised || cell.life == Life::configured;
}
inline calot_status only_while_inactive(calot_error* error, const char* function) noexcept {
    return wrong_state(error, function, "can only be called after init and not while active");
}

// Functions that every kind shares.
struct InstanceFunctions {
    static Cell& cell(void* self) { return *static_cast<Cell*>(self); }

    static calot_status init(void* self, calot_error* error) {
        Cell& c = cell(self);
        if (c.life != Life::created) return wrong_state(error, "init", "can only be called once");
        return guarded(error, [&] {
            c.object->init();
            c.life = Life::initialised;
            return CALOT_OK;
        });
    }
    static calot_status activate(void* self, const calot_activation* activation, calot_error* error) {
        Cell& c = cell(self);
        if (!c.can_activate())
            return wrong_state(error, "activate", "can only be called once configured and not while active");
        Checker check(error);
        if (!check.whole(activation, "activation")) return check.status();
        check.require(activation->step_nanoseconds >= c.object->shortest_step() &&
                          activation->step_nanoseconds <= c.object->longest_step(),
                      CALOT_CODE_OUT_OF_RANGE, "activation.step_nanoseconds",
                      "is shorter or longer than this model can step");
        if (!check.is_ok()) return check.status();
        return guarded(error, [&] {
            c.object->activate(*activation);
            c.activation = *activation;
            c.life = Life::active;
            return CALOT_OK;
        });
    }
    static calot_status deactivate(void* self, calot_error* error) {
        Cell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "deactivate");
        return guarded(error, [&] {
            c.object->deactivate();
            c.life = c.inactive();
            return CALOT_OK;
        });
    }
    static calot_status reset(void* self, std::uint64_t seed, calot_error* error) {
        Cell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "reset");
        return guarded(error, [&] {
            c.object->reset(seed);
            return CALOT_OK;
        });
    }
    static void destroy(void* self) {
        Cell* c = static_cast<Cell*>(self);
        if (c == nullptr) return;
        if (c->life == Life::active) {
            guarded(nullptr, [&] {
                c->object->deactivate();
                return CALOT_OK;
            });
        }
        delete c;
    }
    static calot_status save_state(void* self, const calot_sink* sink, calot_error* error) {
        Cell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "save_state");
        Checker check(error);
        if (!check.whole(sink, "sink")) return check.status();
        return guarded(error, [&] {
            StateWriter writer;
            c.object->save(writer);
            write_state(*sink, c.model, c.object->state_version(), writer.bytes());
            return CALOT_OK;
        });
    }
    static calot_status load_state(void* self, const calot_source* source, calot_error* error) {
        Cell& c = cell(self);
        if (c.life != Life::active) return only_while_active(error, "load_state");
        Checker check(error);
        if (!check.whole(source, "source")) return check.status();
        return guarded(error, [&] {
            const auto payload = read_state(*source, c.model, c.object->state_version());
            StateWriter former;
            c.object->save(former);
            try {
                StateReader reader(payload);
                c.object->load(reader);
                if (!reader.at_end()) StateReader::corrupt("holds more than this instance");
            } catch (...) {
                StateReader reader(former.bytes());
                c.object->load(reader);
                throw;
            }
            return CALOT_OK;
        });
    }

    static std::uint32_t parameter_count(void* self) {
        return static_cast<std::uint32_t>(cell(self).values().size());
    }
    static calot_status parameter_info(void* self, std::uint32_t index, calot_parameter* out,
                                       calot_error* error) {
        Cell& c = cell(self);
        Checker check(error);
        if (!check.whole(out, "out") || !known(check, c, index)) return check.status();
        return guarded(error, [&] {
            const Parameter& p = c.object->parameters()[index];
            *out = {out->struct_size, string(p.id), string(p.title),
                    string(p.unit),   p.minimum,    p.maximum,
                    p.initial,        p.is_integer, 0};
            return CALOT_OK;
        });
    }
    static calot_status get_parameter(void* self, std::uint32_t index, double* out, calot_error* error) {
        Cell& c = cell(self);
        Checker check(error);
        if (!known(check, c, index)) return check.status();
        if (out == nullptr) return fail(error, CALOT_ERROR, CALOT_CODE_INVALID_ARGUMENT, "out", "is missing");
        *out = c.values()[index];
        return CALOT_OK;
    }
    static calot_status set_parameter(void* self, std::uint32_t index, double value, calot_error* error) {
        Cell& c = cell(self);
        Checker check(error);
        if (!known(check, c, index)) return check.status();
        if (c.life == Life::active)
            return wrong_state(error, "set_parameter", "can not be called while active");
        if (!std::isfinite(value))
            return fail(error, CALOT_DISCARD, CALOT_CODE_NOT_FINITE, "value", "is not a finite number");
        return guarded(error, [&] {
            const Parameter& p = c.object->parameters()[index];
            const double clamped = value < p.minimum ? p.minimum : value > p.maximum ? p.maximum : value;
            c.values()[index] = p.is_integer ? std::round(clamped) : clamped;
            return CALOT_OK;
        });
    }

    static const void* extension(void* self, calot_string id) {
        Cell& c = cell(self);
        const std::string_view name = view(id);
        static const calot_cost cost{sizeof(calot_cost),
                                     [](void* s, std::uint32_t on) { cell(s).costed->enable_cost(on != 0); },
                                     [](void* s) { return cell(s).costed->cost_part_count(); },
                                     [](void* s, std::uint32_t index, calot_string* part, double* seconds) {
                                         const Costed& costed = *cell(s).costed;
                                         const bool is_known = index < costed.cost_part_count();
                                         if (part != nullptr)
                                             *part = string(is_known ? costed.cost_name(index) : "");
                                         if (seconds != nullptr)
                                             *seconds = is_known ? costed.cost_seconds(index) : 0;
                                     }};
        if (name == CALOT_EXTENSION_COST && c.costed != nullptr) return &cost;
        const void* functions = c.known_extension(name);
        if (functions != nullptr) return functions;
        guarded(nullptr, [&] {
            functions = c.object->extension(name);
            return CALOT_OK;
        });
        return functions;
    }

    static calot_instance make(Cell* c, const void* kind) {
        return {sizeof(calot_instance),
                c,
                kind,
                &init,
                &activate,
                &deactivate,
                &reset,
                &destroy,
                &save_state,
                &load_state,
                &parameter_count,
                &parameter_info,
                &get_parameter,
                &set_parameter,
                &extension};
    }

  private:
    static bool known(Checker& check, Cell& c, std::uint32_t index) {
        if (index >= c.values().size())
            check.refuse(CALOT_CODE_OUT_OF_RANGE, "index", "no parameter has this index", CALOT_ERROR);
        return check.is_ok();
    }
};

} // namespace detail
} // namespace calot
