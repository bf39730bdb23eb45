// calot bench endoscope
#include "app/case_parts.hpp"
#include "app/commands.hpp"
#include "bench/endoscope_bench.hpp"
#include "simulation/assets.hpp"

#include <CLI/CLI.hpp>

#include <iostream>

namespace calot::app {

void add_bench_endoscope(CLI::App& bench, Action& action) {
    CLI::App* command = bench.add_subcommand(
        "endoscope", "How far an endoscope's wheels bend its tip, with what hysteresis and force");
    command->set_help_flag(); // its own parser has one
    command->prefix_command();
    command->callback([command, &action] {
        action = [words = command->remaining()] {
            host::Services services;
            host::Plugins plugins(services);
            return bench::run_endoscope(plugins, simulation::find_assets(), words, std::cout, std::cerr);
        };
    });
}

} // namespace calot::app
