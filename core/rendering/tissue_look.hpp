// From appearances to what each vertex looks like. Done once for a surface: the picture's shader then only
// adds what is finer than a mesh, vessels and the unevenness of the wet film.
#pragma once

#include "rendering/appearance.hpp"
#include "rendering/types.hpp"

namespace calot::rendering {

struct LookVertex {
    std::array<std::uint8_t, 4> outer,
        inner;                         // gamma 2 colour (square to get light); a: how much vessels show
    std::array<std::uint8_t, 4> gloss; // sheen, wet, bump, soft
    std::array<std::uint8_t, 4> open;  // ambient openness outer, inner; where trunks, branches of vessels are
};

/// Where triangles of different appearance meet, their looks blend over about two triangles.
/// \param concave  see concavity()
/// Throws std::invalid_argument for a name that the table does not have.
std::vector<LookVertex> tissue_look(const Surface&, const std::vector<float>& concave,
                                    const std::vector<Appearance>& table);

} // namespace calot::rendering
