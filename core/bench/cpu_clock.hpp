#pragma once

#include <ctime>

namespace calot::bench {

/// Processor time of this thread, s: what a step costs does not depend on what else the machine does.
inline double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

} // namespace calot::bench
