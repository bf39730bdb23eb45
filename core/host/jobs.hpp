#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace calot::host {

/// A fixed number of workers that share the indices of one job at a time.
class JobPool {
  public:
    /// threads: the caller's included; 1 makes none, and jobs run on the caller.
    explicit JobPool(unsigned threads);
    ~JobPool();
    JobPool(const JobPool&) = delete;
    JobPool& operator=(const JobPool&) = delete;

    unsigned threads() const { return static_cast<unsigned>(workers_.size()) + 1; }

    /// job(context, i) for each i in [0, count), each once; returns when all have ended. Which thread runs an
    /// index is not defined, so jobs write to places of their own. A job that runs jobs runs them itself.
    /// Neither allocates nor takes a lock; waiting for the last job is a short spin, then a futex.
    void run(std::uint32_t count, void (*job)(void* context, std::uint32_t index), void* context);

  private:
    void work();
    void loop();

    std::vector<std::thread> workers_;
    std::atomic<void (*)(void*, std::uint32_t)> job_{nullptr};
    std::atomic<void*> context_{nullptr};
    std::atomic<std::uint32_t> count_{0};
    std::atomic<std::uint64_t> call_{0};
    std::atomic<bool> is_busy_{false};
    std::atomic<bool> is_ending_{false};
    std::atomic<std::uint32_t> generation_{0};
    /// Generation << 32 | next index: a late worker can't take an index of a newer job by an old count.
    std::atomic<std::uint64_t> next_{0};
    std::atomic<std::uint32_t> left_{0};
};

} // namespace calot::host
