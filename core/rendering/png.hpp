// Pictures as PNG files.
#pragma once

#include "rendering/types.hpp"

#include <filesystem>

namespace calot::rendering {

/// Throws std::runtime_error with the file's name and the reason.
void write_png(const std::filesystem::path& file, const Image&);

} // namespace calot::rendering
