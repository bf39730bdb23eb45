#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

namespace calot::host {

/// Every function of the contract that the host calls.
enum class Function : std::uint16_t {
    none,
    load,
    entry,
    factory,
    create,
    init,
    activate,
    deactivate,
    reset,
    destroy,
    save_state,
    load_state,
    parameters,
    extension,
    configure,
    sheet,
    rod_set_segments,
    rod_step,
    rod_read,
    tissue_step,
    tissue_read,
    tissue_answer,
    tissue_closest,
    instrument_part,
    instrument_step,
    device_poll,
    device_send,
    device_event,
    device_help,
    device_observe,
    procedure_scene,
    procedure_tables,
    procedure_update,
    count
};

/// "rod.step"
const char* function_name(Function function);
/// Those may not take a second; the others may take half a minute.
bool is_realtime(Function function);

/// Which plugin each thread is in, in memory that a supervisor may share: plain data, no pointers. Marking a
/// call is two relaxed stores.
struct Blame {
    static constexpr std::size_t max_plugins = 64;
    static constexpr std::size_t max_threads = 32;
    static constexpr std::uint32_t no_thread = UINT32_MAX;

    std::array<std::array<char, 100>, max_plugins> names{};
    std::atomic<std::uint32_t> name_count{0};
    std::atomic<std::uint32_t> thread_count{0};
    /// Count of the thread's calls << 32 | plugin << 16 | function; the lower half is 0 outside plugins.
    std::array<std::atomic<std::uint64_t>, max_threads> calls{};
    std::atomic<std::int64_t> tick{0};
    /// The thread whose fault ended the process.
    std::atomic<std::uint32_t> crashed_thread{no_thread};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

/// Where this process marks its calls: memory of its own until another is given. Give it before the first
/// call into a plugin.
Blame& blame();
void set_blame(Blame& shared);

/// Number of a plugin in blame().names. [any thread]
std::uint16_t enlist(std::string_view plugin);

struct Culprit {
    std::string plugin;
    Function function = Function::none;
};
/// What a value of Blame::calls means; plugin is empty outside plugins.
Culprit culprit_of(const Blame& where, std::uint64_t call);

/// Sets crashed_thread when a signal for a fault (SEGV, BUS, FPE, ILL, ABRT) ends this process.
void note_faults();

/// While it lives, this thread is in that plugin. [any thread] [real-time]
class Call {
  public:
    Call(std::uint16_t plugin, Function function);
    /// Takes part in another thread's call, whose value is given (a job).
    explicit Call(std::uint64_t call);
    ~Call() { slot_->store(before_, std::memory_order_relaxed); }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

  private:
    std::atomic<std::uint64_t>* slot_;
    std::uint64_t before_;
};

/// The value of this thread's present call.
std::uint64_t present_call();

} // namespace calot::host
