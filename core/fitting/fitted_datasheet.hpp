// The figures of a fit in a datasheet.
#pragma once

#include "fitting/fit.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace calot::fitting {

struct FittedDatasheet {
    std::string text;               // TOML that read_endoscope takes
    std::vector<std::string> notes; // a line each: what could not be put in, and what to do
};

/// The datasheet `base` with the fitted figures in its segments, each with a source that names `table` and
/// the confidence. GJ is that of a right-handed turn, and [torque] asymmetry follows where a segment was
/// twisted both ways. Damping that a datasheet may not hold is left as it was, with a note. Throws
/// host::UserError for a segment that `base` does not have.
FittedDatasheet fitted_datasheet(const std::vector<SegmentFit>& fits, const std::filesystem::path& base,
                                 const std::string& table);

} // namespace calot::fitting
