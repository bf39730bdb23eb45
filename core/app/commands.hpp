#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace calot::app {

/// Exit codes of every subcommand.
enum Exit { completed = 0, not_completed = 1, bad_input = 2, plugin_failure = 3 };

/// What the chosen subcommand does; returns the exit code.
using Action = std::function<int()>;

/// Each adds its subcommands; their callbacks set `action`, which runs after the whole command line is read.
void add_run(CLI::App& app, Action& action);
void add_replay(CLI::App& app, Action& action);
void add_list(CLI::App& app, Action& action);
void add_bench(CLI::App& app, Action& action);
void add_fit(CLI::App& app, Action& action);
/// Below `calot bench`.
void add_bench_endoscope(CLI::App& bench, Action& action);
void add_bench_pipeline(CLI::App& bench, Action& action);
void add_bench_abuse(CLI::App& bench, Action& action);

/// The launcher: what `calot` does without a subcommand.
int launch();

/// A text as JSON writes it, with its quotes. Bytes that are not UTF-8 become U+FFFD.
std::string json_text(std::string_view text);

/// What stands below the help of a subcommand.
std::string examples(std::initializer_list<std::string_view> lines);

} // namespace calot::app
