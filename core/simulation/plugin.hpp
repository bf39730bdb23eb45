// What the simulation is given of plugins: instances that the host has created and initialised, and whom it
// tells which plugin it is about to call.
#pragma once

#include <calot/abi/plugin.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace calot::simulation {

/// An instance after create and init. The simulation configures, activates and deactivates it, and never
/// destroys it; it must outlive the simulation.
struct Plugin {
    std::string id; // reverse DNS
    calot_instance* instance = nullptr;

    explicit operator bool() const { return instance != nullptr; }
    template<class Kind>
    const Kind& functions() const {
        return *static_cast<const Kind*>(instance->kind);
    }
};

/// Told before and after every call into a plugin, so that a supervisor can name the culprit of a crash or a
/// hang. Both are called on the simulation thread, once or more a tick: neither may allocate, block or throw.
class CallMonitor {
  public:
    virtual ~CallMonitor() = default;
    /// `plugin` and `function` are zero-terminated and outlive the simulation.
    virtual void enter(const char* plugin, const char* function, std::int64_t tick) noexcept = 0;
    virtual void leave() noexcept = 0;
};

/// A plugin failed, or handed out something that is not finite: the case ends.
/// what(): "org.calot.rod: step at tick 1234: FIELD: MESSAGE".
class PluginError : public std::runtime_error {
  public:
    PluginError(std::string plugin, std::string function, std::int64_t tick, const std::string& why)
        : std::runtime_error(plugin + ": " + function + (tick < 0 ? "" : " at tick " + std::to_string(tick)) +
                             ": " + why),
          plugin_(std::move(plugin)), function_(std::move(function)), tick_(tick) {}
    const std::string& plugin() const { return plugin_; }
    const std::string& function() const { return function_; }
    std::int64_t tick() const { return tick_; } // -1: before the case

  private:
    std::string plugin_, function_;
    std::int64_t tick_;
};

} // namespace calot::simulation
