// Everything a plugin in C++ needs, and the macro that exports it:
//
//   CALOT_PLUGIN(calot::export_rod<MyRod>("org.example.rod", "My rod", "1.0.0"))
//
// once, in one source file, outside any namespace. A library may hold several models, of several kinds.
#pragma once

#include <calot/abi/plugin.h>
#include <calot/device.hpp>
#include <calot/instance.hpp>
#include <calot/instrument.hpp>
#include <calot/math.hpp>
#include <calot/procedure.hpp>
#include <calot/rod.hpp>
#include <calot/tissue.hpp>

#include <array>
#include <cstring>
#include <memory>
#include <string_view>

namespace calot {

struct Export {
    std::string_view kind;
    std::string_view id;
    std::string_view title;
    std::string_view version;
    // Fills `out`; may throw.
    void (*create)(const Export& self, const calot_host* host, calot_instance& out);
};

namespace detail {

template<class CellType>
void hand_out(std::unique_ptr<CellType> cell, std::unique_ptr<Instance> object, const Export& self,
              const calot_host* host, const void* functions, calot_instance& out) {
    cell->attach(std::move(object), host, self.id);
    out = InstanceFunctions::make(static_cast<Cell*>(cell.release()), functions);
}

} // namespace detail

template<class T>
constexpr Export export_rod(std::string_view id, std::string_view title, std::string_view version) {
    return {CALOT_KIND_ROD, id, title, version,
            [](const Export& self, const calot_host* host, calot_instance& out) {
                auto cell = std::make_unique<detail::RodCell>();
                auto object = std::make_unique<T>();
                cell->rod = object.get();
                detail::hand_out(std::move(cell), std::move(object), self, host,
                                 detail::RodFunctions::functions(), out);
            }};
}

template<class T>
constexpr Export export_tissue(std::string_view id, std::string_view title, std::string_view version) {
    return {CALOT_KIND_TISSUE, id, title, version,
            [](const Export& self, const calot_host* host, calot_instance& out) {
                auto cell = std::make_unique<detail::TissueCell>();
                auto object = std::make_unique<T>();
                cell->tissue = object.get();
                detail::hand_out(std::move(cell), std::move(object), self, host,
                                 detail::TissueFunctions::functions(), out);
            }};
}

template<class T>
constexpr Export export_instrument(std::string_view id, std::string_view title, std::string_view version) {
    return {CALOT_KIND_INSTRUMENT, id, title, version,
            [](const Export& self, const calot_host* host, calot_instance& out) {
                auto cell = std::make_unique<detail::InstrumentCell>();
                auto object = std::make_unique<T>();
                cell->instrument = object.get();
                detail::hand_out(std::move(cell), std::move(object), self, host,
                                 detail::InstrumentFunctions::functions(), out);
            }};
}

template<class T>
constexpr Export export_device(std::string_view id, std::string_view title, std::string_view version) {
    return {CALOT_KIND_DEVICE, id, title, version,
            [](const Export& self, const calot_host* host, calot_instance& out) {
                auto cell = std::make_unique<detail::DeviceCell>();
                auto object = std::make_unique<T>();
                cell->device = object.get();
                cell->events = dynamic_cast<EventDevice*>(object.get());
                cell->observer = dynamic_cast<ObservingDevice*>(object.get());
                detail::hand_out(std::move(cell), std::move(object), self, host,
                                 detail::DeviceFunctions::functions(), out);
            }};
}

template<class T>
constexpr Export export_procedure(std::string_view id, std::string_view title, std::string_view version) {
    return {CALOT_KIND_PROCEDURE, id, title, version,
            [](const Export& self, const calot_host* host, calot_instance& out) {
                auto cell = std::make_unique<detail::ProcedureCell>();
                auto object = std::make_unique<T>();
                cell->procedure = object.get();
                detail::hand_out(std::move(cell), std::move(object), self, host,
                                 detail::ProcedureFunctions::functions(), out);
            }};
}

namespace detail {

// The models of one kind, in the order of the macro's arguments.
struct Shelf {
    std::string_view kind;
    std::span<const Export> exports;
    calot_factory factory;

    const Export* at(std::uint32_t index) const {
        for (const Export& e : exports)
            if (e.kind == kind && index-- == 0) return &e;
        return nullptr;
    }

    static std::uint32_t count(void* self) {
        std::uint32_t n = 0;
        for (const Export& e : static_cast<Shelf*>(self)->exports)
            n += e.kind == static_cast<Shelf*>(self)->kind;
        return n;
    }
    static calot_status info(void* self, std::uint32_t index, calot_model_info* out, calot_error* error) {
        Checker check(error);
        if (!check.whole(out, "out")) return check.status();
        const Export* e = static_cast<Shelf*>(self)->at(index);
        if (e == nullptr)
            return fail(error, CALOT_ERROR, CALOT_CODE_OUT_OF_RANGE, "index", "there is no such model");
        out->id = string(e->id), out->title = string(e->title), out->version = string(e->version);
        return CALOT_OK;
    }
    static calot_status create(void* self, calot_string id, const calot_host* host, calot_instance* out,
                               calot_error* error) {
        Checker check(error);
        if (!check.whole(out, "out") || !check.whole(host, "host")) return check.status();
        const Shelf& shelf = *static_cast<Shelf*>(self);
        for (const Export& e : shelf.exports) {
            if (e.kind != shelf.kind || e.id != view(id)) continue;
            return guarded(error, [&] {
                const std::uint64_t size = out->struct_size;
                e.create(e, host, *out);
                out->struct_size = size;
                return CALOT_OK;
            });
        }
        return fail(error, CALOT_ERROR, CALOT_CODE_UNSUPPORTED, "id",
                    "this library has no model with this id");
    }
};

class Library {
  public:
    explicit Library(std::span<const Export> exports) {
        constexpr std::string_view kinds[] = {CALOT_KIND_ROD, CALOT_KIND_TISSUE, CALOT_KIND_INSTRUMENT,
                                              CALOT_KIND_DEVICE, CALOT_KIND_PROCEDURE};
        for (std::size_t i = 0; i < shelves_.size(); ++i)
            shelves_[i] = {
                kinds[i],
                exports,
                {sizeof(calot_factory), &shelves_[i], &Shelf::count, &Shelf::info, &Shelf::create}};
    }
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;

    calot_status enter(const calot_host* host, calot_library* out, calot_error* error) {
        Checker check(error);
        if (!check.whole(host, "host") || !check.whole(out, "out")) return check.status();
        if (host->abi_major != CALOT_ABI_MAJOR || host->abi_minor != CALOT_ABI_MINOR ||
            host->abi_fingerprint != CALOT_ABI_FINGERPRINT)
            return fail(
                error, CALOT_ERROR, CALOT_CODE_VERSION, "host.abi_minor",
                "the host speaks another version of the contract: build the plugin against its headers");
        out->self = this;
        out->factory = [](void* self, calot_string kind) -> const calot_factory* {
            for (Shelf& shelf : static_cast<Library*>(self)->shelves_)
                if (shelf.kind == view(kind) && Shelf::count(&shelf) > 0) return &shelf.factory;
            return nullptr;
        };
        return CALOT_OK;
    }

  private:
    std::array<Shelf, 5> shelves_;
};

} // namespace detail
} // namespace calot

// Defines the library's two exported symbols.
#define CALOT_PLUGIN(...)                                                                                    \
    extern "C" {                                                                                             \
    CALOT_EXPORT extern const calot_descriptor calot_plugin_descriptor;                                      \
    const calot_descriptor calot_plugin_descriptor = {                                                       \
        {'C', 'A', 'L', 'O', 'T', 'P', 'L', 'G'}, CALOT_ABI_MAJOR, CALOT_ABI_MINOR, CALOT_ABI_FINGERPRINT};  \
    CALOT_EXPORT calot_status calot_plugin_entry(const calot_host* host, calot_library* out,                 \
                                                 calot_error* error) {                                       \
        static const calot::Export exports[] = {__VA_ARGS__};                                                \
        static calot::detail::Library library(exports);                                                      \
        return library.enter(host, out, error);                                                              \
    }                                                                                                        \
    }
