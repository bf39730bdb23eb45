#pragma once

#include <calot/abi/common.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace calot::host {

class JobPool;
class Log;
struct Manifest;

/// Takes what plugins observe (service calot.metrics/1). Called on the simulation thread, in real time.
class MetricsSink {
  public:
    virtual ~MetricsSink() = default;
    virtual void observe(std::string_view plugin, std::string_view id, std::int64_t tick, double value) = 0;
};

/// What the host offers every plugin. Lives longer than every instance.
class Services {
  public:
    /// threads: how many work on jobs, the caller's included; 1 makes none.
    explicit Services(unsigned threads = 1);
    ~Services();
    Services(const Services&) = delete;
    Services& operator=(const Services&) = delete;

    /// A setting of the case ("operator.skill"). Set them before instances are made.
    void set(const std::string& key, const std::string& value);
    const std::map<std::string, std::string, std::less<>>& settings() const { return settings_; }
    void set_metrics(MetricsSink* sink) { metrics_ = sink; }
    MetricsSink* metrics() const { return metrics_; }
    JobPool& jobs() { return *jobs_; }
    Log& log() { return *log_; }

  private:
    std::map<std::string, std::string, std::less<>> settings_;
    MetricsSink* metrics_ = nullptr;
    std::unique_ptr<JobPool> jobs_;
    std::unique_ptr<Log> log_;
};

/// The calot_host that one library sees: the shared services, its own assets, its name in the log.
class PluginHost {
  public:
    PluginHost(Services& shared, const Manifest& manifest);
    ~PluginHost();
    PluginHost(const PluginHost&) = delete;
    PluginHost& operator=(const PluginHost&) = delete;

    const calot_host* abi() const { return &host_; }

  private:
    struct Parts;
    calot_host host_{};
    std::unique_ptr<Parts> parts_;
};

} // namespace calot::host
