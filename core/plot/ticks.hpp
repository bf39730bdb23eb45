// Round numbers for an axis.
#pragma once

#include <string>
#include <vector>

namespace calot::plot {

/// What an axis covers, and the round numbers on it.
struct Axis {
    double low = 0, high = 1; // of what is drawn: logarithms when is_log
    bool is_log = false;
    std::vector<double> ticks; // as low and high
    std::vector<std::string> labels;
};

/// An axis for finite values between `low` and `high` (logarithms to base 10 when `is_log`), a little wider,
/// with about `count` ticks at 1, 2 or 5 times a power of ten.
Axis make_axis(double low, double high, bool is_log, int count);

} // namespace calot::plot
