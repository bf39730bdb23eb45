#include "app/case_parts.hpp"

#include "host/error.hpp"
#include "simulation/assets.hpp"
#include "simulation/endoscope_chain.hpp"
#include "simulation/plugin_call.hpp"

#include <calot/abi/plugin.h>
#include <calot/meshio/sha256.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>

namespace calot::app {
namespace {

namespace fs = std::filesystem;

std::string now_utc() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    gmtime_r(&now, &parts);
    std::array<char, 32> text;
    std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
    return text.data();
}

simulation::Plugin plugin(const host::Instance& instance) {
    if (!instance) return {};
    return {instance.id(), instance.abi()};
}

constexpr std::size_t max_scene_bytes = 1u << 20;

// The scene that a procedure writes.
std::string scene_text(const simulation::Plugin& procedure) {
    std::string all;
    const calot_sink sink{sizeof sink, &all, [](void* self, calot_bytes bytes) -> calot_status {
                              auto& to = *static_cast<std::string*>(self);
                              if (bytes.data == nullptr || bytes.size > max_scene_bytes - to.size())
                                  return CALOT_ERROR;
                              to.append(reinterpret_cast<const char*>(bytes.data), bytes.size);
                              return CALOT_OK;
                          }};
    simulation::call(procedure, "procedure.scene", simulation::functions<calot_procedure>(procedure).scene,
                     &sink);
    return all;
}

} // namespace

CaseParts::CaseParts(const CaseOptions& options, const cases::Journal* replay)
    : services(options.threads), plugins(services) {
    services.set("operator.skill", options.skill);
    services.set("operator.code", options.operator_code);
    choose(options, replay != nullptr);
    const simulation::Plugin p = plugin(procedure);
    const simulation::SceneDescription scene =
        simulation::parse_scene(scene_text(p), options.procedure + ": scene");
    simulation::WorldOptions world_options;
    world_options.assets = simulation::find_assets();
    world_options.anatomy = options.anatomy;
    world_options.meshes = {options.meshes.begin(), options.meshes.end()};
    if (!options.endoscope.empty())
        world_options.endoscope =
            simulation::find_datasheet(world_options.assets / "endoscopes", options.endoscope, "--endoscope");
    world = simulation::load_world(scene, world_options);
    read_instruments(options);
    describe(options, replay);
}

void CaseParts::choose(const CaseOptions& options, bool is_replay) {
    const host::Found found = plugins.find(host::Kind::procedure, options.procedure);
    title = found.model->title;

    std::string rod_id = options.rod;
    if (rod_id.empty()) {
        for (const host::Found& model : plugins.models(host::Kind::rod))
            if (rod_id.empty() && model.model->is_realtime) rod_id = model.model->id;
        if (rod_id.empty())
            throw host::UserError("--rod", "",
                                  "no real-time rod model is installed; `calot why ID` says why not");
    }
    if (!plugins.find(host::Kind::rod, rod_id).model->is_realtime)
        throw host::UserError(
            "--rod", "", rod_id + " is for comparisons, not for cases; choose another of `calot list rod`");

    std::string device_id = options.device;
    if (device_id.empty() && !is_replay) {
        if (options.is_headless) {
            const auto& demonstration = found.model->procedure->demonstration;
            throw host::UserError("--device", "",
                                  "is needed without a window; for example --device " +
                                      (demonstration ? demonstration->device : std::string("ID")));
        }
        for (const host::Found& model : plugins.models(host::Kind::device))
            if (device_id.empty() && model.candidate->reading.manifest->has_extension(CALOT_EXTENSION_EVENTS))
                device_id = model.model->id;
        if (device_id.empty())
            throw host::UserError("--device", "",
                                  "no device that takes the window's events is installed; give one "
                                  "of `calot list device`");
    }

    procedure = plugins.make(host::Kind::procedure, options.procedure);
    rod = plugins.make(host::Kind::rod, rod_id);
    if (!is_replay) device = plugins.make(host::Kind::device, device_id);
}

void CaseParts::read_instruments(const CaseOptions& options) {
    const auto& channels = world->endoscope.channels;
    instruments.resize(channels.size());
    for (const auto& [channel, name] : options.instruments) {
        std::size_t number = 0;
        const auto parsed = std::from_chars(channel.data(), channel.data() + channel.size(), number);
        if (parsed.ec != std::errc() || parsed.ptr != channel.data() + channel.size() || number < 1 ||
            number > channels.size())
            throw host::UserError("--instrument", channel,
                                  "is no channel of " + world->endoscope.title + "; it has " +
                                      std::to_string(channels.size()) + ", the first is 1");
        auto sheet = simulation::read_instrument(
            simulation::find_datasheet(simulation::find_assets() / "instruments", name, "--instrument"));
        if (sheet.diameter > channels[number - 1].diameter)
            throw host::UserError("--instrument", name,
                                  "is thicker than channel " + channel + " of " + world->endoscope.title +
                                      "; choose another channel or instrument");
        instruments[number - 1] = std::move(sheet);
    }
}

void CaseParts::describe(const CaseOptions& options, const cases::Journal* replay) {
    header.id = fs::path(options.folder).filename().string();
    header.version = CALOT_VERSION;
    header.created = now_utc();
    header.procedure = procedure.id();
    header.rod = rod.id();
    header.device = device ? device.id() : replay != nullptr ? replay->header.device : std::string();
    header.operator_code = options.operator_code;
    header.start = options.start;
    header.until = options.until;
    header.anatomy = world->anatomy.name;
    header.endoscope = options.endoscope;
    header.seed = options.seed;
    header.threads = options.threads;
    header.nodes = replay != nullptr ? replay->header.nodes : simulation::usual_nodes(world->endoscope);
    header.options["skill"] = options.skill;
    for (const auto& [organ, file] : options.meshes)
        header.options["mesh/" + organ] = file;
    for (const auto& [channel, name] : options.instruments)
        header.options["instrument/" + channel] = name;
    for (std::size_t k = 0; k < instruments.size(); ++k)
        if (!instruments[k].id.empty())
            header.hashes["instrument/" + std::to_string(k + 1)] = meshio::sha256_file(instruments[k].file);
    header.hashes["scene"] = world->scene_hash;
    header.hashes["endoscope"] = meshio::sha256_file(world->endoscope.file);
    for (const simulation::Organ& organ : world->anatomy.organs)
        header.hashes["mesh/" + organ.id] = organ.mesh_hash;
    for (const host::Instance* instance : {&procedure, &rod, &device})
        if (*instance) header.hashes["plugin/" + instance->id()] = instance->library_hash();
    if (replay != nullptr) { // its controls stand for the device, which is not loaded
        const auto recorded = replay->header.hashes.find("plugin/" + header.device);
        if (recorded != replay->header.hashes.end()) header.hashes.insert(*recorded);
    }
}

simulation::Setup CaseParts::setup(const CaseOptions& options, simulation::ControlSource* controls) {
    simulation::Setup setup;
    setup.world = world;
    setup.start = options.start;
    setup.rod = plugin(rod);
    setup.device = plugin(device);
    setup.procedure = plugin(procedure);
    setup.replay = controls;
    setup.seed = options.seed;
    setup.threads = options.threads;
    setup.nodes = header.nodes;
    setup.instruments = instruments;
    setup.until = options.until;
    return setup;
}

std::vector<cases::MetricDefinition> CaseParts::metrics() const {
    const simulation::Plugin p = plugin(procedure);
    const auto& functions = simulation::functions<calot_procedure>(p);
    std::vector<cases::MetricDefinition> list;
    const std::uint32_t count = std::min<std::uint32_t>(functions.metric_count(p.instance->self), 1000);
    for (std::uint32_t i = 0; i < count; ++i) {
        calot_metric metric{};
        metric.struct_size = sizeof metric;
        simulation::call(p, "procedure.metric", functions.metric, i, &metric);
        list.push_back({host::text(metric.id), host::text(metric.title), host::text(metric.unit),
                        host::text(metric.definition), host::text(metric.task)});
    }
    return list;
}

} // namespace calot::app
