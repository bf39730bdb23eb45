// calot list, calot why
#include "app/commands.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"

#include <CLI/CLI.hpp>

#include <iostream>
#include <memory>

namespace calot::app {
namespace {

using host::Candidate;
using host::Model;
using host::Plugins;

std::string joined(const std::vector<std::string>& parts) {
    std::string all;
    for (const std::string& part : parts)
        all += (all.empty() ? "" : ", ") + part;
    return all;
}

int list(const std::string& wanted, bool as_json) {
    host::Services services;
    Plugins plugins(services);
    std::string models, refused, table, refusals;
    for (const host::Kind kind : host::all_kinds) {
        const std::string word(host::kind_name(kind));
        if (!wanted.empty() && wanted != word) continue;
        for (const host::Found& found : plugins.models(kind)) {
            if (!plugins.probe(*found.candidate).empty()) continue;
            const Model& m = *found.model;
            std::string line = word;
            line.resize(12, ' ');
            line += m.id;
            if (line.size() < 56) line.resize(56, ' ');
            table +=
                line + " " + m.version + "  " + m.title + (m.is_realtime ? "" : " (not for cases)") + "\n";
            models += (models.empty() ? "" : ",") + std::string("\n  {\"kind\": ") + json_text(word) +
                      ", \"id\": " + json_text(m.id) + ", \"version\": " + json_text(m.version) +
                      ", \"title\": " + json_text(m.title) +
                      ", \"realtime\": " + (m.is_realtime ? "true" : "false") +
                      ", \"manifest\": " + json_text(found.candidate->file.string()) + "}";
        }
    }
    for (const Candidate& candidate : plugins.candidates()) {
        const std::string reason = plugins.probe(candidate);
        if (reason.empty()) continue;
        const std::string ids = joined(candidate.reading.ids);
        refusals += "  " + (ids.empty() ? "" : ids + ": ") + reason + "\n";
        std::string list_of_ids;
        for (const std::string& id : candidate.reading.ids)
            list_of_ids += (list_of_ids.empty() ? "" : ", ") + json_text(id);
        refused += (refused.empty() ? "" : ",") + std::string("\n  {\"ids\": [") + list_of_ids +
                   "], \"manifest\": " + json_text(candidate.file.string()) +
                   ", \"reason\": " + json_text(reason) + "}";
    }
    if (as_json) {
        std::cout << "{\"models\": [" << models << "],\n \"refused\": [" << refused << "]}\n";
        return completed;
    }
    if (table.empty()) table = "Nothing is there. `calot why ID` shows where was looked.\n";
    std::cout << table;
    if (!refusals.empty()) std::cout << "Refused:\n" << refusals;
    return completed;
}

int why(const std::string& id, bool as_json) {
    host::Services services;
    Plugins plugins(services);
    std::string places, findings, json_places, json_findings;
    for (const host::Place& place : plugins.places()) {
        const std::string count =
            place.exists ? std::to_string(place.manifest_count) + " manifests" : "no such folder";
        places += "  " + place.folder.string() + " (" + place.origin + "): " + count + "\n";
        json_places += (json_places.empty() ? "" : ",") + std::string("\n  {\"folder\": ") +
                       json_text(place.folder.string()) + ", \"origin\": " + json_text(place.origin) +
                       ", \"exists\": " + (place.exists ? "true" : "false") +
                       ", \"manifests\": " + std::to_string(place.manifest_count) + "}";
    }
    bool is_usable = false;
    const auto add = [&](const Candidate& candidate, const std::string& reason, const Model* model) {
        std::string line = candidate.file.string() + ": ";
        if (reason.empty() && model == nullptr)
            line += "sound; the plugin holds: ";
        else if (reason.empty())
            line += "sound: " + std::string(host::kind_name(model->kind)) + " \"" + model->title + "\" " +
                    model->version + (model->is_realtime ? "" : ", not offered for cases");
        else
            line = "refused: " + reason;
        if (reason.empty() && model == nullptr) {
            std::vector<std::string> ids;
            for (const Model& m : candidate.reading.manifest->models)
                ids.push_back(m.id);
            line += joined(ids);
        }
        findings += "  " + line + "\n";
        json_findings += (json_findings.empty() ? "" : ",") + std::string("\n  {\"manifest\": ") +
                         json_text(candidate.file.string()) + ", \"reason\": " + json_text(reason) + "}";
        is_usable = is_usable || reason.empty();
    };
    std::size_t unreadable = 0;
    for (const Candidate& candidate : plugins.candidates()) {
        if (candidate.holds(id))
            add(candidate, plugins.probe(candidate), candidate.model(id));
        else if (candidate.reading.ids.empty())
            ++unreadable;
    }
    if (as_json) {
        std::cout << "{\"id\": " << json_text(id) << ", \"usable\": " << (is_usable ? "true" : "false")
                  << ",\n \"places\": [" << json_places << "],\n \"found\": [" << json_findings << "]}\n";
        return completed;
    }
    std::cout << id << (is_usable ? " can be used.\n" : " can't be used.\n") << "Looked into:\n" << places;
    if (findings.empty())
        std::cout << "No manifest there has this id. Check its spelling with `calot list`, or add the "
                     "plugin's folder to CALOT_PLUGIN_PATH.\n";
    else
        std::cout << "Found:\n" << findings;
    if (unreadable > 0) {
        std::cout << "Manifests whose id cannot be read:\n";
        for (const Candidate& candidate : plugins.candidates())
            if (candidate.reading.ids.empty()) std::cout << "  " << candidate.refusal << "\n";
    }
    return completed;
}

struct Options {
    std::string word;
    bool as_json = false;
};

} // namespace

void add_list(CLI::App& app, Action& action) {
    const auto options = std::make_shared<Options>();
    CLI::App* list_command = app.add_subcommand("list", "Show the plugins that are there, and those refused");
    list_command->add_option("KIND", options->word, "only rod, tissue, instrument, device or procedure")
        ->check(CLI::IsMember({"rod", "tissue", "instrument", "device", "procedure"}));
    list_command->add_flag("--json", options->as_json, "print one JSON object");
    list_command->footer(
        examples({"calot list", "calot list rod", "CALOT_PLUGIN_PATH=~/plugins calot list --json"}));
    list_command->callback([=, &action] { action = [=] { return list(options->word, options->as_json); }; });

    CLI::App* why_command =
        app.add_subcommand("why", "Say where a plugin was looked for, and why it is refused");
    why_command->add_option("ID", options->word, "id of a model or a plugin")->required();
    why_command->add_flag("--json", options->as_json, "print one JSON object");
    why_command->footer(examples({"calot why org.calot.rod-cosserat"}));
    why_command->callback([=, &action] { action = [=] { return why(options->word, options->as_json); }; });
}

} // namespace calot::app
