#pragma once

#include "bench/bench_rod.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace calot::host {
class Plugins;
}

namespace calot::bench {

/// What is counted and timed piece by piece: prepare() sets up what run() then does, and only run() is
/// measured.
class Workload {
  public:
    virtual ~Workload() = default;
    virtual void prepare() {}
    virtual void run() = 0;
};

/// Of "rod-free" and "rod-floor" (20 contacts that slip), the rod of `calot bench rod --compare`, and
/// "rod-tube" (half in a bent tube, 36 contacts), a gastroscope shaft: 100 nodes, ticks of 1 ms, through the
/// plugin contract. Null for another name. Throws host::PluginError as plugins do.
std::unique_ptr<Workload> rod_workload(std::string_view name, const MakeInstance& make);

/// Of "block-solve" (a plain 6x6 block-tridiagonal solve of 99 blocks), "spheres" (100 of 6 mm, everywhere in
/// a box with 20,000 triangles), "capsules" (a shaft of 100 that slides 0.3 mm a tick), "capsules-again" (the
/// same, asked at places 15 um apart), "refit" (3,136 moved triangles). Null for another name.
std::unique_ptr<Workload> plain_workload(std::string_view name);

} // namespace calot::bench
