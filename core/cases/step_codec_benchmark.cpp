#include "cases/step_codec.hpp"

#include <benchmark/benchmark.h>

#include <array>

namespace calot::cases {
namespace {

// A tick in which both hands move: insertion, rotation and a wheel change.
void journal_encode(benchmark::State& state) {
    calot_controls controls{};
    controls.struct_size = sizeof controls;
    ControlWords before = words_of(controls);
    std::array<char, most_step_bytes> out;
    std::uint32_t mark = 0;
    for ([[maybe_unused]] auto _ : state) {
        controls.insertion += 1e-4;
        controls.rotation += 1e-3;
        controls.wheel[0] += 1e-3;
        const ControlWords now = words_of(controls);
        benchmark::DoNotOptimize(append_step(before, now, ++mark, out.data()));
        benchmark::ClobberMemory();
        before = now;
    }
}
BENCHMARK(journal_encode);

} // namespace
} // namespace calot::cases
