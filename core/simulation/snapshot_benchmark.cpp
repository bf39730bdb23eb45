#include "simulation/snapshot.hpp"

#include <benchmark/benchmark.h>

namespace calot::simulation {
namespace {

// A slot taken and published, as at the end of every tick, with a reader that holds the one before.
void snapshot_publish(benchmark::State& state) {
    SnapshotRing ring(100, 1200);
    std::int64_t tick = 0;
    SnapshotRing::View held;
    for ([[maybe_unused]] auto _ : state) {
        Snapshot* slot = ring.begin();
        if (slot == nullptr) {
            state.SkipWithError("no slot is free with one reader");
            break;
        }
        slot->tick = ++tick;
        ring.publish();
        held = ring.latest();
        benchmark::DoNotOptimize(held->tick);
    }
}
BENCHMARK(snapshot_publish);

} // namespace
} // namespace calot::simulation
