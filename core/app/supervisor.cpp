#include "app/supervisor.hpp"

#include "app/commands.hpp"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <poll.h>
#include <signal.h>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace calot::app {
namespace {

using Clock = std::chrono::steady_clock;
using host::Blame;
using host::Culprit;

volatile sig_atomic_t asked_to_end = 0;
void on_end(int) {
    asked_to_end = 1;
}

// Sees calls that last too long.
class Watch {
  public:
    // The culprit of a hang, if there is one now.
    std::optional<Culprit> look(const Blame& blame) {
        const auto now = Clock::now();
        for (std::size_t i = 0; i < Blame::max_threads; ++i) {
            const std::uint64_t call = blame.calls[i].load(std::memory_order_relaxed);
            Seen& seen = seen_[i];
            if (call != seen.call) seen = {call, now, 0};
            ++seen.looks;
            const Culprit culprit = host::culprit_of(blame, call);
            if (culprit.plugin.empty()) continue;
            const auto limit =
                host::is_realtime(culprit.function) ? std::chrono::seconds(1) : std::chrono::seconds(30);
            // Looks are counted, too: a machine that slept is not a plugin that hangs.
            if (now - seen.since >= limit && seen.looks >= 10) return culprit;
        }
        return {};
    }

  private:
    struct Seen {
        std::uint64_t call = 0;
        Clock::time_point since = Clock::now();
        int looks = 0;
    };
    std::array<Seen, Blame::max_threads> seen_;
};

Culprit of_crash(const Blame& blame) {
    const std::uint32_t thread = blame.crashed_thread.load();
    if (thread < Blame::max_threads) return host::culprit_of(blame, blame.calls[thread].load());
    return {};
}

int report(const CaseShared& status, const Culprit& culprit, const std::string& what, bool as_json) {
    const std::int64_t tick = status.blame.tick.load();
    const std::string who = culprit.plugin.empty() ? "the simulation" : culprit.plugin;
    const std::string where = culprit.function.empty() ? "" : " in " + culprit.function;
    const std::string when = tick < 0 ? " before the first tick" : " at tick " + std::to_string(tick);
    const std::string folder(status.folder.data(), strnlen(status.folder.data(), status.folder.size()));
    const std::string record =
        folder.empty() ? "" : "; the case up to then, at most 1 s short, is in " + folder;
    std::fprintf(stderr, "\ncalot: %s: %s%s%s%s\n", who.c_str(), what.c_str(), where.c_str(), when.c_str(),
                 record.c_str());
    if (as_json)
        std::printf("{\"failure\": {\"plugin\": %s, \"function\": %s, \"tick\": %lld, \"what\": %s}, "
                    "\"folder\": %s}\n",
                    json_text(culprit.plugin).c_str(), json_text(culprit.function).c_str(),
                    static_cast<long long>(tick), json_text(what).c_str(), json_text(folder).c_str());
    return status.is_running.load() ? plugin_failure : bad_input;
}

[[noreturn]] void be_child(const std::function<int(CaseShared&)>& body, CaseShared& status, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(plugin_failure);
    signal(SIGINT, SIG_IGN); // the supervisor passes it on, as SIGTERM
    signal(SIGTERM, SIG_DFL);
    host::set_blame(status.blame);
    host::note_faults();
    int code = plugin_failure;
    try {
        code = body(status);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "calot: %s\n", e.what());
        code = status.is_running.load() ? plugin_failure : bad_input;
    }
    std::fflush(nullptr);
    std::exit(code);
}

} // namespace

void CaseShared::set_folder(const std::string& path) {
    std::strncpy(folder.data(), path.c_str(), folder.size() - 1);
}

int supervise(const std::function<int(CaseShared&)>& body, bool as_json) {
    void* memory =
        mmap(nullptr, sizeof(CaseShared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::runtime_error("there is no memory to share with the simulation");
    CaseShared& status = *new (memory) CaseShared;

    struct sigaction action {};
    action.sa_handler = &on_end;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);

    std::fflush(nullptr);
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0)
        throw std::runtime_error("the simulation's process can't be started: " +
                                 std::string(std::strerror(errno)));
    if (child == 0) be_child(body, status, parent);
    const int process = static_cast<int>(syscall(SYS_pidfd_open, child, 0));

    Watch watch;
    std::optional<Culprit> hung;
    std::optional<Clock::time_point> ending;
    int result = 0;
    while (waitpid(child, &result, WNOHANG) == 0) {
        pollfd end{process, POLLIN, 0}; // without pidfd: negative, and poll only waits
        poll(&end, 1, 50);
        if (asked_to_end != 0 && !ending) {
            kill(child, SIGTERM);
            ending = Clock::now();
        }
        if (!hung && (hung = watch.look(status.blame))) kill(child, SIGKILL);
        if (ending && Clock::now() - *ending > std::chrono::seconds(10)) kill(child, SIGKILL);
    }
    if (process >= 0) close(process);

    if (hung) return report(status, *hung, "hung and was ended", as_json);
    if (WIFEXITED(result)) return WEXITSTATUS(result);
    const int number = WTERMSIG(result);
    if (number == SIGKILL && ending)
        return report(status, {}, "did not end within 10 s and was killed", as_json);
    return report(status, of_crash(status.blame), std::string("crashed (") + strsignal(number) + ")",
                  as_json);
}

} // namespace calot::app
