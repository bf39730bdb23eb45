#include "launcher/child.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <spawn.h>
#include <stdexcept>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

extern char** environ;

namespace calot::launcher {

Child::Child(const std::vector<std::string>& words) {
    if (words.empty()) throw std::runtime_error("no program to start");
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0)
        throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
    std::vector<std::string> copy = words;
    std::vector<char*> arguments;
    arguments.reserve(copy.size() + 1);
    for (std::string& word : copy)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    const int error = posix_spawnp(&pid_, arguments[0], &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    if (error != 0) {
        ::close(ends[0]);
        throw std::runtime_error(words[0] + ": cannot be started: " + std::strerror(error));
    }
    from_child_ = ends[0];
    fcntl(from_child_, F_SETFL, fcntl(from_child_, F_GETFL) | O_NONBLOCK);
}

Child::~Child() {
    if (poll()) {
        ask_to_end();
        for (int i = 0; i < 100 && poll(); ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        if (pid_ > 0) {
            kill(pid_, SIGKILL);
            while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
            }
        }
    }
    ::close(from_child_);
}

void Child::take_words() {
    constexpr std::size_t kKept = 2000;
    std::array<char, 1024> buffer{};
    for (ssize_t n = 0; (n = ::read(from_child_, buffer.data(), buffer.size())) > 0;) {
        said_.append(buffer.data(), static_cast<std::size_t>(n));
        if (said_.size() > kKept) said_.erase(0, said_.size() - kKept);
    }
}

bool Child::poll() {
    if (pid_ < 0) return false;
    take_words();
    int status = 0;
    const pid_t ended = waitpid(pid_, &status, WNOHANG);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return true;
    take_words();
    pid_ = -1;
    exit_code_ = ended > 0 ? (WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)) : -1;
    return false;
}

void Child::ask_to_end() {
    if (pid_ > 0) kill(pid_, SIGTERM);
}

} // namespace calot::launcher
