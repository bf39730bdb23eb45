// How panels look: calm, dark, large type.
#pragma once

namespace calot::launcher {

/// Sets the current ImGui context's style; `scale` as of rendering::Overlay.
void apply_theme(double scale);

} // namespace calot::launcher
