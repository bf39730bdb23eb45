#include "host/jobs.hpp"

#include "host/blame.hpp"

namespace calot::host {
namespace {

constexpr std::uint64_t no_index = 0xffffffff;
constexpr int spins = 2000; // some ten microseconds: a wake-up by the kernel costs more

std::uint64_t packed(std::uint64_t generation, std::uint64_t index) {
    return generation << 32 | index;
}

} // namespace

JobPool::JobPool(unsigned threads) {
    for (unsigned i = 1; i < threads; ++i)
        workers_.emplace_back([this] { loop(); });
}

JobPool::~JobPool() {
    is_ending_.store(true);
    generation_.fetch_add(1);
    generation_.notify_all();
    for (std::thread& worker : workers_)
        worker.join();
}

void JobPool::run(std::uint32_t count, void (*job)(void*, std::uint32_t), void* context) {
    if (count == 0) return;
    if (workers_.empty() || count == 1 || is_busy_.exchange(true, std::memory_order_acquire)) {
        for (std::uint32_t i = 0; i < count; ++i)
            job(context, i);
        return;
    }
    const std::uint32_t generation = generation_.load(std::memory_order_relaxed) + 1;
    // Nobody can take an index while the fields change.
    next_.store(packed(generation, no_index));
    job_.store(job);
    context_.store(context);
    count_.store(count);
    call_.store(present_call());
    left_.store(count);
    next_.store(packed(generation, 0));
    generation_.store(generation);
    generation_.notify_all();
    work();
    for (int i = 0; i < spins; ++i)
        if (left_.load(std::memory_order_acquire) == 0) break;
    for (std::uint32_t left = left_.load(); left != 0; left = left_.load())
        left_.wait(left);
    is_busy_.store(false, std::memory_order_release);
}

void JobPool::work() {
    while (true) {
        std::uint64_t next = next_.load();
        const auto job = job_.load();
        void* const context = context_.load();
        const std::uint32_t count = count_.load();
        const std::uint64_t index = next & no_index;
        if (index == no_index || index >= count) return;
        // Succeeds only if the fields above belong together: they change only after next_ has changed.
        if (!next_.compare_exchange_strong(next, next + 1)) continue;
        job(context, static_cast<std::uint32_t>(index));
        if (left_.fetch_sub(1) == 1) left_.notify_all();
    }
}

void JobPool::loop() {
    std::uint32_t seen = 0;
    while (!is_ending_.load()) {
        const std::uint32_t now = generation_.load();
        if (now == seen) {
            generation_.wait(seen);
            continue;
        }
        seen = now;
        const SharedCall mark(call_.load());
        work();
    }
}

} // namespace calot::host
