// A datasheet's segments as properties of a rod's.
#pragma once

#include "simulation/endoscope_datasheet.hpp"

#include <cstdint>
#include <vector>

namespace calot::simulation {

/// N-1 values each, from base to tip, at room temperature and with empty channels.
struct ShaftChain {
    std::uint32_t first_bending = 0; // segment; those before are the shaft
    std::vector<double> length, radius, mass, bending, torsion, bending_damping, torsion_damping, drag,
        friction;
};

/// Nodes about 10.4 mm apart, as 100 are on a gastroscope; between 20 and 2000.
std::uint32_t usual_nodes(const EndoscopeDatasheet& sheet);

/// Divides the shaft, and the bending section, into pieces of equal length each, so that a node lies between
/// them and the other borders lie where they may. A piece has the length, mass and drag of what it stands
/// for, the compliance in bending and in twist (so that a uniform moment turns its ends against each other as
/// in the endoscope), and means of the rest. `nodes` from 20 to 2000. Throws std::invalid_argument.
ShaftChain divide(const EndoscopeDatasheet& sheet, std::uint32_t nodes);

} // namespace calot::simulation
