// One case as a child process.
#pragma once

#include <filesystem>
#include <string>
#include <sys/types.h>
#include <vector>

namespace calot::launcher {

class Child {
  public:
    /// Starts `words[0]` with these arguments, no shell. Its standard error is kept, the last few lines.
    /// Throws std::runtime_error if it cannot be started.
    explicit Child(const std::vector<std::string>& words);

    /// Ends it if it still runs: asks, waits up to two seconds, then insists.
    ~Child();
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// True while it runs; never waits.
    bool poll();

    /// Asks it to end (SIGTERM), so that it closes its record.
    void ask_to_end();

    /// Once poll() is false: its exit code, or 128 + the signal that ended it.
    int exit_code() const { return exit_code_; }
    const std::string& words() const { return said_; }

  private:
    void take_words();

    pid_t pid_ = -1;
    int from_child_ = -1;
    int exit_code_ = -1;
    std::string said_;
};

} // namespace calot::launcher
