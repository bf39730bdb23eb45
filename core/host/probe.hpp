#pragma once

#include <filesystem>
#include <string>

namespace calot::host {

/// Loads a library in a child process (the program calot-probe) and hears what became of it: a crash, an
/// abort, a hang of 2 s or a changed process refuses the library, and this process lives.
/// Returns the refusal in one line; empty if the library is sound. [main]
std::string probe_library(const std::filesystem::path& probe_program, const std::filesystem::path& manifest,
                          const std::filesystem::path& library);

/// The child's part: loads the manifest's library and writes "ok" or the refusal to the descriptor `answer`.
/// Returns the exit code.
int answer_probe(const std::filesystem::path& manifest, int answer);

} // namespace calot::host
