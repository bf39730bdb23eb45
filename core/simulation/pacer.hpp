// Keeps ticks to the clock: up to five late ones are caught up back to back, beyond that simulated time
// slips.
#pragma once

#include "simulation/snapshot.hpp"

#include <chrono>
#include <pthread.h>

namespace calot::simulation {

/// Asks the system to run this thread before all ordinary ones (SCHED_FIFO); false where it does not allow
/// that.
bool schedule_first(pthread_t thread);

void schedule_ordinarily(pthread_t thread);

class Pacer {
  public:
    static constexpr int most_caught_up = 5; // ticks
    using Clock = std::chrono::steady_clock;

    explicit Pacer(bool is_realtime) : is_realtime_(is_realtime) { restart(); }

    /// Forgets what was due: after a pause.
    void restart() { due_ = Clock::now(); }
    /// Sleeps until the next tick is due.
    void wait();
    /// The tick has ended: counts it when it is late.
    void ended(LateTicks& late) { ended(Clock::now(), late); }
    void ended(Clock::time_point now, LateTicks& late);

  private:
    bool is_realtime_;
    Clock::time_point due_; // when the present tick should end
};

} // namespace calot::simulation
