#pragma once

#include <filesystem>

namespace calot::simulation {

/// The folder with anatomy/, endoscopes/ and shaders/: CALOT_ASSETS, or found upwards from the program.
/// Throws host::UserError.
std::filesystem::path find_assets();

} // namespace calot::simulation
