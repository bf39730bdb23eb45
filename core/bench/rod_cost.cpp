#include "bench/rod_cost.hpp"

#include "bench/block_solve.hpp"
#include "bench/lumen.hpp"
#include "bench/rod_problems.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <numbers>

namespace calot::bench {

namespace {

double median(std::vector<double>& values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Medians of microseconds per simulated millisecond, of the whole and of the parts.
struct Cost {
    std::map<std::string, double> parts;
    double contacts = 0;
};

Cost measure(BenchRod& rod, Lumen* lumen, int steps) {
    const calot_cost* cost = rod.cost();
    void* self = rod.instance().abi()->self;
    std::map<std::string, std::vector<double>> times;
    const double scale = 1e6 * 1e-3 / rod.rod().dt;
    std::vector<double> counts;
    // The whole is measured with the parts' clocks off: reading them costs.
    for (const bool parts : {false, true}) {
        if (parts && cost == nullptr) break;
        if (cost != nullptr) cost->enable(self, parts ? 1 : 0);
        for (int k = 0; k < steps; ++k) {
            std::span<const calot_contact> contacts;
            if (lumen != nullptr) contacts = lumen->contacts(rod);
            const auto start = std::chrono::steady_clock::now();
            rod.step(contacts);
            const double whole =
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            rod.input.base.rotation.target += rod.input.base.rotation.velocity * rod.rod().dt;
            counts.push_back(static_cast<double>(contacts.size()));
            if (!parts) {
                times["block-solve"].push_back(block_solve_microseconds());
                times["rod"].push_back(scale * whole);
                continue;
            }
            for (std::uint32_t i = 0; i < cost->part_count(self); ++i) {
                calot_string name{};
                double seconds = 0;
                cost->part(self, i, &name, &seconds);
                times[host::text(name)].push_back(scale * seconds);
            }
        }
    }
    Cost out;
    for (auto& [name, values] : times)
        out.parts[name] = median(values);
    out.contacts = median(counts);
    return out;
}

} // namespace

std::vector<Row> rod_costs(const MakeInstance& make, const RodOptions& o, double budget) {
    UniformRod uniform;
    uniform.length = 1.03; // working length of a gastroscope (GIF-2T160)
    uniform = UniformRod::of(o, uniform);
    constexpr int steps = 2000;
    std::vector<Row> rows;
    for (const bool in_tube : {false, true}) {
        BenchRod::Setup s;
        s.rod = uniform;
        s.drag = 5;
        s.bending_damping = 2e-5;
        s.max_contacts = static_cast<std::uint32_t>(uniform.nodes + 1);
        s.frame = same_frames(uniform, along_x);
        const double inside = 0.45 * uniform.length;
        s.position = straight_line(uniform, {in_tube ? inside - uniform.length : 0, 0, 0}, along_x);
        if (in_tube) {
            calot_guide guide{};
            guide.present = 1;
            guide.direction[0] = 1;
            s.guide = guide;
        }
        BenchRod rod(make, std::move(s));
        rod.input.gravity[1] = 9.81;
        Lumen lumen(Lumen::bend(0.6 * uniform.length, 0.1, std::numbers::pi / 2, 0.3), 0.01, false,
                    o.friction.value_or(0.1));
        if (in_tube) {
            rod.input.base.mode = CALOT_END_COUPLED;
            rod.input.base.insertion = {inside - uniform.length, 0, 5000, 50, 50};
            rod.input.base.rotation = {0, 1, 10, 0.1, 1};
        } else {
            rod.clamp_base({}, along_x);
        }
        Cost cost = measure(rod, in_tube ? &lumen : nullptr, steps);
        const std::string label = in_tube ? setting("contacts", cost.contacts) : "free";
        for (const auto& [name, value] : cost.parts) {
            const std::string problem = in_tube ? name : name + "-free";
            const bool is_yardstick = name == "block-solve";
            Row row = plain_row(problem.c_str(), o, uniform, is_yardstick ? "us" : "us_per_simulated_ms",
                                value, is_yardstick ? "99 blocks of 6x6" : label);
            row.error = value;
            if (name == "rod" && budget > 0) row.bound = budget;
            rows.push_back(row);
        }
    }
    return rows;
}

} // namespace calot::bench
