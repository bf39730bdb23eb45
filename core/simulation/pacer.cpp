#include "simulation/pacer.hpp"

#include <algorithm>
#include <time.h>

namespace calot::simulation {

namespace {

using namespace std::chrono_literals;
constexpr auto tick = 1ms;

} // namespace

bool schedule_first(pthread_t thread) {
    sched_param parameters{};
    parameters.sched_priority = 10; // above ordinary threads, below those of the system's own drivers (50)
    return pthread_setschedparam(thread, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0;
}

void schedule_ordinarily(pthread_t thread) {
    const sched_param parameters{};
    pthread_setschedparam(thread, SCHED_OTHER, &parameters);
}

void Pacer::wait() {
    if (!is_realtime_) return;
    // A tick may begin when the one before it was due to end.
    const auto until = due_.time_since_epoch();
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(until);
    timespec at{};
    at.tv_sec = whole.count();
    at.tv_nsec = std::chrono::duration_cast<std::chrono::nanoseconds>(until - whole).count();
    // libstdc++'s steady_clock is CLOCK_MONOTONIC. An interrupted sleep goes on.
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) != 0) {
    }
}

void Pacer::ended(Clock::time_point now, LateTicks& late) {
    if (!is_realtime_) return;
    due_ += tick;
    const auto behind = now - due_;
    if (behind <= tick) return;
    ++late.late;
    late.worst_us = std::max<std::int64_t>(
        late.worst_us, std::chrono::duration_cast<std::chrono::microseconds>(behind).count());
    const auto whole = behind / tick;
    if (whole > most_caught_up) {
        late.slipped += whole;
        due_ += whole * tick;
    }
}

} // namespace calot::simulation
