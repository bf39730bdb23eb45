// calot without a subcommand: the launcher.
#include "app/case_folder.hpp"
#include "app/commands.hpp"
#include "host/error.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"
#include "launcher/launcher.hpp"

#include <calot/abi/device.h>

#include <cstdlib>
#include <filesystem>

namespace calot::app {

int launch() {
    if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr)
        throw host::UserError("DISPLAY", "",
                              "is not set: there is no display for the launcher; `calot run --help` "
                              "says how to run a case without one");
    host::Services services;
    const host::Plugins plugins(services);
    launcher::LauncherSettings settings;
    for (const host::Found& found : plugins.models(host::Kind::procedure)) {
        const host::Model& model = *found.model;
        const host::ProcedureCard& card = *model.procedure;
        launcher::ProcedureEntry entry;
        entry.id = model.id;
        entry.title = model.title;
        entry.specialty = card.specialty;
        entry.level = card.level;
        entry.minutes = card.minutes;
        entry.description = card.description;
        entry.picture = found.candidate->reading.manifest->folder() / card.picture;
        if (card.demonstration) {
            entry.demonstration = card.demonstration->device;
            entry.demonstration_seed = card.demonstration->seed;
        }
        settings.procedures.push_back(std::move(entry));
    }
    for (const host::Found& found : plugins.models(host::Kind::device)) {
        settings.devices.push_back({found.model->id, found.model->title});
        if (settings.preferred_device.empty() &&
            found.candidate->reading.manifest->has_extension(CALOT_EXTENSION_EVENTS))
            settings.preferred_device = found.model->id;
    }
    for (const host::Candidate& candidate : plugins.candidates())
        if (!candidate.refusal.empty()) settings.refusals.push_back(candidate.refusal);
    settings.program = std::filesystem::read_symlink("/proc/self/exe");
    settings.cases_folder = cases_folder();
    launcher::Launcher(std::move(settings)).run();
    return completed;
}

} // namespace calot::app
