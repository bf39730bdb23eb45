#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace calot::meshio {

/// SHA-256 (FIPS 180-4) as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);

/// The same of a file's bytes. Throws MeshError when it cannot be read.
std::string sha256_file(const std::filesystem::path& file);

} // namespace calot::meshio
