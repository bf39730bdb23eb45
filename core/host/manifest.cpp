#include "host/manifest.hpp"

#include "host/error.hpp"
#include "host/toml.hpp"

#include <calot/abi/plugin.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

namespace calot::host {
namespace {

constexpr std::size_t max_manifest_bytes = 65536;
constexpr std::size_t max_models = 32;
constexpr std::size_t max_assets = 256;
constexpr std::size_t max_listed = 64;

bool is_id(std::string_view text) {
    if (text.empty() || text.size() > 96 || text.find('.') == std::string_view::npos) return false;
    char previous = '.';
    for (const char c : text) {
        const bool is_word = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
        if (!is_word && (c != '.' || previous == '.')) return false;
        previous = c;
    }
    return previous != '.';
}

bool is_version(std::string_view text) {
    int dots = 0;
    char previous = '.';
    for (const char c : text) {
        if (c == '.') {
            if (previous == '.') return false;
            ++dots;
        } else if (c < '0' || c > '9') {
            return false;
        }
        previous = c;
    }
    return dots == 2 && previous != '.' && text.size() <= 24;
}

bool is_plain_path(std::string_view path) {
    if (path.empty() || path.size() > 200 || path.front() == '/' || path.back() == '/') return false;
    if (path.find('\\') != std::string_view::npos || path.find('\0') != std::string_view::npos) return false;
    for (std::size_t begin = 0; begin <= path.size();) {
        const std::size_t end = std::min(path.find('/', begin), path.size());
        const std::string_view part = path.substr(begin, end - begin);
        if (part.empty() || part == "." || part == "..") return false;
        begin = end + 1;
    }
    return true;
}

bool has_control_character(std::string_view text) {
    return std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

// One table: every field is asked for once, and what was not asked for is unknown.
class Table {
  public:
    Table(const std::string& file, std::string prefix, const toml::table& table)
        : file_(file), prefix_(std::move(prefix)), table_(table) {}

    [[noreturn]] void refuse(std::string_view field, const std::string& what) const {
        throw UserError(file_, prefix_ + std::string(field), what);
    }

    const toml::node* find(std::string_view field) {
        asked_.insert(std::string(field));
        return table_.get(field);
    }
    const toml::node& need(std::string_view field) {
        const toml::node* node = find(field);
        if (node == nullptr) refuse(field, "is missing; add it (docs/manifest.md)");
        return *node;
    }

    std::string text(std::string_view field, std::size_t longest) {
        return text_of(field, need(field), longest);
    }
    std::string text(std::string_view field, std::size_t longest, const std::string& otherwise) {
        const toml::node* node = find(field);
        return node == nullptr ? otherwise : text_of(field, *node, longest);
    }

    double number(std::string_view field, double least, double most) {
        const toml::node& node = need(field);
        if (!node.is_number()) refuse(field, "must be a number");
        const double value =
            node.is_integer() ? static_cast<double>(**node.as_integer()) : **node.as_floating_point();
        if (!std::isfinite(value) || value < least || value > most) {
            std::ostringstream bounds;
            bounds << "must lie between " << least << " and " << most;
            refuse(field, bounds.str());
        }
        return value;
    }

    std::int64_t whole(std::string_view field, std::int64_t most) {
        const toml::node& node = need(field);
        if (!node.is_integer()) refuse(field, "must be a whole number without quotes");
        const std::int64_t value = **node.as_integer();
        if (value < 0 || value > most) refuse(field, "must lie between 0 and " + std::to_string(most));
        return value;
    }

    bool truth(std::string_view field, bool otherwise) {
        const toml::node* node = find(field);
        if (node == nullptr) return otherwise;
        if (!node->is_boolean()) refuse(field, "must be true or false");
        return **node->as_boolean();
    }

    std::vector<std::string> texts(std::string_view field) {
        std::vector<std::string> list;
        const toml::node* node = find(field);
        if (node == nullptr) return list;
        if (!node->is_array()) refuse(field, "must be a list of texts: [\"...\"]");
        const toml::array& items = *node->as_array();
        if (items.size() > max_listed)
            refuse(field, "has more than " + std::to_string(max_listed) + " entries");
        for (std::size_t i = 0; i < items.size(); ++i)
            list.push_back(text_of(std::string(field) + "[" + std::to_string(i) + "]", *items.get(i), 96));
        return list;
    }

    /// The table of that name, or null.
    const toml::table* table(std::string_view field) {
        const toml::node* node = find(field);
        if (node == nullptr) return nullptr;
        if (!node->is_table()) refuse(field, "must be a table: [" + prefix_ + std::string(field) + "]");
        return node->as_table();
    }

    /// The tables of a list [[field]].
    std::vector<const toml::table*> tables(std::string_view field, std::size_t most) {
        std::vector<const toml::table*> list;
        const toml::node* node = find(field);
        if (node == nullptr) return list;
        const std::string remedy = "must be given as [[" + prefix_ + std::string(field) + "]]";
        if (!node->is_array()) refuse(field, remedy);
        const toml::array& items = *node->as_array();
        if (items.size() > most) refuse(field, "is given more than " + std::to_string(most) + " times");
        for (const toml::node& item : items) {
            if (!item.is_table()) refuse(field, remedy);
            list.push_back(item.as_table());
        }
        return list;
    }

    void refuse_the_unknown() const {
        for (const auto& [key, node] : table_) {
            if (asked_.contains(std::string(key.str()))) continue;
            refuse(key.str(), "is unknown; remove it or correct its spelling (docs/manifest.md)");
        }
    }

  private:
    std::string text_of(std::string_view field, const toml::node& node, std::size_t longest) const {
        if (!node.is_string()) refuse(field, "must be a text in quotes");
        const std::string& value = **node.as_string();
        if (value.empty()) refuse(field, "is empty");
        if (value.size() > longest)
            refuse(field, "is longer than " + std::to_string(longest) + " bytes; shorten it");
        if (has_control_character(value)) refuse(field, "holds a control character; remove it");
        return value;
    }

    const std::string& file_;
    std::string prefix_;
    const toml::table& table_;
    std::set<std::string> asked_;
};

std::string read_id(Table& table, const std::string& id) {
    if (!is_id(id))
        table.refuse("id", "\"" + id +
                               "\" is not an id in reverse DNS: lower-case letters, digits and hyphens, "
                               "with dots between: \"org.example.rod\"");
    return id;
}

std::string read_version(Table& table, const std::string& version) {
    if (!is_version(version)) table.refuse("version", "must be three numbers: \"1.2.3\"");
    return version;
}

std::string one_of(Table& table, std::string_view field, std::initializer_list<std::string_view> choices) {
    std::string value = table.text(field, 60);
    if (std::find(choices.begin(), choices.end(), value) != choices.end()) return value;
    std::string all;
    for (const std::string_view choice : choices)
        all += (all.empty() ? "" : ", ") + std::string(choice);
    table.refuse(field, "\"" + value + "\" is none of: " + all);
}

ProcedureCard read_card(const std::string& file, const std::string& prefix, const toml::table& from) {
    Table table(file, prefix, from);
    ProcedureCard card;
    card.specialty = table.text("specialty", 60);
    card.level = one_of(table, "level", {"basic", "intermediate", "advanced"});
    card.minutes = table.number("minutes", 0, 600);
    card.description = table.text("description", 1000);
    card.picture = table.text("picture", 200);
    if (const toml::table* demonstration = table.table("demonstration")) {
        Table inner(file, prefix + "demonstration.", *demonstration);
        Demonstration d;
        d.device = inner.text("device", 96);
        if (!is_id(d.device)) inner.refuse("device", "is not an id in reverse DNS");
        d.seed = static_cast<std::uint64_t>(inner.whole("seed", std::numeric_limits<std::int64_t>::max()));
        d.skill = one_of(inner, "skill", {"expert", "novice"});
        inner.refuse_the_unknown();
        card.demonstration = d;
    }
    table.refuse_the_unknown();
    return card;
}

Model read_model(const Manifest& manifest, const std::string& file, const std::string& prefix,
                 const toml::table& from) {
    Table table(file, prefix, from);
    Model model;
    model.kind = *kind_of(one_of(table, "kind", {"rod", "tissue", "instrument", "device", "procedure"}));
    model.id = read_id(table, table.text("id", 96, manifest.id));
    model.title = table.text("title", 100, manifest.title);
    model.version = read_version(table, table.text("version", 24, manifest.version));
    model.is_realtime = table.truth("realtime", true);
    const bool is_mechanics =
        model.kind == Kind::rod || model.kind == Kind::tissue || model.kind == Kind::instrument;
    if (table.find("budget_microseconds") != nullptr || (is_mechanics && model.is_realtime)) {
        model.budget_microseconds = table.number("budget_microseconds", 0, 1e6);
        if (model.budget_microseconds <= 0) table.refuse("budget_microseconds", "must be above 0");
    }
    model.claims = table.texts("claims");
    if (!model.claims.empty() && model.kind != Kind::rod && model.kind != Kind::tissue)
        table.refuse("claims", "belongs to rods and tissues only; remove it");
    const toml::table* card = table.table("procedure");
    if ((card != nullptr) != (model.kind == Kind::procedure)) {
        table.refuse("procedure", card == nullptr
                                      ? "is missing: what the launcher shows; add [model.procedure]"
                                      : "belongs to procedures only; remove it");
    }
    if (card != nullptr) model.procedure = read_card(file, prefix + "procedure.", *card);
    table.refuse_the_unknown();
    return model;
}

Asset read_asset(const std::string& file, const std::string& prefix, const toml::table& from) {
    Table table(file, prefix, from);
    Asset asset;
    asset.path = table.text("path", 200);
    if (!is_plain_path(asset.path))
        table.refuse("path", "\"" + asset.path +
                                 "\" leaves the plugin's folder or is not plain; give a path below "
                                 "it, without \"..\" and without a leading \"/\"");
    asset.sha256 = table.text("sha256", 64);
    if (asset.sha256.size() != 64 || asset.sha256.find_first_not_of("0123456789abcdef") != std::string::npos)
        table.refuse("sha256", "must be 64 lower-case hexadecimal digits");
    table.refuse_the_unknown();
    return asset;
}

std::uint64_t read_fingerprint(Table& table) {
    const std::string text = table.text("fingerprint", 18);
    std::uint64_t value = 0;
    const char* begin = text.data() + 2;
    const char* end = text.data() + text.size();
    if (text.size() > 2 && text.starts_with("0x")) {
        const auto [stop, problem] = std::from_chars(begin, end, value, 16);
        if (problem == std::errc() && stop == end) return value;
    }
    table.refuse("fingerprint", "must be \"0x\" and up to 16 hexadecimal digits");
}

Manifest read_checked(const std::filesystem::path& path, const toml::table& root) {
    const std::string file = path.string();
    Table table(file, "", root);
    Manifest manifest;
    manifest.file = path;
    manifest.id = read_id(table, table.text("id", 96));
    manifest.title = table.text("title", 100);
    manifest.version = read_version(table, table.text("version", 24));
    manifest.library = table.text("library", 200);
    if (!is_plain_path(manifest.library) || manifest.library.find('/') != std::string::npos)
        table.refuse("library", "must be the name of a file in the plugin's folder");
    manifest.platform = table.text("platform", 60);

    const toml::table* contract = table.table("contract");
    if (contract == nullptr) table.refuse("contract", "is missing; add [contract] (docs/manifest.md)");
    Table versions(file, "contract.", *contract);
    manifest.contract_major = static_cast<std::uint32_t>(versions.whole("major", 9999));
    manifest.contract_minor = static_cast<std::uint32_t>(versions.whole("minor", 9999));
    manifest.contract_fingerprint = read_fingerprint(versions);
    versions.refuse_the_unknown();

    if (const toml::table* extensions = table.table("extensions")) {
        Table inner(file, "extensions.", *extensions);
        manifest.required_extensions = inner.texts("required");
        manifest.optional_extensions = inner.texts("optional");
        inner.refuse_the_unknown();
    }

    std::set<std::string> ids;
    const auto models = table.tables("model", max_models);
    if (models.empty()) table.refuse("model", "is missing; add a [[model]] for each model of the library");
    for (std::size_t i = 0; i < models.size(); ++i) {
        const std::string prefix = "model[" + std::to_string(i) + "].";
        manifest.models.push_back(read_model(manifest, file, prefix, *models[i]));
        const std::string& id = manifest.models.back().id;
        if (!ids.insert(id).second) table.refuse(prefix + "id", "\"" + id + "\" is given twice; rename one");
    }

    std::set<std::string> paths;
    const auto assets = table.tables("asset", max_assets);
    for (std::size_t i = 0; i < assets.size(); ++i) {
        const std::string prefix = "asset[" + std::to_string(i) + "].";
        manifest.assets.push_back(read_asset(file, prefix, *assets[i]));
        const std::string& asset = manifest.assets.back().path;
        if (!paths.insert(asset).second) table.refuse(prefix + "path", "\"" + asset + "\" is given twice");
    }
    for (std::size_t i = 0; i < manifest.models.size(); ++i) {
        const auto& card = manifest.models[i].procedure;
        if (card && !paths.contains(card->picture))
            table.refuse("model[" + std::to_string(i) + "].procedure.picture",
                         "\"" + card->picture + "\" is not among the assets; add it to ASSETS");
    }
    table.refuse_the_unknown();
    return manifest;
}

// Ids as far as they can be read, whatever else is wrong.
std::vector<std::string> ids_of(const toml::table& root) {
    std::vector<std::string> ids;
    const auto take = [&](const toml::node* node) {
        if (node == nullptr || !node->is_string()) return;
        const std::string& id = **node->as_string();
        if (is_id(id) && std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
    };
    take(root.get("id"));
    const toml::node* models = root.get("model");
    if (models != nullptr && models->is_array())
        for (const toml::node& model : *models->as_array()) {
            if (ids.size() >= max_models) break;
            if (model.is_table()) take(model.as_table()->get("id"));
        }
    return ids;
}

std::string hexadecimal(std::uint64_t value) {
    std::ostringstream text;
    text << "0x" << std::hex << value;
    return text.str();
}

} // namespace

std::string_view kind_name(Kind kind) {
    switch (kind) {
    case Kind::rod:
        return CALOT_KIND_ROD;
    case Kind::tissue:
        return CALOT_KIND_TISSUE;
    case Kind::instrument:
        return CALOT_KIND_INSTRUMENT;
    case Kind::device:
        return CALOT_KIND_DEVICE;
    case Kind::procedure:
        return CALOT_KIND_PROCEDURE;
    }
    return "";
}

std::optional<Kind> kind_of(std::string_view name) {
    for (const Kind kind : all_kinds)
        if (kind_name(kind) == name) return kind;
    return {};
}

bool Manifest::has_extension(std::string_view extension) const {
    const auto holds = [&](const std::vector<std::string>& list) {
        return std::find(list.begin(), list.end(), extension) != list.end();
    };
    return holds(required_extensions) || holds(optional_extensions);
}

ManifestReading read_manifest(const std::filesystem::path& path) {
    ManifestReading reading;
    const std::string file = path.string();
    try {
        std::error_code problem;
        if (!std::filesystem::is_regular_file(path, problem))
            throw UserError(file, "", "is not a regular file; put the plugin's manifest there");
        std::ifstream stream(path, std::ios::binary);
        if (!stream) throw UserError(file, "", "cannot be opened; check its permissions");
        std::string bytes(max_manifest_bytes + 1, '\0');
        stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        bytes.resize(static_cast<std::size_t>(stream.gcount()));
        if (bytes.size() > max_manifest_bytes) throw UserError(file, "", "is longer than 64 KiB; shorten it");
        if (const std::size_t line = line_of_stray_byte(bytes); line > 0)
            throw UserError(
                file, "line " + std::to_string(line),
                "has a character outside ASCII that is in no text or comment; correct it (it must "
                "be TOML in UTF-8)");
        toml::table root;
        try {
            root = toml::parse(bytes, file);
        } catch (const toml::parse_error& e) {
            const auto line = e.source().begin.line;
            std::string what(e.description());
            std::replace(what.begin(), what.end(), '\n', ' ');
            throw UserError(file, line > 0 ? "line " + std::to_string(line) : "",
                            what + "; correct it (it must be TOML in UTF-8)");
        }
        reading.ids = ids_of(root);
        reading.manifest = read_checked(path, root);
    } catch (const std::exception& e) {
        reading.manifest.reset();
        reading.refusal = e.what();
    }
    return reading;
}

std::string misfit(const Manifest& manifest) {
    const std::string file = manifest.file.string();
    const auto line = [&](const char* field, const std::string& what) {
        return std::string(UserError(file, field, what).what());
    };
    if (manifest.platform != CALOT_HOST_PLATFORM)
        return line("platform", "the plugin is for " + manifest.platform + ", this Calot runs on " +
                                    CALOT_HOST_PLATFORM + "; get a build of the plugin for it");
    const std::string theirs =
        std::to_string(manifest.contract_major) + "." + std::to_string(manifest.contract_minor);
    const std::string ours = std::to_string(CALOT_ABI_MAJOR) + "." + std::to_string(CALOT_ABI_MINOR);
    const std::string remedy = "; rebuild the plugin with the SDK of this Calot";
    if (manifest.contract_major != CALOT_ABI_MAJOR)
        return line("contract.major", "the plugin is for version " + theirs +
                                          " of the contract, this Calot has " + ours + remedy);
    if (manifest.contract_minor != CALOT_ABI_MINOR)
        return line("contract.minor", "the plugin is for version " + theirs +
                                          " of the contract, this Calot has " + ours + remedy);
    if (manifest.contract_fingerprint != CALOT_ABI_FINGERPRINT)
        return line("contract.fingerprint", "is " + hexadecimal(manifest.contract_fingerprint) +
                                                ", this Calot has " + hexadecimal(CALOT_ABI_FINGERPRINT) +
                                                remedy);
    static const std::set<std::string> known = {
        CALOT_SERVICE_LOG,    CALOT_SERVICE_ASSETS,   CALOT_SERVICE_SETTINGS,
        CALOT_SERVICE_RANDOM, CALOT_SERVICE_JOBS,     CALOT_SERVICE_METRICS,
        CALOT_EXTENSION_COST, CALOT_EXTENSION_EVENTS, CALOT_EXTENSION_OBSERVATION};
    for (const std::string& extension : manifest.required_extensions)
        if (!known.contains(extension))
            return line("extensions.required",
                        "this Calot lacks \"" + extension + "\"; get a newer Calot, or a plugin without it");
    return "";
}

} // namespace calot::host
