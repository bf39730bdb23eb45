#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace calot::host {
class Plugins;
}

namespace calot::bench {

/// `calot bench rod [PROBLEM|all] [--model ID] [numbers] [--csv]`: `arguments` are those after "bench rod".
/// Prints the problem's rows, of every problem and every model for "all", or without a problem the costs.
/// What a model's manifest claims is judged, the rest printed. Returns the exit code: 0 if every claim is met
/// (a cost over its budget is printed, not failed: machines differ), 1 if one is missed, 2 for bad input, 3
/// if the plugin fails. Messages and progress go to `errors`.
int run_rod(host::Plugins& plugins, const std::vector<std::string>& arguments, std::ostream& out,
            std::ostream& errors);

/// `calot bench geometry [TASK] [--rounds N] [--csv]`: what questions to surfaces cost. Where this build has
/// Embree each row also has the ratio to its point queries in the same run, and is judged by that. Returns as
/// run_rod does.
int run_geometry(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& errors);

} // namespace calot::bench
