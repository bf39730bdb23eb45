#include "host/blame.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>

namespace calot::host {
namespace {

Blame own;
Blame* current = &own;

struct Known {
    const char* plugin;
    const char* function;
    std::uint32_t code;
};

// What a thread remembers: its slot, the calls it is in, and the names it has used.
struct Thread {
    std::uint32_t index = Blame::no_thread;
    std::uint32_t count = 0;
    std::uint32_t depth = 0;
    std::array<std::uint32_t, 8> codes{};
    std::array<Known, 64> known{};
    std::uint32_t known_count = 0;
};
thread_local Thread thread;

std::atomic<std::uint64_t>& slot() {
    if (thread.index == Blame::no_thread) {
        const std::uint32_t mine = current->thread_count.fetch_add(1, std::memory_order_relaxed);
        thread.index = mine < Blame::max_threads ? mine : Blame::max_threads - 1;
    }
    return current->calls[thread.index];
}

// Adds a name, once for each thread that uses it; the last one stands for all that find no place.
std::uint32_t add_name(const char* plugin, const char* function) {
    const std::uint32_t at = current->name_count.fetch_add(1, std::memory_order_relaxed);
    if (at >= Blame::max_names) {
        current->name_count.store(Blame::max_names, std::memory_order_relaxed);
        return Blame::max_names;
    }
    Blame::Name& name = current->names[at];
    std::strncpy(name.plugin, plugin, sizeof name.plugin - 1);
    std::strncpy(name.function, function, sizeof name.function - 1);
    return at + 1;
}

// An address may have come to hold another text.
bool is_named(std::uint32_t code, const char* plugin) {
    const Blame::Name& name = current->names[code - 1];
    return std::strncmp(name.plugin, plugin, sizeof name.plugin - 1) == 0;
}

std::uint32_t code_of(const char* plugin, const char* function) {
    for (std::uint32_t i = 0; i < thread.known_count; ++i) {
        const Known& known = thread.known[i];
        if (known.plugin == plugin && known.function == function && is_named(known.code, plugin))
            return known.code;
    }
    const std::uint32_t code = add_name(plugin, function);
    if (thread.known_count < thread.known.size())
        thread.known[thread.known_count++] = {plugin, function, code};
    return code;
}

void publish() {
    const std::uint32_t code =
        thread.depth == 0 ? 0 : thread.codes[std::min<std::size_t>(thread.depth, thread.codes.size()) - 1];
    slot().store(static_cast<std::uint64_t>(++thread.count) << 32 | code, std::memory_order_relaxed);
}

void push(std::uint32_t code) {
    if (thread.depth < thread.codes.size()) thread.codes[thread.depth] = code;
    ++thread.depth;
    publish();
}

void on_fault(int signal_number) {
    current->crashed_thread.store(thread.index, std::memory_order_relaxed);
    std::signal(signal_number, SIG_DFL);
    std::raise(signal_number);
}

} // namespace

Blame& blame() {
    return *current;
}

void set_blame(Blame& shared) {
    current = &shared;
}

Culprit culprit_of(const Blame& where, std::uint64_t call) {
    const std::uint64_t code = call & 0xffffffff;
    if (code == 0 || code > Blame::max_names) return {};
    const Blame::Name& name = where.names[code - 1];
    return {std::string(name.plugin, strnlen(name.plugin, sizeof name.plugin)),
            std::string(name.function, strnlen(name.function, sizeof name.function))};
}

bool is_realtime(const std::string& name_of_call) {
    const std::string function = name_of_call.substr(name_of_call.rfind('.') + 1); // "rod.step"
    for (const char* name :
         {"step", "poll", "send", "observe", "event", "update", "read", "set_segments", "answer", "closest"})
        if (function == name) return true;
    return false;
}

void note_faults() {
    thread_local std::array<char, 16384> stack;
    stack_t alternative{};
    alternative.ss_sp = stack.data();
    alternative.ss_size = stack.size();
    sigaltstack(&alternative, nullptr);
    struct sigaction action {};
    action.sa_handler = &on_fault;
    action.sa_flags = SA_ONSTACK | SA_NODEFER;
    sigemptyset(&action.sa_mask);
    for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
        sigaction(number, &action, nullptr);
}

void enter_call(const char* plugin, const char* function) noexcept {
    push(code_of(plugin, function));
}

void leave_call() noexcept {
    if (thread.depth > 0) --thread.depth;
    publish();
}

std::uint64_t present_call() noexcept {
    return slot().load(std::memory_order_relaxed);
}

SharedCall::SharedCall(std::uint64_t call) noexcept {
    push(static_cast<std::uint32_t>(call));
}
SharedCall::~SharedCall() {
    leave_call();
}

} // namespace calot::host
