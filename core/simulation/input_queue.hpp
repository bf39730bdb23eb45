// Input events on their way from the window's thread to the simulation's.
#pragma once

#include <calot/abi/device.h>

#include <array>
#include <atomic>
#include <cstddef>

namespace calot::simulation {

/// One producer, one consumer, no locks. A full queue drops the newest event.
class InputQueue {
  public:
    static constexpr std::size_t capacity = 1024;

    /// False: full, dropped. [window thread]
    bool push(const calot_input_event& event) {
        const std::size_t at = head_.load(std::memory_order_relaxed);
        if (at - tail_.load(std::memory_order_acquire) == capacity) return false;
        events_[at % capacity] = event;
        head_.store(at + 1, std::memory_order_release);
        return true;
    }
    /// False: empty. [simulation thread]
    bool pop(calot_input_event& event) {
        const std::size_t at = tail_.load(std::memory_order_relaxed);
        if (at == head_.load(std::memory_order_acquire)) return false;
        event = events_[at % capacity];
        tail_.store(at + 1, std::memory_order_release);
        return true;
    }

  private:
    std::array<calot_input_event, capacity> events_{};
    std::atomic<std::size_t> head_{0}, tail_{0};
};

} // namespace calot::simulation
