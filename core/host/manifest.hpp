#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace calot::host {

enum class Kind { rod, tissue, instrument, device, procedure };
inline constexpr Kind all_kinds[] = {Kind::rod, Kind::tissue, Kind::instrument, Kind::device,
                                     Kind::procedure};

/// The contract's word for a kind: "rod".
std::string_view kind_name(Kind kind);
std::optional<Kind> kind_of(std::string_view name);

struct Asset {
    std::string path;   ///< below the manifest's folder
    std::string sha256; ///< 64 lower-case hexadecimal digits
};

/// With what a device completes the procedure by itself.
struct Demonstration {
    std::string device;
    std::uint64_t seed = 0;
    std::string skill;
};

/// What the launcher shows of a procedure.
struct ProcedureCard {
    std::string specialty;
    std::string level; ///< basic, intermediate, advanced
    double minutes = 0;
    std::string description;
    std::string picture; ///< path of an asset
    std::optional<Demonstration> demonstration;
};

struct Model {
    Kind kind = Kind::rod;
    std::string id;
    std::string title;
    std::string version;
    bool is_realtime = true;
    double budget_microseconds = 0; ///< 0: none declared
    std::vector<std::string> claims;
    std::optional<ProcedureCard> procedure;
};

struct Manifest {
    std::filesystem::path file;
    std::string id;
    std::string title;
    std::string version;
    std::string library; ///< file name in the manifest's folder
    std::string platform;
    std::uint32_t contract_major = 0;
    std::uint32_t contract_minor = 0;
    std::uint64_t contract_fingerprint = 0;
    std::vector<std::string> required_extensions;
    std::vector<std::string> optional_extensions;
    std::vector<Model> models;
    std::vector<Asset> assets;

    std::filesystem::path folder() const { return file.parent_path(); }
    std::filesystem::path library_file() const { return folder() / library; }
    bool has_extension(std::string_view extension) const;
};

/// What could be read of a manifest. Either `manifest` is there, or `refusal` says in one line why not; the
/// ids are those that could be read even so, that a broken plugin can be found by its id.
struct ManifestReading {
    std::optional<Manifest> manifest;
    std::string refusal;
    std::vector<std::string> ids;
};

/// Reads and checks a plugin.toml (docs/manifest.md); loads nothing and never throws for what the file holds.
ManifestReading read_manifest(const std::filesystem::path& file);

/// The line that refuses a manifest made for another platform, contract or for extensions that this Calot
/// lacks; empty if it fits.
std::string misfit(const Manifest& manifest);

} // namespace calot::host
