// calot: the program and its subcommands.
#include "app/commands.hpp"
#include "host/error.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>

namespace calot::app {
namespace {

int perform(int count, char** arguments) {
    CLI::App app(
        "Calot simulates endoscopic procedures for training. Without a subcommand it opens the launcher.",
        "calot");
    app.set_version_flag("--version", CALOT_VERSION);
    app.require_subcommand(0, 1);
    app.get_formatter()->column_width(34);
    app.footer(
        examples({"calot                              open the launcher",
                  "calot list                         what is installed",
                  "calot run --help                   how to perform a procedure without the launcher"}) +
        "\nExit codes: 0 completed, 1 not completed, 2 bad input or a plugin refused before the case,\n"
        "3 plugin or device failure during it.");
    Action action = [] { return launch(); };
    add_run(app, action);
    add_replay(app, action);
    add_list(app, action);
    add_bench(app, action);
    add_fit(app, action);
    try {
        app.parse(count, arguments);
    } catch (const CLI::ParseError& e) {
        if (e.get_exit_code() == 0) return app.exit(e);
        std::fprintf(stderr, "calot: %s; `calot --help` or `calot SUBCOMMAND --help` shows what there is\n",
                     e.what());
        return bad_input;
    }
    return action();
}

} // namespace
} // namespace calot::app

int main(int count, char** arguments) {
    try {
        return calot::app::perform(count, arguments);
    } catch (const calot::host::PluginError& e) {
        std::fprintf(stderr, "calot: %s\n", e.what());
        return calot::app::plugin_failure;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "calot: %s\n", e.what());
        return calot::app::bad_input;
    }
}
