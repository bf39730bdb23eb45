#include "host/plugins.hpp"

#include "host/blame.hpp"
#include "host/library.hpp"
#include "host/probe.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <system_error>

namespace calot::host {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_folders = 1000; // below one place

void look_into(Place& place, std::size_t number, std::vector<Candidate>& candidates) {
    std::error_code problem;
    place.exists = fs::is_directory(place.folder, problem);
    if (!place.exists) return;
    std::vector<fs::path> folders;
    fs::directory_iterator entries(place.folder, fs::directory_options::skip_permission_denied, problem);
    for (; !problem && entries != fs::directory_iterator() && folders.size() < max_folders;
         entries.increment(problem))
        folders.push_back(entries->path());
    std::sort(folders.begin(), folders.end());     // whatever order the file system has
    folders.insert(folders.begin(), place.folder); // a place may also be one plugin's folder
    for (const fs::path& folder : folders) {
        const fs::path file = folder / "plugin.toml";
        if (!fs::exists(file, problem)) continue;
        ++place.manifest_count;
        Candidate candidate;
        candidate.file = file;
        candidate.place = number;
        candidate.reading = read_manifest(file);
        if (candidate.reading.manifest) {
            const Manifest& manifest = *candidate.reading.manifest;
            candidate.refusal = misfit(manifest);
            if (candidate.refusal.empty() && !fs::is_regular_file(manifest.library_file(), problem))
                candidate.refusal =
                    UserError(file.string(), "library",
                              "\"" + manifest.library + "\" is not there; build or install the plugin again")
                        .what();
        } else {
            candidate.refusal = candidate.reading.refusal;
        }
        candidates.push_back(std::move(candidate));
    }
}

// The first of an id wins; a later one is refused.
void refuse_duplicates(std::vector<Candidate>& candidates) {
    std::map<std::string, fs::path> first;
    for (Candidate& candidate : candidates) {
        if (!candidate.refusal.empty()) continue;
        const Manifest& manifest = *candidate.reading.manifest;
        for (const Model& model : manifest.models) {
            const auto [known, is_new] = first.emplace(model.id, candidate.file);
            if (is_new || !candidate.refusal.empty()) continue;
            candidate.refusal = UserError(candidate.file.string(), "id",
                                          "\"" + model.id + "\" is already given by " +
                                              known->second.string() + "; rename or remove one of them")
                                    .what();
        }
    }
}

} // namespace

bool Candidate::holds(std::string_view id) const {
    return std::find(reading.ids.begin(), reading.ids.end(), id) != reading.ids.end() || model(id) != nullptr;
}

const Model* Candidate::model(std::string_view id) const {
    if (!reading.manifest) return nullptr;
    for (const Model& model : reading.manifest->models)
        if (model.id == id) return &model;
    return nullptr;
}

Plugins::Options Plugins::defaults() {
    Options options;
    std::error_code problem;
    const fs::path programs = fs::read_symlink("/proc/self/exe", problem).parent_path();
    options.probe_program = programs / "calot-probe";
    options.places.push_back(
        {(programs.parent_path() / "lib/calot/plugins"), "beside the program", false, 0});
    const char* more = std::getenv("CALOT_PLUGIN_PATH");
    std::string_view rest = more == nullptr ? "" : more;
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find(':'), rest.size());
        if (end > 0)
            options.places.push_back({fs::absolute(rest.substr(0, end)), "CALOT_PLUGIN_PATH", false, 0});
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return options;
}

Plugins::Plugins(Services& services, Options options) : services_(services), options_(std::move(options)) {
    for (std::size_t i = 0; i < options_.places.size(); ++i)
        look_into(options_.places[i], i, candidates_);
    refuse_duplicates(candidates_);
}

Plugins::~Plugins() = default;

std::vector<Found> Plugins::models(Kind kind) const {
    std::vector<Found> found;
    for (const Candidate& candidate : candidates_) {
        if (!candidate.refusal.empty()) continue;
        for (const Model& model : candidate.reading.manifest->models)
            if (model.kind == kind) found.push_back({&candidate, &model});
    }
    std::sort(found.begin(), found.end(),
              [](const Found& a, const Found& b) { return a.model->id < b.model->id; });
    return found;
}

Found Plugins::find(Kind kind, std::string_view id) const {
    const std::string word(kind_name(kind)), wanted(id);
    const Candidate* refused = nullptr;
    for (const Candidate& candidate : candidates_) {
        if (!candidate.holds(id)) continue;
        if (!candidate.refusal.empty()) {
            if (refused == nullptr) refused = &candidate;
            continue;
        }
        const Model* model = candidate.model(id);
        if (model == nullptr) continue;
        if (model->kind != kind)
            throw UserError(wanted, "",
                            "is a " + std::string(kind_name(model->kind)) + ", a " + word +
                                " is needed; `calot list " + word + "` shows those that are there");
        return {&candidate, model};
    }
    if (refused != nullptr) throw UserError(refused->refusal);
    // Tables print only an id's last word.
    std::string meant;
    for (const Candidate& candidate : candidates_)
        if (candidate.reading.manifest)
            for (const Model& model : candidate.reading.manifest->models)
                if (model.kind == kind && model.id.ends_with("." + wanted)) meant = model.id;
    throw UserError(wanted, "",
                    "no " + word + " has this id; " + (meant.empty() ? "" : "do you mean " + meant + "? ") +
                        "`calot list " + word +
                        "` shows those that are there, "
                        "`calot why " +
                        wanted + "` where was looked");
}

std::string Plugins::probe(const Candidate& candidate) {
    if (!candidate.refusal.empty()) return candidate.refusal;
    const fs::path library = candidate.reading.manifest->library_file();
    const auto known = probed_.find(library.string());
    if (known != probed_.end()) return known->second;
    return probed_[library.string()] = probe_library(options_.probe_program, candidate.file, library);
}

Instance Plugins::make(Kind kind, std::string_view id) {
    const Found found = find(kind, id);
    const std::string refusal = probe(*found.candidate);
    if (!refusal.empty()) throw UserError(refusal);
    const Manifest& manifest = *found.candidate->reading.manifest;
    std::shared_ptr<Library>& library = loaded_[manifest.library_file().string()];
    if (!library) library = std::make_shared<Library>(manifest, services_);

    auto held = std::make_unique<Instance::Held>();
    held->library = library;
    held->id = found.model->id;
    held->version = found.model->version;
    held->instance.struct_size = sizeof held->instance;
    const auto check = [&](const char* function, calot_status status, const calot_error& error) {
        if (status == CALOT_FATAL) library->quarantine();
        if (status != CALOT_OK)
            throw PluginError(std::string(id), function, status, error.code,
                              std::string(error.field, strnlen(error.field, sizeof error.field)),
                              std::string(error.message, strnlen(error.message, sizeof error.message)));
    };
    calot_error error{};
    error.struct_size = sizeof error;
    {
        const Call mark(library->name(), "create");
        const calot_factory* factory = library->factory(kind);
        check("create",
              factory->create(factory->self, abi_string(held->id), library->host(), &held->instance, &error),
              error);
    }
    const calot_instance& made = held->instance;
    if (made.struct_size < sizeof made || made.kind == nullptr || made.init == nullptr ||
        made.activate == nullptr || made.deactivate == nullptr || made.reset == nullptr ||
        made.destroy == nullptr || made.save_state == nullptr || made.load_state == nullptr ||
        made.parameter_count == nullptr || made.parameter_info == nullptr || made.get_parameter == nullptr ||
        made.set_parameter == nullptr || made.extension == nullptr)
        throw PluginError(held->id, "create", CALOT_ERROR, CALOT_CODE_INTERNAL, "out",
                          "the instance lacks functions of the contract");
    Instance instance;
    instance.held_ = std::move(held);
    {
        const Call mark(library->name(), "init");
        check("init", instance.abi()->init(instance.abi()->self, &error), error);
    }
    return instance;
}

Instance& Instance::operator=(Instance&& other) noexcept {
    if (this != &other) {
        release();
        held_ = std::move(other.held_);
    }
    return *this;
}

void Instance::release() noexcept {
    if (!held_) return;
    if (!held_->library->is_quarantined() && held_->instance.destroy != nullptr) {
        const Call mark(held_->library->name(), "destroy");
        held_->instance.destroy(held_->instance.self);
    }
    held_.reset();
}

const std::string& Instance::library_hash() const {
    return held_->library->hash();
}

void Instance::quarantine() {
    held_->library->quarantine();
}

std::string_view view(calot_string s) {
    return s.data == nullptr ? std::string_view() : std::string_view(s.data, s.size);
}
std::string text(calot_string s) {
    return std::string(view(s));
}
calot_string abi_string(std::string_view s) {
    return {s.data(), s.size()};
}

} // namespace calot::host
