// Periodic noise in a 3-d texture: what makes tissue mottled, veined and uneven without any image file.
#pragma once

#include "rendering/gl_objects.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace calot::rendering {

inline constexpr int kNoiseSize = 64; // texels along each edge

/// Gradient noise (Perlin 1985) with period 1 in each direction, `cells` lattice cells along it.
/// Deterministic in seed; about -0.7..0.7.
float periodic_noise(float x, float y, float z, int cells, std::uint32_t seed);

/// Texels of the two volumes, 4 bytes each:
/// veins: r and g two independent smooth fields, whose middle values are lines of vessels;
/// film: rgb the gradient of a height field as 0.5 + 0.5 g (the wet film's unevenness), a fine octaves.
struct NoiseTexels {
    std::vector<std::array<std::uint8_t, 4>> veins, film;
};
NoiseTexels make_noise_texels();

/// Smooth noise, 0..1, at a point (m) with features of this size (m) and `count` octaves.
float smooth_noise(const std::array<float, 3>& point, float size, int count, std::uint32_t seed);

/// Repeating, filtered 3-d texture of such texels.
Texture upload_noise(const std::vector<std::array<std::uint8_t, 4>>& texels);

} // namespace calot::rendering
