// calot bench
#include "app/case_parts.hpp"
#include "app/commands.hpp"
#include "bench/bench.hpp"
#include "bench/row.hpp"
#include "host/error.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <iostream>
#include <memory>

namespace calot::app {
namespace {

// What each part of each tick cost, in s.
class CostRecorder : public simulation::Observer {
  public:
    static constexpr std::size_t part_count = 6;
    static constexpr const char* names[part_count] = {"rod",       "constraints", "collision",
                                                      "procedure", "device",      "pipeline"};

    explicit CostRecorder(std::size_t ticks) {
        for (auto& part : parts_)
            part.reserve(ticks);
    }
    void ticked(const simulation::Snapshot& snapshot) override {
        const simulation::TickCost& c = snapshot.cost;
        const double costs[part_count] = {c.rod, c.constraints, c.collision, c.procedure, c.device, c.total};
        for (std::size_t i = 0; i < part_count; ++i)
            parts_[i].push_back(costs[i]);
    }
    double median(std::size_t part) {
        std::vector<double>& all = parts_[part];
        if (all.empty()) return 0;
        const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
        std::nth_element(all.begin(), middle, all.end());
        return *middle;
    }

  private:
    std::vector<double> parts_[part_count];
};

struct Options {
    CaseOptions wanted;
    double seconds = 20;
    bool as_csv = false;
};

// A procedure with a demonstration, and the device that gives it, unless named.
CaseOptions chosen(const Options& given) {
    CaseOptions options = given.wanted;
    options.is_headless = true;
    host::Services services;
    const host::Plugins plugins(services);
    for (const host::Found& found : plugins.models(host::Kind::procedure)) {
        if (!options.procedure.empty() && options.procedure != found.model->id) continue;
        const auto& demonstration = found.model->procedure->demonstration;
        if (!demonstration) continue;
        if (options.procedure.empty()) options.procedure = found.model->id;
        if (options.device.empty()) options.device = demonstration->device;
        break;
    }
    if (options.procedure.empty())
        throw host::UserError("--procedure", "",
                              "no procedure with a demonstration is installed; name one, and --device");
    return options;
}

int pipeline(const Options& given) {
    const CaseOptions options = chosen(given);
    CaseParts parts(options, nullptr);
    simulation::Setup setup = parts.setup(options, nullptr);
    setup.measure = true;
    simulation::Simulation simulation(setup);
    const auto ticks = static_cast<std::int64_t>(given.seconds * 1000);
    CostRecorder costs(static_cast<std::size_t>(ticks));
    simulation.add_observer(costs);
    simulation::RunOptions run;
    run.max_ticks = ticks;
    const simulation::Outcome outcome = simulation.run(run);
    std::vector<bench::Row> rows;
    for (std::size_t i = 0; i < CostRecorder::part_count; ++i) {
        bench::Row row;
        row.problem = CostRecorder::names[i];
        row.model = parts.header.rod;
        row.nodes = static_cast<int>(parts.header.nodes);
        row.dt = 1e-3;
        row.quantity = "us_per_simulated_ms";
        row.measured = 1e6 * costs.median(i);
        rows.push_back(row);
    }
    if (given.as_csv) {
        bench::write_csv(std::cout, rows);
    } else {
        bench::write_table(std::cout, rows);
        std::printf("medians over %lld ticks of %s, %u threads; %.2f times real time\n",
                    static_cast<long long>(outcome.ticks), options.procedure.c_str(), options.threads,
                    outcome.real_time_factor);
    }
    return completed;
}

} // namespace

void add_bench(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("bench", "Put models to reference problems, and time them");
    command->require_subcommand(1);
    command->footer(examples({"calot bench rod --nodes 100            what a step costs",
                              "calot bench rod elastica --load 0.1     a problem with a known answer",
                              "calot bench rod --help                 all problems",
                              "calot bench pipeline --csv             what each part of a tick costs"}));

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

    add_bench_endoscope(*command, action);

    const auto o = std::make_shared<Options>();
    o->wanted.threads = 2;
    CLI::App* whole =
        command->add_subcommand("pipeline", "What each part of a tick costs in a case, medians");
    whole->add_option("--procedure", o->wanted.procedure, "the first with a demonstration unless given")
        ->type_name("ID");
    whole->add_option("--device", o->wanted.device, "the demonstration's unless given")->type_name("ID");
    whole->add_option("--rod", o->wanted.rod, "the first real-time model unless given")->type_name("ID");
    whole->add_option("--seed", o->wanted.seed, "as for calot run")->capture_default_str();
    whole->add_option("--threads", o->wanted.threads, "as for calot run")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    whole->add_option("--seconds", o->seconds, "of simulated time at most")
        ->check(CLI::Range(1.0, 600.0))
        ->capture_default_str();
    whole->add_flag("--csv", o->as_csv, "comma-separated instead of a table");
    whole->footer(examples({"calot bench pipeline", "calot bench pipeline --threads 1 --csv"}));
    whole->callback([o, &action] { action = [o] { return pipeline(*o); }; });
}

} // namespace calot::app
