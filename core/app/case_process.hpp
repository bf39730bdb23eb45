#pragma once

#include "app/supervisor.hpp"
#include "cases/journal.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace calot::app {

/// What `calot run` and `calot replay` were asked for.
struct CaseOptions {
    std::string procedure;
    std::string device;                             ///< empty: in a window the first that takes its events
    std::string rod;                                ///< empty: the first real-time one
    std::string endoscope;                          ///< a datasheet's file; empty: the scene's
    std::string anatomy;                            ///< empty: the scene's
    std::map<std::string, std::string> meshes;      ///< files of meshes by organ, in place of the anatomy's
    std::map<std::string, std::string> instruments; ///< datasheets by channel, "1" the first
    std::string start = "default";
    std::string until; ///< a task's id
    std::string operator_code;
    std::string skill = "expert";
    std::uint64_t seed = 0;
    unsigned threads = 2;
    bool is_headless = false;
    bool is_realtime = true;
    double time_limit = 0; ///< s of simulated time; 0: none
    std::string video;
    std::string folder;
    bool as_json = false;
    bool verify = false; ///< of a replay
};

/// Performs a case in this process; returns the exit code. `replay`: its controls are used in place of a
/// device's, and nothing is recorded.
int run_case(const CaseOptions& options, const cases::Journal* replay, CaseShared& shared);

} // namespace calot::app
