#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace calot::app {

/// Where cases are kept: $XDG_DATA_HOME/calot/cases, ~/.local/share/calot/cases.
std::filesystem::path cases_folder();

/// A folder in it that does not exist yet: <time>-<procedure>-<seed>.
std::filesystem::path new_case_folder(const std::string& procedure, std::uint64_t seed);

} // namespace calot::app
