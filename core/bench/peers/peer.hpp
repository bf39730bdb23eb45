// What a peer's program does: find the largest stable step of its chain and time it. C++17, for Simbody's
// sake.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <initializer_list>

namespace calot::bench::peers {

/// The rod of docs/rods.md's comparison, as a chain clamped at one end: 1 m, radius 6 mm, 0.15 kg/m,
/// w L^3/EI = 5, GJ = 2/3 EI. The first joint has half a link's spring.
struct ChainRod {
    int links = 100;
    double length = 1, radius = 6e-3, mass = 0.15, gravity = 9.81;
    double bending = 0.15 * 9.81 / 5, torsion = 0.15 * 9.81 / 5 * 2 / 3;

    double link() const { return length / links; }
    double bending_spring(int joint) const { return bending / link() * (joint == 0 ? 2 : 1); }
    double torsion_spring(int joint) const { return torsion / link() * (joint == 0 ? 2 : 1); }
};

inline double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Of a chain let go horizontally: how far its tip has dropped after `seconds` in steps of dt, or NaN if it
/// flew apart or the engine gave up. `Chain` is made of (ChainRod, dt) and has step() and tip_drop().
template<class Chain>
double drop_after(const ChainRod& rod, double dt, double seconds) {
    try {
        Chain chain(rod, dt);
        const int steps = static_cast<int>(std::lround(seconds / dt));
        for (int k = 0; k < steps; ++k) {
            chain.step();
            if (k % 16 == 0 && !(std::fabs(chain.tip_drop()) < 2 * rod.length)) return std::nan("");
        }
        return chain.tip_drop();
    } catch (const std::exception&) {
        return std::nan("");
    }
}

/// Of processor time for a simulated millisecond; NaN if the engine gave up.
template<class Chain>
double microseconds(const ChainRod& rod, double dt) {
    try {
        Chain chain(rod, dt);
        const double start = cpu_seconds();
        int steps = 0;
        while (cpu_seconds() - start < 0.3)
            chain.step(), ++steps;
        return 1e6 * (cpu_seconds() - start) / steps * 1e-3 / dt;
    } catch (const std::exception&) {
        return std::nan("");
    }
}

/// Prints "name,links,largest_step,us_per_simulated_ms,drop"; the exit code.
template<class Chain>
int report(const char* name, int argc, char** argv) {
    ChainRod rod;
    if (argc > 1) rod.links = std::atoi(argv[1]);
    if (rod.links < 2 || rod.links > 1000) {
        std::fprintf(stderr, "%s: the number of links must be from 2 to 1000\n", name);
        return 2;
    }
    // A step is stable if the tip is where twenty links bring it in short steps, to 3 % of the length:
    // engines that bound speeds do not fly apart, but stand still.
    constexpr double seconds = 0.3;
    ChainRod few = rod;
    few.links = 20;
    const double right = drop_after<Chain>(few, 2e-5, seconds);
    for (const double dt : {1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6}) {
        const double drop = drop_after<Chain>(rod, dt, seconds);
        if (!(std::fabs(drop - right) < 0.03 * rod.length)) continue;
        std::printf("%s,%d,%g,%g,%g\n", name, rod.links, dt, microseconds<Chain>(rod, dt), drop);
        return 0;
    }
    std::fprintf(stderr, "%s: no step of 2 us or more is stable\n", name);
    return 1;
}

} // namespace calot::bench::peers
