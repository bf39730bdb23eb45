#include "host/library.hpp"

#include "host/blame.hpp"
#include "host/error.hpp"
#include "host/exports.hpp"
#include "host/instance.hpp"

#include <calot/meshio/sha256.hpp>

#include <algorithm>
#include <cstring>
#include <dlfcn.h>
#include <link.h>

namespace calot::host {
namespace {

const char* const rebuild = "rebuild the plugin with calot_add_plugin() of this SDK";

std::string list(const std::vector<std::string>& names) {
    std::string all;
    for (std::size_t i = 0; i < names.size() && i < 5; ++i)
        all += (i == 0 ? "" : ", ") + names[i];
    return names.size() > 5 ? all + " and " + std::to_string(names.size() - 5) + " more" : all;
}

calot_error fresh_error() {
    calot_error error{};
    error.struct_size = sizeof error;
    return error;
}

std::string message_of(const calot_error& error) {
    const std::string field(error.field, strnlen(error.field, sizeof error.field));
    const std::string message(error.message, strnlen(error.message, sizeof error.message));
    return field + (field.empty() || message.empty() ? "" : ": ") + message;
}

} // namespace

void Library::refuse(const std::string& what, const std::string& remedy) const {
    throw UserError(file_, "", what + "; " + remedy);
}

Library::Library(const Manifest& manifest, Services& services)
    : id_(manifest.id), file_(manifest.library_file().string()), host_(services, manifest) {
    try {
        const Exports exports = read_exports(file_);
        std::vector<std::string> extra;
        for (const std::string& name : exports.names)
            if (name != CALOT_DESCRIPTOR_SYMBOL && name != CALOT_ENTRY_SYMBOL) extra.push_back(name);
        if (!extra.empty()) refuse("exports more than the contract's two symbols: " + list(extra), rebuild);
        if (!exports.unique.empty()) refuse("exports unique symbols: " + list(exports.unique), rebuild);
        for (const char* needed : {CALOT_DESCRIPTOR_SYMBOL, CALOT_ENTRY_SYMBOL})
            if (std::find(exports.names.begin(), exports.names.end(), needed) == exports.names.end())
                refuse(std::string("does not itself export ") + needed, rebuild);
        hash_ = meshio::sha256_file(file_);
    } catch (const UserError&) {
        throw;
    } catch (const std::exception& e) {
        refuse(e.what(), "build or install the plugin again");
    }
    open();
    negotiate();
    compare_models(manifest);
}

void Library::open() {
    const Call mark(name(), "load");
    handle_ = dlopen(file_.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (handle_ == nullptr) {
        std::string why = dlerror();
        if (why.starts_with(file_ + ": ")) why.erase(0, file_.size() + 2);
        refuse("cannot be loaded: " + why, "install what is missing, or rebuild the plugin");
    }
    link_map* own = nullptr;
    dlinfo(handle_, RTLD_DI_LINKMAP, &own);
    const auto find = [&](const char* symbol) {
        void* address = dlsym(handle_, symbol);
        Dl_info where{};
        link_map* map = nullptr;
        if (address == nullptr ||
            dladdr1(address, &where, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP) == 0)
            refuse(std::string("does not export ") + symbol, rebuild);
        if (map != own)
            refuse(std::string(symbol) + " comes from its dependency " + where.dli_fname +
                       ", not from itself",
                   rebuild);
        return address;
    };
    calot_descriptor descriptor;
    std::memcpy(&descriptor, find(CALOT_DESCRIPTOR_SYMBOL), sizeof descriptor);
    entry_ = reinterpret_cast<calot_entry>(find(CALOT_ENTRY_SYMBOL));
    if (std::memcmp(descriptor.magic, CALOT_MAGIC, sizeof descriptor.magic) != 0)
        refuse(CALOT_DESCRIPTOR_SYMBOL " does not begin with " CALOT_MAGIC, rebuild);
    if (descriptor.abi_major != CALOT_ABI_MAJOR || descriptor.abi_minor != CALOT_ABI_MINOR)
        refuse("is built for version " + std::to_string(descriptor.abi_major) + "." +
                   std::to_string(descriptor.abi_minor) +
                   " of the contract, though its manifest says otherwise; "
                   "this Calot has " +
                   std::to_string(CALOT_ABI_MAJOR) + "." + std::to_string(CALOT_ABI_MINOR),
               rebuild);
    if (descriptor.abi_fingerprint != CALOT_ABI_FINGERPRINT)
        refuse("is built with other headers of the contract than this Calot (its fingerprint differs), "
               "though its manifest says otherwise",
               rebuild);
}

void Library::negotiate() {
    const Call mark(name(), "entry");
    library_.struct_size = sizeof library_;
    calot_error error = fresh_error();
    if (entry_(host_.abi(), &library_, &error) != CALOT_OK)
        refuse("refuses this Calot: " + message_of(error), "use a version of the plugin made for it");
    if (library_.struct_size < sizeof library_ || library_.factory == nullptr)
        refuse("its entry hands out no factories", rebuild);
}

void Library::compare_models(const Manifest& manifest) {
    const Call mark(name(), "factory");
    const std::string correct = "correct the plugin's plugin.toml.in or its CALOT_PLUGIN, and rebuild it";
    std::size_t offered = 0;
    for (const Kind kind : all_kinds) {
        const std::string word(kind_name(kind));
        const calot_factory* factory = library_.factory(library_.self, abi_string(kind_name(kind)));
        if (factory == nullptr) continue;
        if (factory->struct_size < sizeof(calot_factory) || factory->count == nullptr ||
            factory->info == nullptr || factory->create == nullptr)
            refuse("its factory of kind " + word + " lacks functions", rebuild);
        factories_[static_cast<int>(kind)] = factory;
        const std::uint32_t count = factory->count(factory->self);
        if (count > 32) refuse("offers more than 32 models of kind " + word, correct);
        for (std::uint32_t i = 0; i < count; ++i) {
            calot_model_info info{};
            info.struct_size = sizeof info;
            calot_error error = fresh_error();
            if (factory->info(factory->self, i, &info, &error) != CALOT_OK)
                refuse("does not describe its " + word + " " + std::to_string(i) + ": " + message_of(error),
                       correct);
            ++offered;
            const std::string id = text(info.id);
            const auto declared = std::find_if(manifest.models.begin(), manifest.models.end(),
                                               [&](const Model& m) { return m.kind == kind && m.id == id; });
            if (declared == manifest.models.end())
                refuse("offers the " + word + " \"" + id + "\", which its manifest does not name", correct);
            if (declared->title != text(info.title) || declared->version != text(info.version))
                refuse("says \"" + text(info.title) + "\" " + text(info.version) + " of " + id +
                           ", its manifest \"" + declared->title + "\" " + declared->version,
                       correct);
        }
    }
    if (offered != manifest.models.size())
        refuse("offers " + std::to_string(offered) + " models, its manifest names " +
                   std::to_string(manifest.models.size()),
               correct);
}

} // namespace calot::host
