// What an endoscope's tip does on the bench: how far its wheels bend it, with what hysteresis and force.
#pragma once

#include "bench/bench_rod.hpp"
#include "bench/row.hpp"
#include "plot/chart.hpp"
#include "simulation/endoscope_datasheet.hpp"

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace calot::host {
class Plugins;
}

namespace calot::bench {

struct EndoscopeBench {
    std::string model;
    simulation::EndoscopeDatasheet sheet;
    /// Besides without any.
    std::vector<simulation::InstrumentDatasheet> instruments;
    std::optional<std::uint32_t> nodes; ///< along the working length; usual_nodes unless given
    double wheel_speed = 0.26;          ///< rad/s; 15 degrees: slowly
};

struct EndoscopeFindings {
    std::vector<Row> rows;
    std::vector<plot::Panel> panels; ///< hysteresis loops, and shapes of the tip
};

/// Turns the up-down wheel from neutral to its stops and back, then the other wheel, then up against a stop
/// at the tip; for each instrument (the first channel that it fits) again. Rows compare with what the
/// datasheet says was measured. Throws host::UserError for an instrument that fits no channel,
/// host::PluginError.
EndoscopeFindings run(const MakeInstance& make, const EndoscopeBench& bench);

/// `calot bench endoscope`: `arguments` are those after "endoscope". Exit codes as run_rod. `assets` holds
/// endoscopes/ and instruments/.
int run_endoscope(host::Plugins& plugins, const std::filesystem::path& assets,
                  const std::vector<std::string>& arguments, std::ostream& out, std::ostream& errors);

} // namespace calot::bench
