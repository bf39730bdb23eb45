#include "host/services.hpp"

#include "host/instance.hpp"
#include "host/jobs.hpp"
#include "host/log.hpp"
#include "host/manifest.hpp"
#include "host/philox.hpp"

#include <calot/meshio/sha256.hpp>

#include <cstdio>
#include <fstream>

namespace calot::host {
namespace {

constexpr std::uintmax_t max_asset_bytes = 256u << 20;

calot_status refuse(calot_error* error, const std::string& field, const std::string& message) {
    if (error != nullptr && error->struct_size >= sizeof(calot_error)) {
        error->code = CALOT_CODE_MISSING_ASSET;
        std::snprintf(error->field, sizeof error->field, "%s", field.c_str());
        std::snprintf(error->message, sizeof error->message, "%s", message.c_str());
    }
    return CALOT_ERROR;
}

} // namespace

Services::Services(unsigned threads)
    : jobs_(std::make_unique<JobPool>(threads)), log_(std::make_unique<Log>()) {}
Services::~Services() = default;

void Services::set(const std::string& key, const std::string& value) {
    settings_[key] = value;
}

struct PluginHost::Parts {
    Services& shared;
    std::string id;
    std::filesystem::path folder;
    std::vector<Asset> declared;
    std::map<std::string, std::vector<std::uint8_t>, std::less<>> contents;
    calot_log log{};
    calot_assets assets{};
    calot_settings settings{};
    calot_random random{};
    calot_jobs jobs{};
    calot_metrics metrics{};

    Parts(Services& services, const Manifest& manifest)
        : shared(services), id(manifest.id), folder(manifest.folder()), declared(manifest.assets) {
        log = {sizeof log, this,
               [](void* self, std::int32_t level, calot_string message) {
                   of(self).shared.log().write(level, of(self).id, view(message));
               },
               [](void* self, std::int32_t level, calot_string message) {
                   of(self).shared.log().write_realtime(level, of(self).id.c_str(), view(message));
               }};
        assets = {sizeof assets, this,
                  [](void* self, calot_string path, calot_bytes* out, calot_error* error) {
                      return of(self).read(view(path), out, error);
                  }};
        settings = {sizeof settings, this,
                    [](void* self, calot_string key, calot_string* out) -> std::uint32_t {
                        const auto& all = of(self).shared.settings();
                        const auto found = all.find(view(key));
                        if (found == all.end() || out == nullptr) return 0;
                        *out = abi_string(found->second);
                        return 1;
                    }};
        random = {sizeof random, this,
                  [](void*, std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
                      return random_bits(seed, stream, counter);
                  },
                  [](void*, std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
                      return random_uniform(seed, stream, counter);
                  },
                  [](void*, std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
                      return random_normal(seed, stream, counter);
                  }};
        jobs = {sizeof jobs, this,
                [](void* self, std::uint32_t count, void (*job)(void*, std::uint32_t), void* context) {
                    of(self).shared.jobs().run(count, job, context);
                }};
        metrics = {sizeof metrics, this, [](void* self, calot_string name, std::int64_t tick, double value) {
                       if (MetricsSink* sink = of(self).shared.metrics())
                           sink->observe(of(self).id, view(name), tick, value);
                   }};
    }

    static Parts& of(void* self) { return *static_cast<Parts*>(self); }

    const void* service(std::string_view name) const {
        if (name == CALOT_SERVICE_LOG) return &log;
        if (name == CALOT_SERVICE_ASSETS) return &assets;
        if (name == CALOT_SERVICE_SETTINGS) return &settings;
        if (name == CALOT_SERVICE_RANDOM) return &random;
        if (name == CALOT_SERVICE_JOBS) return &jobs;
        if (name == CALOT_SERVICE_METRICS) return shared.metrics() == nullptr ? nullptr : &metrics;
        return nullptr;
    }

    calot_status read(std::string_view path, calot_bytes* out, calot_error* error) {
        if (out == nullptr) return CALOT_ERROR;
        try {
            const auto kept = contents.find(path);
            if (kept != contents.end()) {
                *out = {kept->second.data(), kept->second.size()};
                return CALOT_OK;
            }
            const std::string name(path);
            const Asset* asset = nullptr;
            for (const Asset& a : declared)
                if (a.path == path) asset = &a;
            if (asset == nullptr)
                return refuse(error, name, "is not among the manifest's assets; add it there");
            const std::filesystem::path file = folder / asset->path;
            std::error_code problem;
            if (!std::filesystem::is_regular_file(file, problem))
                return refuse(error, file.string(), "is missing; install the plugin again");
            if (std::filesystem::file_size(file, problem) > max_asset_bytes || problem)
                return refuse(error, file.string(), "is larger than 256 MiB or cannot be read");
            std::ifstream stream(file, std::ios::binary);
            std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(stream), {}};
            const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
            if (meshio::sha256(all) != asset->sha256)
                return refuse(error, file.string(),
                              "is not the file that the manifest's hash names (truncated or "
                              "changed); install the plugin again");
            const auto& content = contents.emplace(name, std::move(bytes)).first->second;
            *out = {content.data(), content.size()};
            return CALOT_OK;
        } catch (const std::exception& e) {
            return refuse(error, std::string(path), e.what());
        }
    }
};

PluginHost::PluginHost(Services& shared, const Manifest& manifest)
    : parts_(std::make_unique<Parts>(shared, manifest)) {
    host_ = {sizeof host_,
             parts_.get(),
             CALOT_ABI_MAJOR,
             CALOT_ABI_MINOR,
             CALOT_ABI_FINGERPRINT,
             [](const calot_host* host, calot_string id) {
                 return static_cast<const Parts*>(host->self)->service(view(id));
             }};
}
PluginHost::~PluginHost() = default;

} // namespace calot::host
