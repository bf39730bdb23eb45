#pragma once

#include "host/blame.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace calot::app {

/// Memory that the supervisor and the simulating child share.
struct CaseShared {
    host::Blame blame;
    /// Set when the first tick is about to run: what fails before is bad input, what fails later a failure.
    std::atomic<bool> is_running{false};
    /// Where the record is, zero-terminated; empty until it exists.
    std::array<char, 4096> folder{};

    void set_folder(const std::string& path);
};

/// Runs `body` in a child process and returns its exit code. A crash of the child, or a call into a plugin
/// that takes a second (half a minute where it may take its time), ends it; the culprit is named on standard
/// error, with `as_json` also as an object on standard output. SIGINT and SIGTERM reach the child as SIGTERM;
/// if it then does not end within 10 s, it is killed. The child dies with this process.
/// To be called while the process has one thread and has opened nothing.
int supervise(const std::function<int(CaseShared&)>& body, bool as_json);

} // namespace calot::app
