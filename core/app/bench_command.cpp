// calot bench
#include "app/commands.hpp"
#include "bench/bench.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"

#include <CLI/CLI.hpp>

#include <iostream>

namespace calot::app {
namespace {

int rod(const std::vector<std::string>& arguments) {
    host::Services services;
    host::Plugins plugins(services);
    return bench::run_rod(plugins, arguments, std::cout, std::cerr);
}

} // namespace

void add_bench(CLI::App& app, Action& action) {
    CLI::App* command =
        app.add_subcommand("bench", "Put models to problems with a known answer, or time them");
    command->require_subcommand(1);
    // The rod's own parser takes the rest, its --help included.
    CLI::App* rod_command =
        command->add_subcommand("rod", "Reference problems of rod models; without a problem, costs");
    rod_command->prefix_command()->set_help_flag();
    rod_command->callback(
        [=, &action] { action = [arguments = rod_command->remaining()] { return rod(arguments); }; });
    command->footer(examples({"calot bench rod                    what a step of the reference rod costs",
                              "calot bench rod elastica --nodes 50 --load 0.1",
                              "calot bench rod capstan --friction 0.2 --angle 3.14 --csv",
                              "calot bench rod --help             problems and numbers"}));
}

} // namespace calot::app
