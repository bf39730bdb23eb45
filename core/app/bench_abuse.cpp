// calot bench abuse
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
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>

namespace calot::app {
namespace {

struct Options {
    CaseOptions wanted;
    double seconds = 60;
    bool as_csv = false, is_quiet = false;
};

// A line for each simulated minute.
class Progress : public simulation::Observer {
  public:
    explicit Progress(const bench::SoakJudge& judge) : judge_(judge) {}
    void ticked(const simulation::Snapshot&) override {
        if (judge_.ticks() % 60'000 != 0) return;
        std::fprintf(stderr, "%lld min: deepest %.3f mm, longest over 1 mm %lld ms, nodes outside %zu\n",
                     static_cast<long long>(judge_.ticks() / 60'000), 1e3 * judge_.deepest(),
                     static_cast<long long>(judge_.longest_over_1mm()), judge_.most_outside());
    }

  private:
    const bench::SoakJudge& judge_;
};

// What one round of it is run with: a case may end before its time, since rough hands may do what a procedure
// asks for, and then another one follows.
using Begin = std::function<simulation::Setup(std::uint64_t round)>;

int judged(const Options& given, const Begin& begin, const simulation::World& world,
           const std::string& what) {
    bench::SoakJudge judge(world, 10);
    Progress progress(judge);
    bench::Row like;
    like.problem = "abuse", like.dt = 1e-3;
    like.setting = what + " seed=" + std::to_string(given.wanted.seed);
    const std::int64_t ticks = std::llround(given.seconds * 1000);
    try {
        std::int64_t before = -1;
        for (std::uint64_t round = 0; judge.ticks() < ticks && judge.ticks() > before; ++round) {
            before = judge.ticks();
            const simulation::Setup setup = begin(round);
            like.model = setup.rod.id, like.nodes = static_cast<int>(setup.nodes);
            simulation::Simulation simulation(setup);
            simulation.add_observer(judge);
            if (!given.is_quiet) simulation.add_observer(progress);
            simulation.run({.max_ticks = ticks - before});
        }
    } catch (const host::PluginError& error) {
        std::fprintf(stderr, "calot: after %.3f s: %s: %s: %s: %s\n",
                     static_cast<double>(judge.ticks()) * 1e-3, error.plugin.c_str(), error.function.c_str(),
                     error.field.c_str(), error.message.c_str());
    }
    const std::vector<bench::Row> rows = judge.rows(like, static_cast<double>(ticks) * 1e-3);
    if (given.as_csv)
        bench::write_csv(std::cout, rows);
    else
        bench::write_table(std::cout, rows);
    return std::all_of(rows.begin(), rows.end(), [](const bench::Row& r) { return r.met(); }) ? completed
                                                                                              : not_completed;
}

// The hands of a case are the rough ones; its procedure runs.
int in_a_case(const Options& given) {
    CaseOptions options = given.wanted;
    options.is_headless = true;
    {
        host::Services services;
        host::Plugins plugins(services);
        for (const host::Found& found : plugins.models(host::Kind::procedure)) {
            const auto& demonstration = found.model->procedure->demonstration;
            if (!demonstration || (!options.procedure.empty() && options.procedure != found.model->id))
                continue;
            options.procedure = found.model->id;
            options.device = demonstration->device;
            break;
        }
    }
    if (options.procedure.empty())
        throw host::UserError("--procedure", "", "no procedure with a demonstration is installed; name one");
    std::optional<CaseParts> parts;
    std::optional<bench::RoughHands> hands;
    const auto begin = [&](std::uint64_t round) {
        options.seed = given.wanted.seed + 1000 * round;
        hands.emplace(options.seed);
        parts.emplace(options, nullptr);
        simulation::Setup setup = parts->setup(options, &*hands);
        setup.device = {};
        return setup;
    };
    begin(0);
    const auto world = parts->world;
    return judged(given, begin, *world, options.procedure);
}

int in_an_anatomy(const Options& given) {
    host::Services services;
    host::Plugins plugins(services);
    std::string id = given.wanted.rod;
    for (const host::Found& model : plugins.models(host::Kind::rod))
        if (id.empty() && model.model->is_realtime) id = model.model->id;
    const host::Instance rod = plugins.make(host::Kind::rod, id);
    const auto world = bench::load_soak_world(given.wanted.anatomy, given.wanted.endoscope);
    bench::RoughHands hands(given.wanted.seed);
    simulation::Setup setup;
    setup.world = world;
    setup.rod = {rod.id(), rod.abi()};
    setup.replay = &hands;
    setup.seed = given.wanted.seed;
    setup.threads = given.wanted.threads;
    setup.nodes = simulation::usual_nodes(world->endoscope);
    return judged(
        given, [&](std::uint64_t) { return setup; }, *world, given.wanted.anatomy);
}

} // namespace

void add_bench_abuse(CLI::App& bench, Action& action) {
    const auto o = std::make_shared<Options>();
    o->wanted.threads = 1;
    CLI::App* abuse = bench.add_subcommand(
        "abuse", "Hands at the devices' limits on the whole pipeline: does the shaft stay in the lumen?");
    abuse->add_option("--procedure", o->wanted.procedure, "the first with a demonstration unless given")
        ->type_name("ID");
    abuse->add_option("--rod", o->wanted.rod, "the first real-time model unless given")->type_name("ID");
    abuse->add_option("--anatomy", o->wanted.anatomy, "no procedure: the shaft alone in this anatomy (colon)")
        ->type_name("NAME")
        ->excludes("--procedure");
    abuse->add_option("--endoscope", o->wanted.endoscope, "a datasheet; with --anatomy also the name of one")
        ->type_name("FILE");
    abuse->add_option("--duration", o->seconds, "s of simulated time")
        ->check(CLI::Range(0.1, 36'000.0))
        ->capture_default_str();
    abuse->add_option("--seed", o->wanted.seed, "of start and hands")->capture_default_str();
    abuse->add_option("--threads", o->wanted.threads, "as for calot run")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    abuse->add_flag("--quiet", o->is_quiet, "no line for each simulated minute");
    abuse->add_flag("--csv", o->as_csv, "comma-separated instead of a table");
    abuse->footer(examples({"calot bench abuse --duration 600 --seed 7",
                            "calot bench abuse --anatomy colon --rod org.calot.rod-cosserat"}));
    abuse->callback([o, &action] {
        action = [o] { return o->wanted.anatomy.empty() ? in_a_case(*o) : in_an_anatomy(*o); };
    });
}

} // namespace calot::app
