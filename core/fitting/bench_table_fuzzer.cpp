// libFuzzer: any text as a table of readings, and the fit of what it holds.
#include "fitting/bench_table.hpp"
#include "fitting/fit.hpp"
#include "fitting/fit_report.hpp"
#include "host/error.hpp"

#include <cstdint>
#include <sstream>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        const auto fits = calot::fitting::fit(calot::fitting::parse_bench_table(text, "fuzz"), "fuzz");
        std::ostringstream out;
        calot::fitting::write_report(out, fits);
        calot::fitting::panels(fits);
    } catch (const calot::host::UserError&) { // refused in order
    }
    return 0;
}
