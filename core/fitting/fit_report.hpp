// A fit for people, for programs and as a picture.
#pragma once

#include "fitting/fit.hpp"
#include "plot/chart.hpp"

#include <ostream>
#include <vector>

namespace calot::fitting {

/// Each reading with its residual, then the figures with their confidence, rms and worst residual.
void write_report(std::ostream& out, const std::vector<SegmentFit>& fits);
/// Columns segment,quantity,value,low,high,rms,worst,used,set_aside: full precision, SI units.
void write_csv(std::ostream& out, const std::vector<SegmentFit>& fits);
/// Data against fit, one panel for each kind of test.
std::vector<plot::Panel> panels(const std::vector<SegmentFit>& fits);

} // namespace calot::fitting
