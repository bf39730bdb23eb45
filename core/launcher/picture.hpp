// Pictures of procedures, for ImGui.
#pragma once

#include "rendering/gl_objects.hpp"

#include <filesystem>

namespace calot::launcher {

struct Picture {
    rendering::Texture texture;
    int width = 0, height = 0;
    bool empty() const { return width == 0; }
};

/// A PNG file of at most 16 million pixels as a texture of the current context; empty if there is none or it
/// is broken.
Picture load_picture(const std::filesystem::path& file);

} // namespace calot::launcher
