#pragma once

#include "host/instance.hpp"
#include "host/manifest.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace calot::host {

class Services;
class Library;

/// One folder that was looked into for plugins.
struct Place {
    std::filesystem::path folder;
    std::string origin; ///< "beside the program" or "CALOT_PLUGIN_PATH"
    bool exists = false;
    std::size_t manifest_count = 0;
};

/// One manifest that was found.
struct Candidate {
    ManifestReading reading;
    std::filesystem::path file;
    std::size_t place = 0;
    std::string refusal; ///< one line, empty unless refused before anything is loaded

    bool holds(std::string_view id) const;
    const Model* model(std::string_view id) const;
};

/// The model of a candidate.
struct Found {
    const Candidate* candidate = nullptr;
    const Model* model = nullptr;
};

/// The plugins that are there: finds them, probes each library in a child process before it is loaded, and
/// makes instances. [main thread]
class Plugins {
  public:
    struct Options {
        std::vector<Place> places;
        std::filesystem::path probe_program; ///< calot-probe
    };
    /// Places: ../lib/calot/plugins from the running program, then the folders of CALOT_PLUGIN_PATH.
    static Options defaults();

    /// `services` are what plugins are given; they must outlive every instance.
    explicit Plugins(Services& services, Options options = defaults());
    ~Plugins();

    const std::vector<Place>& places() const { return options_.places; }
    const std::vector<Candidate>& candidates() const { return candidates_; }

    /// Models of a kind that no manifest check refuses, by id. Loads and probes nothing.
    std::vector<Found> models(Kind kind) const;
    /// A model by its id; throws UserError with the reason if it is refused by its manifest, missing, or of
    /// another kind.
    Found find(Kind kind, std::string_view id) const;
    /// Why a candidate's library is refused, in one line; empty if it is sound. Probes once.
    std::string probe(const Candidate& candidate);

    /// An instance, created and initialised. Throws UserError where the plugin is refused, PluginError where
    /// create or init fails.
    Instance make(Kind kind, std::string_view id);

  private:
    Services& services_;
    Options options_;
    std::vector<Candidate> candidates_;
    std::map<std::string, std::string> probed_; ///< library file: refusal
    std::map<std::string, std::shared_ptr<Library>> loaded_;
};

} // namespace calot::host
