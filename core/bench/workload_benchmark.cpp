// calot-benchmarks: steps of the real-time rods through the plugin contract, the plain block solve, queries.
#include "bench/workloads.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"

#include <benchmark/benchmark.h>

#include <filesystem>

namespace calot::bench {
namespace {

host::Plugins& plugins() {
    static host::Services services;
    static host::Plugins all(services, [] {
        const auto build = std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path();
        host::Plugins::Options options = host::Plugins::defaults();
        options.places = {{.folder = build / "lib/calot/plugins", .origin = "the build"}};
        options.probe_program = build / "bin/calot-probe";
        return options;
    }());
    return all;
}

void run(benchmark::State& state, Workload& work) {
    for (int k = 0; k < 50; ++k)
        work.prepare(), work.run();
    for (auto _ : state) {
        state.PauseTiming();
        work.prepare();
        state.ResumeTiming();
        work.run();
    }
}

void rod(benchmark::State& state, const char* model, const char* what) {
    run(state, *rod_workload(what, [&] { return plugins().make(host::Kind::rod, model); }));
}
BENCHMARK_CAPTURE(rod, direct_free, "org.calot.rod-direct", "rod-free");
BENCHMARK_CAPTURE(rod, direct_20_contacts, "org.calot.rod-direct", "rod-floor");
BENCHMARK_CAPTURE(rod, direct_36_contacts, "org.calot.rod-direct", "rod-tube");
BENCHMARK_CAPTURE(rod, cosserat_free, "org.calot.rod-cosserat", "rod-free");
BENCHMARK_CAPTURE(rod, cosserat_20_contacts, "org.calot.rod-cosserat", "rod-floor");
BENCHMARK_CAPTURE(rod, cosserat_36_contacts, "org.calot.rod-cosserat", "rod-tube");

void plain(benchmark::State& state, const char* what) {
    run(state, *plain_workload(what));
}
BENCHMARK_CAPTURE(plain, block_solve, "block-solve");
BENCHMARK_CAPTURE(plain, spheres, "spheres");
BENCHMARK_CAPTURE(plain, capsules, "capsules");
BENCHMARK_CAPTURE(plain, capsules_again, "capsules-again");
BENCHMARK_CAPTURE(plain, refit, "refit");

} // namespace
} // namespace calot::bench

BENCHMARK_MAIN();
