#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace calot::host {

/// What the dynamic symbol table of a library says.
struct Exports {
    std::vector<std::string> names;  ///< defined and visible to others
    std::vector<std::string> unique; ///< of these, STB_GNU_UNIQUE: would be shared between all libraries
};

/// Reads a 64-bit ELF library's own table; runs nothing of it. Throws std::runtime_error when the file is
/// none, of another machine, or damaged.
Exports read_exports(const std::filesystem::path& library);

} // namespace calot::host
