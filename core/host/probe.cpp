#include "host/probe.hpp"

#include "host/error.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace calot::host {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto time_limit = std::chrono::seconds(2);
constexpr std::size_t max_answer = 4096;

struct Pipe {
    int read_end = -1, write_end = -1;
    Pipe() {
        int ends[2];
        if (pipe2(ends, O_CLOEXEC) == 0) read_end = ends[0], write_end = ends[1];
    }
    ~Pipe() {
        close_writer();
        if (read_end >= 0) close(read_end);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    void close_writer() {
        if (write_end >= 0) close(write_end);
        write_end = -1;
    }
};

// The first line that is not empty, printable.
std::string first_line(const std::string& said, std::size_t most) {
    std::string line;
    for (const char c : said) {
        if (c == '\n' && !line.empty()) break;
        if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) line += c;
    }
    return line.substr(0, most);
}

// Reads until both ends are closed by the child or time is up; true if it was in time.
bool hear(int answer, int errors, std::string& answered, std::string& said) {
    const auto end = Clock::now() + time_limit;
    pollfd ends[2] = {{answer, POLLIN, 0}, {errors, POLLIN, 0}};
    std::string* texts[2] = {&answered, &said};
    while (ends[0].fd >= 0 || ends[1].fd >= 0) {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
        if (left <= 0) return false;
        if (poll(ends, 2, static_cast<int>(left)) <= 0) continue;
        for (int i = 0; i < 2; ++i) {
            if (ends[i].fd < 0 || ends[i].revents == 0) continue;
            char buffer[1024];
            const ssize_t got = read(ends[i].fd, buffer, sizeof buffer);
            if (got <= 0)
                ends[i].fd = -1;
            else if (texts[i]->size() < max_answer)
                texts[i]->append(buffer, static_cast<std::size_t>(got));
        }
    }
    return true;
}

} // namespace

std::string probe_library(const std::filesystem::path& program, const std::filesystem::path& manifest,
                          const std::filesystem::path& library) {
    const auto refuse = [&](const std::string& what) {
        return std::string(UserError(library.string(), "", what).what());
    };
    Pipe answer, errors;
    const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (answer.read_end < 0 || errors.read_end < 0 || null < 0)
        return refuse("cannot be probed: too many files are open; close some");

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, null, 0);
    posix_spawn_file_actions_adddup2(&actions, null, 1);
    posix_spawn_file_actions_adddup2(&actions, errors.write_end, 2);
    posix_spawn_file_actions_adddup2(&actions, answer.write_end, 3);
    const std::string program_text = program.string(), manifest_text = manifest.string();
    char* arguments[] = {const_cast<char*>(program_text.c_str()), const_cast<char*>(manifest_text.c_str()),
                         nullptr};
    pid_t child = 0;
    const int problem = posix_spawn(&child, program_text.c_str(), &actions, nullptr, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(null);
    if (problem != 0)
        return refuse("cannot be probed: " + program_text + ": " + std::strerror(problem) +
                      "; install Calot again");
    answer.close_writer();
    errors.close_writer();

    std::string answered, said;
    const bool is_in_time = hear(answer.read_end, errors.read_end, answered, said);
    if (!is_in_time) kill(child, SIGKILL);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    const std::string line = first_line(said, 200);
    const std::string quoted = line.empty() ? "" : " (it said: " + line + ")";
    const std::string remedy = "; repair the plugin or remove its folder";
    if (!is_in_time) return refuse("hangs while it is loaded: more than 2 s" + quoted + remedy);
    if (WIFSIGNALED(status))
        return refuse(std::string("crashes while it is loaded: ") + strsignal(WTERMSIG(status)) + quoted +
                      remedy);
    answered = first_line(answered, 1000);
    if (answered.empty()) return refuse("ends the process while it is loaded" + quoted + remedy);
    return answered == "ok" ? "" : answered;
}

} // namespace calot::host
