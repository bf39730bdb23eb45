#include "host/log.hpp"

#include <calot/abi/common.h>

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace calot::host {
namespace {

spdlog::level::level_enum level_of(std::int32_t level) {
    if (level <= CALOT_LOG_DEBUG) return spdlog::level::debug;
    if (level == CALOT_LOG_INFO) return spdlog::level::info;
    if (level == CALOT_LOG_WARNING) return spdlog::level::warn;
    return spdlog::level::err;
}

spdlog::level::level_enum wanted_level() {
    const char* wanted = std::getenv("CALOT_LOG");
    const std::string_view name = wanted == nullptr ? "" : wanted;
    if (name == "debug") return spdlog::level::debug;
    if (name == "info") return spdlog::level::info;
    if (name == "error") return spdlog::level::err;
    return spdlog::level::warn;
}

} // namespace

struct Log::Sink {
    spdlog::logger logger{"calot", std::make_shared<spdlog::sinks::stderr_sink_mt>()};
};

Log::Log() : sink_(std::make_unique<Sink>()) {
    sink_->logger.set_pattern("%l: %v");
    sink_->logger.set_level(wanted_level());
    drainer_ = std::jthread([this](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
            drain();
        }
    });
}

Log::~Log() {
    drainer_.request_stop();
    drainer_.join();
    drain();
    if (dropped() > 0)
        write(CALOT_LOG_WARNING, "log",
              std::to_string(dropped()) + " messages were dropped: the ring was full");
}

void Log::write(std::int32_t level, std::string_view who, std::string_view message) {
    std::string line(message);
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
    sink_->logger.log(level_of(level), "{}: {}", who, line);
}

void Log::write_realtime(std::int32_t level, const char* who, std::string_view message) noexcept {
    const std::uint64_t ticket = tickets_.fetch_add(1, std::memory_order_relaxed);
    Slot& slot = ring_[ticket % ring_.size()];
    std::uint32_t empty = 0;
    if (!slot.state.compare_exchange_strong(empty, 1, std::memory_order_acquire)) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    slot.ticket = ticket;
    slot.level = level;
    slot.who = who;
    slot.size = static_cast<std::uint32_t>(std::min(message.size(), slot.text.size()));
    std::memcpy(slot.text.data(), message.data(), slot.size);
    slot.state.store(2, std::memory_order_release);
}

void Log::drain() {
    std::vector<Slot*> full;
    for (Slot& slot : ring_)
        if (slot.state.load(std::memory_order_acquire) == 2) full.push_back(&slot);
    std::sort(full.begin(), full.end(), [](const Slot* a, const Slot* b) { return a->ticket < b->ticket; });
    for (Slot* slot : full) {
        write(slot->level, slot->who, {slot->text.data(), slot->size});
        slot->state.store(0, std::memory_order_release);
    }
}

} // namespace calot::host
