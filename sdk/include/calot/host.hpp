// The host's services, as a plugin uses them. Look them up in init, not in a step.
#pragma once

#include <calot/abi/common.h>
#include <calot/error.hpp>
#include <calot/span.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace calot {

// Does nothing where the host has no log.
class Log {
  public:
    Log() = default;
    explicit Log(const calot_log* service) : service_(service) {}
    void debug(std::string_view message) const { write(CALOT_LOG_DEBUG, message); }
    void info(std::string_view message) const { write(CALOT_LOG_INFO, message); }
    void warning(std::string_view message) const { write(CALOT_LOG_WARNING, message); }
    void error(std::string_view message) const { write(CALOT_LOG_ERROR, message); }
    // For real-time functions: wait-free, cut at 200 bytes.
    void realtime(std::int32_t level, std::string_view message) const {
        if (service_) service_->write_realtime(service_->self, level, string(message));
    }

  private:
    void write(std::int32_t level, std::string_view message) const {
        if (service_) service_->write(service_->self, level, string(message));
    }
    const calot_log* service_ = nullptr;
};

class Assets {
  public:
    Assets() = default;
    explicit Assets(const calot_assets* service) : service_(service) {}
    // Bytes of an asset that the manifest names; they live as long as the instance. Throws Error.
    std::span<const std::uint8_t> read(std::string_view path) const {
        calot_bytes out{};
        calot_error error{};
        error.struct_size = sizeof error;
        const calot_status status = service_->read(service_->self, string(path), &out, &error);
        if (status != CALOT_OK) {
            throw Error(error.code != CALOT_CODE_NONE ? error.code : CALOT_CODE_MISSING_ASSET,
                        std::string(path), error.message[0] ? error.message : "the asset can't be read");
        }
        return span(out);
    }
    std::string_view text(std::string_view path) const {
        const auto all = read(path);
        return {reinterpret_cast<const char*>(all.data()), all.size()};
    }

  private:
    const calot_assets* service_ = nullptr;
};

// Nothing is set where the host has no settings.
class Settings {
  public:
    Settings() = default;
    explicit Settings(const calot_settings* service) : service_(service) {}
    std::optional<std::string> text(std::string_view key) const {
        calot_string out{};
        if (service_ == nullptr || service_->text(service_->self, string(key), &out) == 0) return {};
        return std::string(view(out));
    }

  private:
    const calot_settings* service_ = nullptr;
};

// Counter-based: the same seed, stream and counter always give the same number. Real-time.
class Random {
  public:
    Random() = default;
    explicit Random(const calot_random* service) : service_(service) {}
    std::uint64_t bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) const {
        return service_->bits(service_->self, seed, stream, counter);
    }
    double uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) const {
        return service_->uniform(service_->self, seed, stream, counter);
    }
    double normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) const {
        return service_->normal(service_->self, seed, stream, counter);
    }

  private:
    const calot_random* service_ = nullptr;
};

// Without the service the jobs run one after the other on the calling thread. Real-time.
class Jobs {
  public:
    Jobs() = default;
    explicit Jobs(const calot_jobs* service) : service_(service) {}
    // job(i) for i in [0, count); must not throw. What they write is to be reduced in index order.
    template<class Job>
    void run(std::uint32_t count, Job& job) const {
        if (service_ == nullptr) {
            for (std::uint32_t i = 0; i < count; ++i)
                job(i);
            return;
        }
        service_->run(
            service_->self, count,
            [](void* context, std::uint32_t index) { (*static_cast<Job*>(context))(index); }, &job);
    }

  private:
    const calot_jobs* service_ = nullptr;
};

// Observations are dropped where the host has no metrics. Real-time.
class Metrics {
  public:
    Metrics() = default;
    explicit Metrics(const calot_metrics* service) : service_(service) {}
    void observe(std::string_view id, std::int64_t tick, double value) const {
        if (service_) service_->observe(service_->self, string(id), tick, value);
    }

  private:
    const calot_metrics* service_ = nullptr;
};

class Host {
  public:
    Host() = default;
    explicit Host(const calot_host* host) : host_(host) {}

    Log log() const { return Log(find<calot_log>(CALOT_SERVICE_LOG)); }
    Settings settings() const { return Settings(find<calot_settings>(CALOT_SERVICE_SETTINGS)); }
    Jobs jobs() const { return Jobs(find<calot_jobs>(CALOT_SERVICE_JOBS)); }
    Metrics metrics() const { return Metrics(find<calot_metrics>(CALOT_SERVICE_METRICS)); }
    // These two throw Error with CALOT_CODE_MISSING_SERVICE where the host lacks the service.
    Assets assets() const { return Assets(require<calot_assets>(CALOT_SERVICE_ASSETS)); }
    Random random() const { return Random(require<calot_random>(CALOT_SERVICE_RANDOM)); }

    // Functions of any service by its id, or null.
    template<class Service>
    const Service* find(std::string_view id) const {
        if (host_ == nullptr || host_->service == nullptr) return nullptr;
        const auto* service = static_cast<const Service*>(host_->service(host_, string(id)));
        return service != nullptr && service->struct_size >= sizeof(Service) ? service : nullptr;
    }
    template<class Service>
    const Service* require(std::string_view id) const {
        const auto* service = find<Service>(id);
        if (service == nullptr)
            throw Error(CALOT_CODE_MISSING_SERVICE, std::string(id),
                        "this host lacks a service that is needed");
        return service;
    }

  private:
    const calot_host* host_ = nullptr;
};

} // namespace calot
