#include "bench/watch.hpp"

#include <chrono>
#include <cmath>
#include <csignal>
#include <utility>

namespace calot::bench {

namespace {

constexpr std::chrono::seconds period{10};

volatile std::sig_atomic_t interrupted = 0;
struct sigaction before_interrupt, before_termination;

void remember(int) {
    interrupted = 1;
}

} // namespace

Watch::Watch(std::ostream& out, std::string what) : out_(out), what_(std::move(what)) {
    share_done = 0;
    thread_ = std::thread([this] {
        std::unique_lock lock(mutex_);
        say(lock);
    });
}

Watch::~Watch() {
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
    }
    over_.notify_one();
    thread_.join();
}

void Watch::say(std::unique_lock<std::mutex>& lock) {
    const auto begin = std::chrono::steady_clock::now();
    while (!over_.wait_for(lock, period, [this] { return is_over_; })) {
        const double seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        out_ << "calot: " << what_ << ": " << std::lround(seconds) << " s";
        if (const double share = share_done; share > 0)
            out_ << ", " << std::lround(100 * share) << " % done, some "
                 << std::lround(seconds / share - seconds) << " s to go";
        out_ << std::endl;
    }
}

Interruptible::Interruptible() {
    interrupted = 0;
    struct sigaction action {};
    action.sa_handler = remember;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, &before_interrupt);
    sigaction(SIGTERM, &action, &before_termination);
}

Interruptible::~Interruptible() {
    sigaction(SIGINT, &before_interrupt, nullptr);
    sigaction(SIGTERM, &before_termination, nullptr);
}

bool Interruptible::was_interrupted() {
    return interrupted != 0;
}

} // namespace calot::bench
