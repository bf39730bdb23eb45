#pragma once

#include "host/blame.hpp"
#include "host/error.hpp"

#include <calot/abi/plugin.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace calot::host {

class Library;

/// An instance of a plugin's model, destroyed with its handle. Functions are those of the contract; each
/// throws PluginError when the plugin does not return CALOT_OK, and marks the call in blame(). After
/// CALOT_FATAL the library is quarantined: nothing of it is called any more.
class InstanceHandle {
  public:
    InstanceHandle() = default;
    InstanceHandle(InstanceHandle&& other) noexcept { *this = std::move(other); }
    InstanceHandle& operator=(InstanceHandle&& other) noexcept;
    InstanceHandle(const InstanceHandle&) = delete;
    InstanceHandle& operator=(const InstanceHandle&) = delete;
    ~InstanceHandle() { release(); }

    explicit operator bool() const { return library_ != nullptr; }
    const std::string& id() const { return id_; }
    const std::string& version() const { return version_; }

    void activate(std::int64_t step_nanoseconds, std::uint64_t seed, std::uint32_t max_contacts,
                  std::uint32_t max_actions);
    void deactivate();
    void reset(std::uint64_t seed);
    std::vector<std::uint8_t> save_state();
    void load_state(std::span<const std::uint8_t> bytes);

    std::vector<calot_parameter> parameters();
    double parameter(std::uint32_t index);
    void set_parameter(std::uint32_t index, double value);

    /// Functions of an extension, or null.
    template <class Functions>
    const Functions* extension(std::string_view extension_id) {
        const auto* found = static_cast<const Functions*>(find_extension(extension_id));
        return found != nullptr && found->struct_size >= sizeof(Functions) ? found : nullptr;
    }
    void* self() const { return instance_.self; }
    std::uint16_t blame_number() const { return number_; }

  protected:
    friend class Plugins;
    const calot_instance& raw() const { return instance_; }
    template <class Functions>
    const Functions& kind() const {
        return *static_cast<const Functions*>(instance_.kind);
    }
    /// Calls function(self, arguments..., &error) and checks what it returns.
    template <class F, class... Arguments>
    void call(Function name, F function, Arguments... arguments) {
        calot_error& error = begin(name);
        calot_status status;
        {
            const Call mark(number_, name);
            status = function(instance_.self, arguments..., &error);
        }
        if (status != CALOT_OK) fail(name, status);
    }
    calot_error& begin(Function name);
    [[noreturn]] void fail(Function name, calot_status status);
    [[noreturn]] void fail(Function name, std::int32_t code, const std::string& field,
                           const std::string& message);
    void require_finite(Function name, const char* field, std::span<const double> values);

  private:
    const void* find_extension(std::string_view extension_id);
    void release() noexcept;

    std::shared_ptr<Library> library_;
    calot_instance instance_{};
    std::string id_;
    std::string version_;
    std::uint16_t number_ = 0;
    calot_error error_{};
};

class RodInstance : public InstanceHandle {
  public:
    void configure(const calot_rod_setup& setup);
    void set_segments(const calot_rod_segments& segments);
    /// Also refuses an output that is not finite.
    void step(const calot_rod_input& input, calot_rod_output& output);
    void read(calot_rod_output& output);
};

class TissueInstance : public InstanceHandle {
  public:
    void configure(const calot_tissue_setup& setup);
    /// Also refuses positions, velocities and anchor forces that are not finite.
    void step(const calot_tissue_input& input, calot_tissue_output& output);
    void read(calot_tissue_output& output);
    void answer(calot_structs_out& answers);
    void closest(const double point[3], std::uint32_t& triangle, double weight[3]);
};

class InstrumentInstance : public InstanceHandle {
  public:
    calot_instrument_sheet sheet();
    calot_part part(std::uint32_t index);
    void configure(const calot_instrument_setup& setup);
    void step(const calot_instrument_input& input, calot_instrument_output& output);
};

class DeviceInstance : public InstanceHandle {
  public:
    calot_device_sheet sheet();
    void configure(const calot_controls& start);
    /// Also refuses controls that are not finite. PluginError with CALOT_CODE_UNAVAILABLE: unplugged.
    void poll(std::int64_t tick, calot_controls& out);
    void send(const calot_feedback& feedback);

    /// The window's events; nothing happens where the device does not take them.
    bool takes_events();
    void event(const calot_input_event& event);
    struct HelpLine {
        std::string input;
        std::string effect;
    };
    std::vector<HelpLine> help();

    /// What the screen shows; nothing happens where the device does not see.
    bool observes();
    void observe(const calot_observation& observation);

  private:
    void find_extensions();
    bool is_asked_ = false;
    const calot_device_events* events_ = nullptr;
    const calot_device_observation* observation_ = nullptr;
};

class ProcedureInstance : public InstanceHandle {
  public:
    struct Task {
        std::string id, title, goal;
        bool is_required = false;
    };
    struct Metric {
        std::string id, title, unit, definition, task;
    };
    struct Failure {
        std::string id, title;
    };
    /// The scene's TOML, at most 1 MiB.
    std::string scene();
    std::vector<Task> tasks();
    std::vector<Metric> metrics();
    std::vector<Failure> failures();
    void configure(const calot_procedure_setup& setup);
    void update(const calot_snapshot& snapshot, const calot_commands& commands);
};

/// A text of the contract; a null pointer is the empty text.
std::string text(calot_string s);
/// Valid as long as `s`.
calot_string abi_string(std::string_view s);

} // namespace calot::host
