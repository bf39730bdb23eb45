#pragma once

#include "bench/bench_rod.hpp"
#include "bench/row.hpp"

#include <vector>

namespace calot::bench {

/// Wall time of a step over its length, medians, for an endoscope of the given nodes: swinging free, and
/// lying in a bent tube with some thirty contacts, pushed and turned. Rows: the whole step (problem "rod"),
/// and the parts that the model names by calot.cost/1. The bound on the whole is `budget` (us per step of 1
/// ms), if positive.
std::vector<Row> rod_costs(const MakeInstance& make, const RodOptions& options, double budget);

} // namespace calot::bench
