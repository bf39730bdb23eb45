// Reference problems in motion.
#include "bench/random.hpp"
#include "bench/rod_problems.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::bench {

namespace {
constexpr double pi = std::numbers::pi;
}

std::vector<Row> run_rotate(const MakeInstance& make, const RodOptions& o) {
    const UniformRod uniform = UniformRod::at_rest(o, {.nodes = 40});
    Random random(o.seed);
    const Quat turn = random.orientation();
    const double moment = o.load.value_or(1.5 * uniform.bending / uniform.length);
    // Its weight bends it no more than in `heavy`, and it has time to move, though not so long that a chaotic
    // swing tells rounding errors apart.
    const double gravity =
        std::min(9.81, 5 * uniform.bending / (uniform.mass_per_length * std::pow(uniform.length, 3)));
    const int steps = std::clamp(static_cast<int>(0.5 / uniform.lowest_frequency() / uniform.dt), 100, 1000);
    const auto swing = [&](const Quat& scene) {
        BenchRod::Setup s;
        s.rod = uniform;
        s.position = straight_line(uniform, {}, scene * along_x);
        s.frame = same_frames(uniform, scene * along_x);
        s.drag = 0.3 * uniform.lowest_frequency();
        BenchRod rod(make, std::move(s));
        rod.clamp_base({}, scene * along_x);
        store(rotate(scene, {0, gravity, 0}), rod.input.gravity);
        rod.load_tip({}, rotate(scene, Vec3{0.6, 0.3, 0.5} * moment));
        for (int k = 0; k < steps; ++k)
            rod.step();
        return rod.positions();
    };
    const auto plain = swing({}), turned = swing(turn);
    double worst = 0;
    for (std::size_t i = 0; i < plain.size(); ++i)
        worst = std::max(worst, norm(turned[i] - rotate(turn, plain[i])));
    worst /= uniform.length;
    const double moved = norm(plain.back() - Vec3{uniform.length, 0, 0}) / uniform.length;
    return {absolute_row("rotate", o, uniform, "deviation", worst, 0, worst, 1e-9, setting("moved", moved))};
}

// Bent by a tip load and its own weight, then let go: weight stays, the load is gone. Energies are divided by
// the greatest kinetic energy.
std::vector<Row> run_energy(const MakeInstance& make, const RodOptions& o) {
    const UniformRod uniform = UniformRod::at_rest(o);
    const double unit = uniform.bending / (uniform.length * uniform.length), load = o.load.value_or(unit);
    const double w = uniform.lowest_frequency(), period = 2 * pi / w;
    BenchRod::Setup s;
    s.rod = uniform;
    s.position = straight_line(uniform, {}, along_x);
    s.frame = same_frames(uniform, along_x);
    s.drag = 2 * w;
    BenchRod rod(make, std::move(s));
    rod.clamp_base({}, along_x);
    rod.input.gravity[1] = 0.5 * unit / (uniform.mass_per_length * uniform.length);
    rod.load_tip({0, load, 0}, {});
    rod.settle(1e-9 * uniform.length * w, 80 / w);
    rod.set_drag(0);
    rod.input.tip.mode = CALOT_END_FREE;

    constexpr int periods = 4;
    const double start = rod.energy(), begin = rod.seconds();
    double highest = start, kinetic = 0, rise = -std::numeric_limits<double>::infinity();
    std::vector<double> maxima;
    while (rod.seconds() - begin < periods * period) {
        rod.step();
        const auto index = static_cast<std::size_t>((rod.seconds() - begin) / period);
        if (index >= maxima.size()) maxima.push_back(rod.energy());
        maxima.back() = std::max(maxima.back(), rod.energy());
        highest = std::max(highest, rod.energy());
        kinetic = std::max(kinetic, rod.output().kinetic_energy);
    }
    for (std::size_t k = 2; k < maxima.size(); ++k)
        rise = std::max(rise, (maxima[k] - maxima[k - 1]) / kinetic);
    const double above = (highest - start) / kinetic, left = 1 - (start - rod.energy()) / kinetic;
    const double ratio = -std::log(std::max(left, 1e-300)) / (4 * pi * periods);
    const std::string label = setting("PL2/EI", load / unit);
    return {
        absolute_row("energy", o, uniform, "energy_above_start", above, 0, std::max(0.0, above), 1e-6, label),
        absolute_row("energy", o, uniform, "rise_of_maxima", rise, 0, std::max(0.0, rise), 1e-9, label),
        plain_row("energy", o, uniform, "damping_ratio", ratio, label)};
}

} // namespace calot::bench
