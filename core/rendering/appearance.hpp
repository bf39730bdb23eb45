// The table of tissues' looks (assets/shaders/appearance.toml).
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace calot::rendering {

/// One tissue; the fields are explained at the top of appearance.toml. Colours are linear light.
struct Appearance {
    std::string name;
    std::array<float, 3> albedo{}, mottled{}, crease{};
    float mottle = 0, patch = 0, vessels = 0, sheen = 0, wet = 0, bump = 0, soft = 0;
};

/// Throws std::runtime_error with file, entry, field and remedy if the table is not as it should be.
std::vector<Appearance> read_appearances(const std::filesystem::path& file);

/// Index of `name`. Throws std::invalid_argument that lists the known names.
std::size_t find_appearance(const std::vector<Appearance>& table, const std::string& name);

} // namespace calot::rendering
