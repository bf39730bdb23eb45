// calot bench pipeline
#include "app/case_parts.hpp"
#include "app/commands.hpp"
#include "bench/rod_soak.hpp"
#include "bench/rough_hands.hpp"
#include "bench/row.hpp"
#include "bench/soak_judge.hpp"
#include "host/error.hpp"
#include "simulation/endoscope_chain.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

namespace calot::app {
namespace {

// What each part of each tick cost, in s.
class CostRecorder : public simulation::Observer {
  public:
    static constexpr std::size_t part_count = 7;
    static constexpr const char* names[part_count] = {"rod",       "constraints", "collision", "self-contact",
                                                      "procedure", "device",      "pipeline"};

    explicit CostRecorder(std::size_t ticks) {
        for (auto& part : parts_)
            part.reserve(ticks);
    }
    void ticked(const simulation::Snapshot& snapshot) override {
        const simulation::TickCost& c = snapshot.cost;
        const double costs[part_count] = {c.rod,       c.constraints, c.collision, c.self_contact,
                                          c.procedure, c.device,      c.total};
        for (std::size_t i = 0; i < part_count; ++i)
            parts_[i].push_back(costs[i]);
        over_a_tick_ += c.total > 1e-3;
    }
    // Below which a share of the ticks lies.
    double quantile(std::size_t part, double share) {
        std::vector<double>& all = parts_[part];
        if (all.empty()) return 0;
        const auto at =
            std::min(all.size() - 1, static_cast<std::size_t>(share * static_cast<double>(all.size())));
        std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(at), all.end());
        return all[at];
    }
    std::int64_t over_a_tick() const { return over_a_tick_; }

  private:
    std::vector<double> parts_[part_count];
    std::int64_t over_a_tick_ = 0;
};

struct Options {
    CaseOptions wanted;
    double seconds = 20;
    std::optional<std::uint32_t> nodes;
    bool is_realtime = false, as_csv = false;
};

// A procedure with a demonstration, and the device that gives it, unless named.
CaseOptions chosen(const Options& given) {
    CaseOptions options = given.wanted;
    options.is_headless = true;
    host::Services services;
    host::Plugins plugins(services);
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

int measure(const Options& given, simulation::Setup setup, const std::string& what) {
    setup.measure = true;
    if (given.nodes) setup.nodes = *given.nodes;
    simulation::Simulation simulation(setup);
    const auto ticks = static_cast<std::int64_t>(given.seconds * 1000);
    CostRecorder costs(static_cast<std::size_t>(ticks));
    simulation.add_observer(costs);
    simulation::RunOptions run;
    run.max_ticks = ticks;
    run.speed = given.is_realtime ? simulation::Speed::realtime : simulation::Speed::max;
    const simulation::Outcome outcome = simulation.run(run);

    std::vector<bench::Row> rows;
    bench::Row row;
    row.model = setup.rod.id;
    row.nodes = static_cast<int>(setup.nodes);
    row.dt = 1e-3;
    const auto add = [&](const char* part, const char* quantity, double value) {
        row.problem = part, row.quantity = quantity, row.measured = value;
        rows.push_back(row);
    };
    for (std::size_t i = 0; i < CostRecorder::part_count; ++i) {
        add(CostRecorder::names[i], "us_per_simulated_ms", 1e6 * costs.quantile(i, 0.5));
        add(CostRecorder::names[i], "us_per_simulated_ms_99", 1e6 * costs.quantile(i, 0.99));
    }
    add("pipeline", "ticks_over_1ms", static_cast<double>(costs.over_a_tick()));
    if (given.is_realtime) {
        add("pipeline", "late_ticks", static_cast<double>(outcome.late.late));
        add("pipeline", "slipped_ticks", static_cast<double>(outcome.late.slipped));
    }
    add("pipeline", "penetration", outcome.penetration.deepest);
    if (given.as_csv) {
        bench::write_csv(std::cout, rows);
        return completed;
    }
    bench::write_table(std::cout, rows);
    std::printf("medians and 99 %% over %lld ticks of %s, %u threads; %.2f times real time\n",
                static_cast<long long>(outcome.ticks), what.c_str(), setup.threads, outcome.real_time_factor);
    if (given.is_realtime)
        std::printf("real-time scheduling was %s\n", outcome.late.is_first ? "allowed" : "not allowed");
    return completed;
}

int of_a_case(const Options& given) {
    const CaseOptions options = chosen(given);
    CaseParts parts(options, nullptr);
    return measure(given, parts.setup(options, nullptr), options.procedure);
}

// As much of the shaft inside as the anatomy's path takes, in rough hands, without a procedure.
int of_a_shaft(const Options& given) {
    host::Services services;
    host::Plugins plugins(services);
    std::string id = given.wanted.rod;
    for (const host::Found& model : plugins.models(host::Kind::rod))
        if (id.empty() && model.model->is_realtime) id = model.model->id;
    const host::Instance rod = plugins.make(host::Kind::rod, id);
    const auto world = bench::load_soak_world(given.wanted.anatomy, given.wanted.endoscope);
    simulation::StartPose& start = world->scene.starts.front();
    start.insertion = std::min(bench::path_length(*world), world->endoscope.working_length) - 0.03;
    start.insertion_spread = 0;
    bench::RoughHands hands(given.wanted.seed);
    simulation::Setup setup;
    setup.world = world;
    setup.rod = {rod.id(), rod.abi()};
    setup.replay = &hands;
    setup.seed = given.wanted.seed;
    setup.threads = given.wanted.threads;
    setup.nodes = simulation::usual_nodes(world->endoscope);
    char inside[80];
    std::snprintf(inside, sizeof inside, "%.2f m of shaft in the anatomy ", start.insertion);
    return measure(given, setup, inside + given.wanted.anatomy);
}

} // namespace

void add_bench_pipeline(CLI::App& bench, Action& action) {
    const auto o = std::make_shared<Options>();
    o->wanted.threads = 2;
    CLI::App* whole =
        bench.add_subcommand("pipeline", "What each part of a tick costs in a case, medians and 99 %");
    whole->add_option("--procedure", o->wanted.procedure, "the first with a demonstration unless given")
        ->type_name("ID");
    whole->add_option("--device", o->wanted.device, "the demonstration's unless given")->type_name("ID");
    whole->add_option("--rod", o->wanted.rod, "the first real-time model unless given")->type_name("ID");
    whole
        ->add_option("--anatomy", o->wanted.anatomy,
                     "no procedure: the whole shaft in this anatomy (colon), in rough hands")
        ->type_name("NAME")
        ->excludes("--procedure")
        ->excludes("--device");
    whole->add_option("--endoscope", o->wanted.endoscope, "a datasheet; with --anatomy also the name of one")
        ->type_name("FILE");
    whole->add_option("--nodes", o->nodes, "of the rod; 100, or a centimetre each with --anatomy")
        ->check(CLI::Range(20u, 2000u));
    whole->add_option("--seed", o->wanted.seed, "as for calot run")->capture_default_str();
    whole->add_option("--threads", o->wanted.threads, "as for calot run")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    whole->add_option("--seconds", o->seconds, "of simulated time at most")
        ->check(CLI::Range(1.0, 600.0))
        ->capture_default_str();
    whole->add_flag("--realtime", o->is_realtime, "by the clock: counts late ticks too");
    whole->add_flag("--csv", o->as_csv, "comma-separated instead of a table");
    whole->footer(examples({"calot bench pipeline", "calot bench pipeline --threads 1 --csv",
                            "calot bench pipeline --anatomy colon --realtime"}));
    whole->callback([o, &action] {
        action = [o] { return o->wanted.anatomy.empty() ? of_a_case(*o) : of_a_shaft(*o); };
    });
}

} // namespace calot::app
