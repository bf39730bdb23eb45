#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

namespace calot::host {

/// Which plugin each thread is in, in memory that a supervisor may share: plain data, no pointers. Marking a
/// call is two relaxed stores and a look into a short table.
struct Blame {
    static constexpr std::size_t max_names = 256;
    static constexpr std::size_t max_threads = 16;
    static constexpr std::uint32_t no_thread = UINT32_MAX;

    struct Name {
        char plugin[100];
        char function[40];
    };
    std::array<Name, max_names> names{};
    std::atomic<std::uint32_t> name_count{0};
    std::atomic<std::uint32_t> thread_count{0};
    /// Count of the thread's calls << 32 | index of the name + 1; the lower half is 0 outside plugins.
    std::array<std::atomic<std::uint64_t>, max_threads> calls{};
    /// The tick at hand, -1 before the first.
    std::atomic<std::int64_t> tick{-1};
    /// The thread whose fault ended the process.
    std::atomic<std::uint32_t> crashed_thread{no_thread};
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

/// Where this process marks its calls: memory of its own until another is given. Give it before the first
/// call into a plugin.
Blame& blame();
void set_blame(Blame& shared);

struct Culprit {
    std::string plugin; ///< empty outside plugins
    std::string function;
};
/// What a value of Blame::calls means. `where` may have been written by a broken process: bounded.
Culprit culprit_of(const Blame& where, std::uint64_t call);

/// Functions that may not take a second (rod.step, poll, ...); the others may take half a minute.
bool is_realtime(const std::string& name_of_call);

/// Sets crashed_thread when a signal for a fault (SEGV, BUS, FPE, ILL, ABRT) ends this process. Call it on
/// the thread that calls plugins: an overflow of that thread's stack is noted, too.
void note_faults();

/// This thread is in that function of that plugin. Both texts are known again by their address. Calls nest;
/// leave ends the innermost. [any thread] [real-time]
void enter_call(const char* plugin, const char* function) noexcept;
void leave_call() noexcept;

/// While it lives, this thread is in that function.
class Call {
  public:
    Call(const char* plugin, const char* function) { enter_call(plugin, function); }
    ~Call() { leave_call(); }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
};

/// The value of this thread's present call, and how another thread takes part in it (a job).
std::uint64_t present_call() noexcept;
class SharedCall {
  public:
    explicit SharedCall(std::uint64_t call) noexcept;
    ~SharedCall();
    SharedCall(const SharedCall&) = delete;
    SharedCall& operator=(const SharedCall&) = delete;
};

} // namespace calot::host
