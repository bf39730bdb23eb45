#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <ostream>
#include <string>
#include <thread>

namespace calot::bench {

/// While it lives it says every ten seconds, on a thread of its own, that work goes on, and how much of it is
/// done if it was told. Nobody else may write to the stream meanwhile.
class Watch {
  public:
    /// `what` is being done.
    Watch(std::ostream& out, std::string what);
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

  private:
    void say(std::unique_lock<std::mutex>& lock);

    std::ostream& out_;
    std::string what_;
    std::mutex mutex_;
    std::condition_variable over_;
    bool is_over_ = false;
    std::thread thread_;
};

/// How much of the work under way is done, for whoever watches; 0: unknown. One number a process.
inline std::atomic<double> share_done{0};

/// While it lives Ctrl-C and SIGTERM don't end the process but are remembered. One at a time.
class Interruptible {
  public:
    Interruptible();
    ~Interruptible();
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;
    static bool was_interrupted();
};

} // namespace calot::bench
