#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace calot::host {
class Plugins;
}

namespace calot::bench {

/// `calot bench rod [PROBLEM] --model ID [numbers] [--csv]`: `arguments` are those after "bench". Prints the
/// problem's rows, or without a problem the costs. Returns the exit code: 0 if every bound is met (a cost
/// over its budget is printed, not failed: machines differ), 1 if one is missed, 2 for bad input, 3 if the
/// plugin fails. Messages go to `errors`.
int run_rod(host::Plugins& plugins, const std::vector<std::string>& arguments, std::ostream& out,
            std::ostream& errors);

} // namespace calot::bench
