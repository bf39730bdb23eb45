#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace calot::meshio {

/// The whole of a regular file. Throws MeshError when it is absent, no regular file, or larger than `limit`
/// bytes.
std::string read_file_bytes(const std::filesystem::path& file, std::uintmax_t limit);

} // namespace calot::meshio
