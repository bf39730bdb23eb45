#pragma once

#include "bench/bench_rod.hpp"
#include "simulation/world.hpp"

#include <memory>
#include <string>

namespace calot::bench {

/// A shaft in an anatomy, without a procedure: `anatomy` "reference" (starts in the oesophagus) or "colon"
/// (starts anywhere between rectum and caecum), or another that has the landmarks "guide" and "path".
/// `endoscope`: a datasheet's file or the name of one in assets/endoscopes; empty: the one usual there.
/// Throws host::UserError.
std::shared_ptr<simulation::World> load_soak_world(const std::string& anatomy, const std::string& endoscope,
                                                   std::optional<double> friction = {});
/// m along the anatomy's path.
double path_length(const simulation::World& world);

} // namespace calot::bench
