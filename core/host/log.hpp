#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string_view>
#include <thread>

namespace calot::host {

/// What the program and its plugins have to say, on standard error: warnings and errors, or from the level
/// that CALOT_LOG names (debug, info, warning, error) on.
class Log {
  public:
    Log();
    ~Log(); ///< writes what is still in the ring
    Log(const Log&) = delete;
    Log& operator=(const Log&) = delete;

    /// Level as in the contract (CALOT_LOG_...). Control characters become spaces. [any thread]
    void write(std::int32_t level, std::string_view who, std::string_view message);
    /// Wait-free: copied into a ring of 256 and cut at 200 bytes; when the ring is full it is dropped and
    /// counted. `who` must stay until drained. [any thread] [real-time]
    void write_realtime(std::int32_t level, const char* who, std::string_view message) noexcept;
    /// Writes what is in the ring, in the order in which it came. [one thread]
    void drain();
    std::uint64_t dropped() const { return dropped_.load(); }

  private:
    struct Slot {
        std::atomic<std::uint32_t> state{0}; // 0 empty, 1 being written, 2 full
        std::uint64_t ticket = 0;
        std::int32_t level = 0;
        std::uint32_t size = 0;
        const char* who = nullptr;
        std::array<char, 200> text;
    };
    struct Sink;
    std::array<Slot, 256> ring_;
    std::atomic<std::uint64_t> tickets_{0};
    std::atomic<std::uint64_t> dropped_{0};
    std::unique_ptr<Sink> sink_;
    std::jthread drainer_;
};

} // namespace calot::host
