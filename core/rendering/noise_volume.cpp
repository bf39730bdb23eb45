#include "rendering/noise_volume.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rendering {
namespace {

std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t seed) {
    std::uint32_t h = seed * 0x9E3779B9u;
    for (std::uint32_t v : {x, y, z}) {
        h ^= v + 0x7F4A7C15u;
        h *= 0x85EBCA6Bu;
        h ^= h >> 13;
        h *= 0xC2B2AE35u;
        h ^= h >> 16;
    }
    return h;
}

float corner(int ix, int iy, int iz, float fx, float fy, float fz, int cells, std::uint32_t seed) {
    const auto wrap = [cells](int i) { return static_cast<std::uint32_t>((i % cells + cells) % cells); };
    const std::uint32_t h = hash(wrap(ix), wrap(iy), wrap(iz), seed);
    const auto unit = [](std::uint32_t bits) { return static_cast<float>(bits & 1023u) / 511.5f - 1.0f; };
    float gx = unit(h), gy = unit(h >> 10), gz = unit(h >> 20);
    const float length = std::sqrt(gx * gx + gy * gy + gz * gz) + 1e-6f;
    gx /= length, gy /= length, gz /= length;
    return gx * fx + gy * fy + gz * fz;
}

float fade(float t) {
    return t * t * t * (t * (t * 6 - 15) + 10);
}
float mix(float a, float b, float t) {
    return a + (b - a) * t;
}
std::uint8_t to_byte(float v) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255));
}

float octaves(float x, float y, float z, int cells, int count, std::uint32_t seed) {
    float sum = 0, weight = 1, total = 0;
    for (int i = 0; i < count; ++i) {
        sum += weight * periodic_noise(x, y, z, cells << i, seed + static_cast<std::uint32_t>(i));
        total += weight;
        weight *= 0.55f;
    }
    return sum / total;
}

} // namespace

float periodic_noise(float x, float y, float z, int cells, std::uint32_t seed) {
    const float c = static_cast<float>(cells);
    x *= c, y *= c, z *= c;
    const float fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
    const int ix = static_cast<int>(fx), iy = static_cast<int>(fy), iz = static_cast<int>(fz);
    x -= fx, y -= fy, z -= fz;
    const float u = fade(x), v = fade(y), w = fade(z);
    const auto at = [&](int dx, int dy, int dz) {
        return corner(ix + dx, iy + dy, iz + dz, x - static_cast<float>(dx), y - static_cast<float>(dy),
                      z - static_cast<float>(dz), cells, seed);
    };
    return mix(mix(mix(at(0, 0, 0), at(1, 0, 0), u), mix(at(0, 1, 0), at(1, 1, 0), u), v),
               mix(mix(at(0, 0, 1), at(1, 0, 1), u), mix(at(0, 1, 1), at(1, 1, 1), u), v), w);
}

NoiseTexels make_noise_texels() {
    constexpr int n = kNoiseSize;
    const auto place = [](int x, int y, int z) {
        const auto w = [](int i) { return static_cast<std::size_t>((i % n + n) % n); };
        return (w(z) * n + w(y)) * n + w(x);
    };
    NoiseTexels out;
    out.veins.resize(static_cast<std::size_t>(n) * n * n);
    out.film.resize(out.veins.size());
    std::vector<float> height(out.veins.size()), fine(out.veins.size());
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                const float px = static_cast<float>(x) / n, py = static_cast<float>(y) / n,
                            pz = static_cast<float>(z) / n;
                out.veins[place(x, y, z)] = {to_byte(0.5f + 0.9f * periodic_noise(px, py, pz, 4, 23)),
                                             to_byte(0.5f + 0.9f * periodic_noise(px, py, pz, 7, 37)), 0, 0};
                fine[place(x, y, z)] = 0.5f + 1.2f * octaves(px, py, pz, 5, 3, 41);
                height[place(x, y, z)] = octaves(px, py, pz, 7, 2, 53);
            }
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                const float gx = height[place(x + 1, y, z)] - height[place(x - 1, y, z)];
                const float gy = height[place(x, y + 1, z)] - height[place(x, y - 1, z)];
                const float gz = height[place(x, y, z + 1)] - height[place(x, y, z - 1)];
                constexpr float kScale =
                    1.6f; // slopes of a unit height field on this lattice stay below 0.6 a texel pair
                out.film[place(x, y, z)] = {
                    to_byte(0.5f + 0.5f * kScale * gx), to_byte(0.5f + 0.5f * kScale * gy),
                    to_byte(0.5f + 0.5f * kScale * gz), to_byte(fine[place(x, y, z)])};
            }
    return out;
}

float smooth_noise(const std::array<float, 3>& p, float size, int count, std::uint32_t seed) {
    constexpr int kCells = 4096; // of the periodic lattice: farther than any body reaches
    const float s = 1 / (size * kCells);
    return std::clamp(0.5f + octaves(p[0] * s, p[1] * s, p[2] * s, kCells, count, seed), 0.0f, 1.0f);
}

Texture upload_noise(const std::vector<std::array<std::uint8_t, 4>>& texels) {
    Texture texture = make_texture();
    glBindTexture(GL_TEXTURE_3D, *texture);
    glTexImage3D(GL_TEXTURE_3D, 0, GL_RGBA8, kNoiseSize, kNoiseSize, kNoiseSize, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 texels.data());
    glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
        glTexParameteri(GL_TEXTURE_3D, axis, GL_REPEAT);
    return texture;
}

} // namespace calot::rendering
