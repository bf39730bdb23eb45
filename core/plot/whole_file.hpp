// A file that is there whole or not at all.
#pragma once

#include <filesystem>
#include <string_view>

namespace calot::plot {

/// Writes beside the file and renames: whoever interrupts it, or a full disk, leaves what was there before.
/// Throws host::UserError naming the file. [main thread]
void write_whole(const std::filesystem::path& file, std::string_view bytes);

} // namespace calot::plot
