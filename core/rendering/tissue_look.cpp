#include "rendering/tissue_look.hpp"

#include "rendering/noise_volume.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace calot::rendering {
namespace {

// One side of a vertex: albedo, mottled, crease (three numbers each), mottle, patch, vessels, sheen, wet,
// bump, soft.
using Blend = std::array<float, 16>;

Blend to_blend(const Appearance& a) {
    return {a.albedo[0], a.albedo[1], a.albedo[2], a.mottled[0], a.mottled[1], a.mottled[2],
            a.crease[0], a.crease[1], a.crease[2], a.mottle,     a.patch,      a.vessels,
            a.sheen,     a.wet,       a.bump,      a.soft};
}

std::uint8_t byte(float v) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255));
}
float ramp(float low, float high, float v) {
    return std::clamp((v - low) / (high - low), 0.0f, 1.0f);
}

// Each vertex' mean over its triangles, then one round over neighbours.
std::vector<Blend> blend_regions(const Surface& s, const std::vector<Appearance>& table) {
    std::map<std::string, Blend> known;
    const auto look = [&](const std::string& name) -> const Blend& {
        auto found = known.find(name);
        if (found == known.end())
            found = known.emplace(name, to_blend(table[find_appearance(table, name)])).first;
        return found->second;
    };
    if (s.triangle_appearance.empty()) return std::vector<Blend>(s.vertices.size(), look(s.appearance));
    std::vector<Blend> sum(s.vertices.size(), Blend{});
    std::vector<float> weight(s.vertices.size(), 0);
    const auto add = [&](std::uint32_t to, const Blend& from) {
        for (std::size_t k = 0; k < from.size(); ++k)
            sum[to][k] += from[k];
        weight[to] += 1;
    };
    const auto normalise = [&] {
        for (std::size_t i = 0; i < sum.size(); ++i)
            for (float& v : sum[i])
                v /= std::max(weight[i], 1.0f);
    };
    for (std::size_t t = 0; t < s.triangles.size(); ++t)
        for (const std::uint32_t i : s.triangles[t])
            add(i, look(s.triangle_appearance[t]));
    normalise();
    const std::vector<Blend> first = sum;
    std::fill(weight.begin(), weight.end(), 1.0f);
    for (const auto& t : s.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            add(t[k], first[t[(k + 1) % 3]]);
            add(t[k], first[t[(k + 2) % 3]]);
        }
    normalise();
    return sum;
}

struct Side {
    std::array<std::uint8_t, 4> colour{};
    float fold = 0;
};

Side paint(const Blend& b, float concave, float mottle, const std::array<std::uint8_t, 4>& tint) {
    Side out;
    out.fold = std::clamp(concave * 1.2f - 0.08f, 0.0f, 1.0f);
    const float ridge = 1 + 0.14f * std::clamp(-concave, 0.0f, 1.0f);
    const float mix = ramp(0.3f, 0.75f, mottle) * b[9];
    for (std::size_t k = 0; k < 3; ++k) {
        float c = b[k] + (b[3 + k] - b[k]) * mix;
        c += (b[6 + k] - c) * out.fold * 0.6f;
        c *= ridge * static_cast<float>(tint[k]) / 255;
        out.colour[k] = byte(std::sqrt(std::clamp(c, 0.0f, 1.0f)));
    }
    out.colour[3] = byte(b[11] * (1 - 0.5f * out.fold));
    return out;
}

} // namespace

std::vector<LookVertex> tissue_look(const Surface& s, const std::vector<float>& concave,
                                    const std::vector<Appearance>& table) {
    const std::vector<Blend> outer = blend_regions(s, table);
    const bool two_sided = !s.inner_appearance.empty();
    const Blend inner = two_sided ? to_blend(table[find_appearance(table, s.inner_appearance)]) : Blend{};
    std::vector<LookVertex> out(s.vertices.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
        const Blend& in = two_sided ? inner : outer[i];
        const auto mottle = [&](const Blend& b) {
            return std::clamp(1.1f * smooth_noise(s.vertices[i], b[10], 3, 61) - 0.05f, 0.0f, 1.0f);
        };
        constexpr std::array<std::uint8_t, 4> kWhite{255, 255, 255, 255};
        const std::array<std::uint8_t, 4>& tint = s.colours.empty() ? kWhite : s.colours[i];
        const Side a = paint(outer[i], concave[i], mottle(outer[i]), tint);
        const Side b = paint(in, -concave[i], mottle(in), tint);
        const float open = static_cast<float>(tint[3]) / 255;
        out[i].outer = a.colour;
        out[i].inner = b.colour;
        for (std::size_t k = 0; k < 4; ++k)
            out[i].gloss[k] = byte(in[12 + k]);
        out[i].open = {byte(open * (1 - 0.4f * a.fold)), byte(open * (1 - 0.4f * b.fold)),
                       byte(smooth_noise(s.vertices[i], 0.03f, 1, 71)),
                       byte(smooth_noise(s.vertices[i], 0.022f, 1, 83))};
    }
    return out;
}

} // namespace calot::rendering
