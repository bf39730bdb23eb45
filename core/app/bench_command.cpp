// calot bench
#include "app/commands.hpp"
#include "bench/bench.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"

#include <CLI/CLI.hpp>

#include <iostream>

namespace calot::app {

void add_bench(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("bench", "Put models to reference problems, and time them");
    command->require_subcommand(1);
    command->footer(
        examples({"calot bench rod --nodes 100            what a step costs",
                  "calot bench rod elastica --load 0.1     a problem with a known answer",
                  "calot bench rod --help                 all problems",
                  "calot bench geometry                   what contact queries cost",
                  "calot bench pipeline --csv             what each part of a tick costs",
                  "calot bench abuse --duration 600       rough hands: does the shaft stay inside?"}));

    CLI::App* rod = command->add_subcommand("rod", "Reference problems and costs of a rod model");
    rod->set_help_flag(); // its own parser has one
    rod->prefix_command();
    rod->callback([rod, &action] {
        action = [words = rod->remaining()] {
            host::Services services;
            host::Plugins plugins(services);
            return bench::run_rod(plugins, words, std::cout, std::cerr);
        };
    });

    CLI::App* geometry =
        command->add_subcommand("geometry", "What distance and contact queries cost, beside Embree's");
    geometry->set_help_flag(); // its own parser has one
    geometry->prefix_command();
    geometry->callback([geometry, &action] {
        action = [words = geometry->remaining()] { return bench::run_geometry(words, std::cout, std::cerr); };
    });

    add_bench_endoscope(*command, action);
    add_bench_pipeline(*command, action);
    add_bench_abuse(*command, action);
}

} // namespace calot::app
