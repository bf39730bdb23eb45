#include "host/blame.hpp"

#include <csignal>
#include <cstring>
#include <mutex>

namespace calot::host {
namespace {

Blame own;
Blame* current = &own;
std::mutex names_mutex;

thread_local std::uint32_t thread_index = Blame::no_thread;
thread_local std::uint32_t thread_calls = 0;

std::atomic<std::uint64_t>& slot() {
    if (thread_index == Blame::no_thread) {
        const std::uint32_t mine = current->thread_count.fetch_add(1, std::memory_order_relaxed);
        thread_index = mine < Blame::max_threads ? mine : Blame::max_threads - 1;
    }
    return current->calls[thread_index];
}

void on_fault(int signal_number) {
    current->crashed_thread.store(thread_index, std::memory_order_relaxed);
    std::signal(signal_number, SIG_DFL);
    std::raise(signal_number);
}

} // namespace

const char* function_name(Function function) {
    switch (function) {
    case Function::none: return "";
    case Function::load: return "load";
    case Function::entry: return "entry";
    case Function::factory: return "factory";
    case Function::create: return "create";
    case Function::init: return "init";
    case Function::activate: return "activate";
    case Function::deactivate: return "deactivate";
    case Function::reset: return "reset";
    case Function::destroy: return "destroy";
    case Function::save_state: return "save_state";
    case Function::load_state: return "load_state";
    case Function::parameters: return "parameters";
    case Function::extension: return "extension";
    case Function::configure: return "configure";
    case Function::sheet: return "sheet";
    case Function::rod_set_segments: return "rod.set_segments";
    case Function::rod_step: return "rod.step";
    case Function::rod_read: return "rod.read";
    case Function::tissue_step: return "tissue.step";
    case Function::tissue_read: return "tissue.read";
    case Function::tissue_answer: return "tissue.answer";
    case Function::tissue_closest: return "tissue.closest";
    case Function::instrument_part: return "instrument.part";
    case Function::instrument_step: return "instrument.step";
    case Function::device_poll: return "device.poll";
    case Function::device_send: return "device.send";
    case Function::device_event: return "device.event";
    case Function::device_help: return "device.help";
    case Function::device_observe: return "device.observe";
    case Function::procedure_scene: return "procedure.scene";
    case Function::procedure_tables: return "procedure.tables";
    case Function::procedure_update: return "procedure.update";
    case Function::count: break;
    }
    return "unknown function";
}

bool is_realtime(Function function) {
    switch (function) {
    case Function::rod_set_segments:
    case Function::rod_step:
    case Function::rod_read:
    case Function::tissue_step:
    case Function::tissue_read:
    case Function::tissue_answer:
    case Function::tissue_closest:
    case Function::instrument_step:
    case Function::device_poll:
    case Function::device_send:
    case Function::device_event:
    case Function::device_observe:
    case Function::procedure_update: return true;
    default: return false;
    }
}

Blame& blame() { return *current; }

void set_blame(Blame& shared) { current = &shared; }

std::uint16_t enlist(std::string_view plugin) {
    const std::lock_guard lock(names_mutex);
    Blame& to = *current;
    const std::string_view cut = plugin.substr(0, to.names[0].size() - 1);
    const std::uint32_t count = to.name_count.load();
    for (std::uint32_t i = 0; i < count; ++i)
        if (cut == to.names[i].data()) return static_cast<std::uint16_t>(i);
    if (count == Blame::max_plugins) return Blame::max_plugins - 1;
    std::memcpy(to.names[count].data(), cut.data(), cut.size());
    to.name_count.store(count + 1);
    return static_cast<std::uint16_t>(count);
}

Culprit culprit_of(const Blame& where, std::uint64_t call) {
    const auto function = static_cast<std::uint16_t>(call & 0xffff);
    const auto plugin = static_cast<std::uint16_t>(call >> 16 & 0xffff);
    if (function == 0 || function >= static_cast<std::uint16_t>(Function::count) || plugin >= Blame::max_plugins)
        return {};
    const auto& name = where.names[plugin];
    return {std::string(name.data(), strnlen(name.data(), name.size())), static_cast<Function>(function)};
}

void note_faults() {
    // An overflow of the stack must be noted too, so the handler has a stack of its own. It serves the thread
    // that calls this; on others an overflow is a fault like any other, only without its thread.
    static std::array<char, 64 * 1024> stack;
    stack_t alternative{};
    alternative.ss_sp = stack.data();
    alternative.ss_size = stack.size();
    sigaltstack(&alternative, nullptr);
    struct sigaction action {};
    action.sa_handler = &on_fault;
    action.sa_flags = SA_ONSTACK | SA_NODEFER;
    sigemptyset(&action.sa_mask);
    for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) sigaction(number, &action, nullptr);
}

Call::Call(std::uint16_t plugin, Function function) : slot_(&slot()) {
    before_ = slot_->load(std::memory_order_relaxed);
    const std::uint64_t now = static_cast<std::uint64_t>(++thread_calls) << 32 |
                              static_cast<std::uint64_t>(plugin) << 16 | static_cast<std::uint64_t>(function);
    slot_->store(now, std::memory_order_relaxed);
}

Call::Call(std::uint64_t call) : slot_(&slot()), before_(slot_->load(std::memory_order_relaxed)) {
    const std::uint64_t counted = static_cast<std::uint64_t>(++thread_calls) << 32;
    slot_->store(counted | (call & 0xffffffff), std::memory_order_relaxed);
}

std::uint64_t present_call() { return slot().load(std::memory_order_relaxed); }

} // namespace calot::host
