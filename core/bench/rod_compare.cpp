#include "bench/rod_compare.hpp"

#include "bench/block_solve.hpp"
#include "bench/cpu_clock.hpp"
#include "bench/floors.hpp"
#include "bench/rod_problems.hpp"
#include "host/error.hpp"
#include "plot/chart.hpp"
#include "plot/whole_file.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>

namespace calot::bench {

namespace {

volatile double keep; // what is timed must not be optimised away

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

double median(std::vector<double> values) {
    if (values.empty()) return std::nan("");
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

UniformRod bench_rod(const RodOptions& o) {
    UniformRod rod;
    rod.length = 1, rod.radius = 6e-3, rod.mass_per_length = 0.15;
    rod.bending = 0.15 * 9.81 / 5, rod.torsion = rod.bending * 2 / 3;
    return UniformRod::of(o, rod);
}

// Of a simulated millisecond, and of it in block solves.
struct Cost {
    double microseconds = std::nan(""), solves = std::nan("");
    double contacts = 0; // that carry a force
};

// Steps and block solves take turns, so that what else the machine does falls on both.
Cost measure(BenchRod& rod, double patience,
             const std::function<std::span<const calot_contact>()>& contacts) {
    constexpr int most = 400, warm = 20;
    std::vector<double> times, solves, counts;
    const auto begin = Clock::now();
    for (int k = 0; k < most + warm; ++k) {
        const auto list = contacts();
        double start = cpu_seconds();
        rod.step(list);
        const double step = cpu_seconds() - start;
        start = cpu_seconds();
        keep = block_solve();
        const double solve = cpu_seconds() - start;
        if (k < warm && since(begin) < 0.5 * patience) continue;
        times.push_back(1e6 * step * 1e-3 / rod.rod().dt), solves.push_back(1e6 * solve);
        double count = 0;
        for (std::size_t i = 0; i < list.size(); ++i)
            count += norm(rod.impulse(i)) > 0 ? 1 : 0;
        counts.push_back(count);
        if (since(begin) > patience) break;
    }
    Cost cost;
    cost.microseconds = median(times), cost.solves = cost.microseconds / median(solves),
    cost.contacts = median(counts);
    return cost;
}

BenchRod::Setup straight(const UniformRod& rod) {
    BenchRod::Setup s;
    s.rod = rod;
    s.position = straight_line(rod, {}, along_x);
    s.frame = same_frames(rod, along_x);
    return s;
}

Cost free_cost(const MakeInstance& make, const UniformRod& uniform, double patience) {
    BenchRod rod(make, straight(uniform));
    rod.clamp_base({}, along_x);
    rod.input.gravity[1] = 9.81;
    return measure(rod, patience, [] { return std::span<const calot_contact>(); });
}

// Lying on twenty points of a floor by its weight, drawn along at 1 cm/s and turned: all of them slip.
Cost contact_cost(const MakeInstance& make, const UniformRod& uniform, double friction, double patience) {
    BenchRod::Setup s = straight(uniform);
    s.max_contacts = 20;
    s.drag = 5;
    BenchRod rod(make, std::move(s));
    rod.input.gravity[1] = 9.81;
    std::vector<calot_contact> list;
    return measure(rod, patience, [&] {
        const double t = rod.seconds() + uniform.dt;
        rod.clamp_base({0.01 * t, 0, 0}, axis_angle({1, 0, 0}, t) * along_x);
        list.clear();
        for (int k = 1; k <= 20; ++k) {
            const int i = std::max(1, k * (uniform.nodes - 1) / 20);
            const Vec3 p = rod.position(i);
            list.push_back(node_contact(rod, i, static_cast<std::uint64_t>(k), {p.x, uniform.radius, p.z},
                                        {0, -1, 0}, -p.y, friction));
        }
        return std::span<const calot_contact>(list);
    });
}

// The base driven by a fifth of the length towards the held tip within a second, then held for a fifth of
// one; its weight bends it aside.
double stretch_of(const MakeInstance& make, const UniformRod& uniform) {
    BenchRod::Setup s = straight(uniform);
    s.drag = 5;
    BenchRod rod(make, std::move(s));
    rod.input.gravity[1] = 9.81;
    rod.clamp_tip({uniform.length, 0, 0}, along_x);
    while (rod.seconds() < 1.2) {
        rod.clamp_base({0.2 * uniform.length * std::min(1.0, rod.seconds() + uniform.dt), 0, 0}, along_x);
        rod.step();
    }
    return std::abs(rod.arc_length() / uniform.length - 1);
}

// Let go from a small bend without weight or drag. The first period is left out: higher modes die in it.
double damping_ratio_of(const MakeInstance& make, const UniformRod& uniform) {
    const double w = uniform.lowest_frequency(), period = 2 * std::numbers::pi / w;
    BenchRod::Setup s = straight(uniform);
    s.drag = 2 * w;
    BenchRod rod(make, std::move(s));
    rod.clamp_base({}, along_x);
    rod.load_tip({0, 0.05 * uniform.bending / (uniform.length * uniform.length), 0}, {});
    rod.settle(1e-9 * uniform.length * w, 30 / w);
    rod.set_drag(0);
    rod.input.tip.mode = CALOT_END_FREE;
    constexpr int periods = 3;
    const auto go_on = [&](double seconds) {
        for (const double end = rod.seconds() + seconds; rod.seconds() < end;)
            rod.step();
        return rod.energy();
    };
    const double first = go_on(period), last = go_on(periods * period);
    return std::log(first / last) / (4 * std::numbers::pi * periods);
}

// Swings under its weight for 0.3 s by steps of 10 ms: stays whole, and near where steps of 1 ms bring it.
bool is_stable_at_ten_ms(const MakeInstance& make, UniformRod uniform) {
    const auto swing = [&](double dt) {
        uniform.dt = dt;
        BenchRod rod(make, straight(uniform));
        rod.clamp_base({}, along_x);
        rod.input.gravity[1] = 9.81;
        while (rod.seconds() < 0.3 - 0.5 * dt)
            rod.step();
        return rod.position(uniform.nodes - 1);
    };
    return norm(swing(1e-2) - swing(1e-3)) < 0.05 * uniform.length;
}

struct Peer {
    std::string name;
    int links = 0;
    double step = 0, microseconds = 0;
};

// Peers are programs beside this one: nothing of theirs is in this process. Nothing if it is not there or
// fails.
std::optional<Peer> run_peer(const char* program, std::ostream& progress) {
    std::error_code none;
    const auto file = std::filesystem::read_symlink("/proc/self/exe", none).parent_path() / program;
    if (!std::filesystem::exists(file, none)) return std::nullopt;
    progress << program << '\n';
    const std::string command = "'" + file.string() + "' 100";
    std::FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return std::nullopt;
    char name[32] = "";
    Peer peer;
    const int count =
        std::fscanf(pipe, "%31[^,],%d,%lf,%lf", name, &peer.links, &peer.step, &peer.microseconds);
    const int status = pclose(pipe);
    peer.name = name;
    if (count != 4 || status != 0) return std::nullopt;
    return peer;
}

double error_of(const std::vector<Row>& rows, const char* quantity) {
    for (const Row& r : rows)
        if (r.quantity == quantity) return r.error;
    return std::nan("");
}
std::string last_word(const std::string& id) {
    return id.substr(id.rfind('.') + 1);
}

void draw_chart(const std::vector<Row>& rows, const std::filesystem::path& folder) {
    std::map<std::string, std::map<int, std::map<std::string, double>>> of;
    int fewest = 1'000'000, most = 0;
    for (const Row& r : rows) {
        of[r.model][r.nodes][r.quantity] = r.measured;
        if (r.quantity == "us_free") fewest = std::min(fewest, r.nodes), most = std::max(most, r.nodes);
    }
    const std::string range = (fewest < most ? std::to_string(fewest) + " to " : "") + std::to_string(most);
    std::vector<plot::Panel> panels;
    for (const char* problem : {"elastica", "heavy"}) {
        plot::Panel panel;
        panel.title = std::string(problem) + ": what accuracy costs, " + range + " nodes";
        panel.x_label = "us for a simulated ms", panel.y_label = "relative error";
        panel.is_log_x = panel.is_log_y = true;
        for (const auto& [model, by_nodes] : of) {
            plot::Series s{.label = last_word(model), .mark = plot::Mark::line_and_points};
            for (const auto& [nodes, values] : by_nodes) {
                const auto x = values.find("us_free"), y = values.find(std::string(problem) + "_error");
                if (x != values.end() && y != values.end())
                    s.x.push_back(x->second), s.y.push_back(y->second);
            }
            if (!s.x.empty()) panel.series.push_back(std::move(s));
        }
        panels.push_back(std::move(panel));
    }
    plot::draw(panels, folder / "compare.png");
    plot::draw(panels, folder / "compare.svg");
}

} // namespace

std::vector<Row> compare_rods(const std::vector<VesselModel>& models, const RodOptions& o,
                              const CompareOptions& compare, std::ostream& progress) {
    std::vector<Row> rows;
    std::map<std::string, std::map<int, double>> cost_of;
    for (const VesselModel& m : models)
        for (const int nodes : compare.nodes) {
            RodOptions of = o;
            of.model = m.id, of.nodes = nodes;
            const UniformRod uniform = bench_rod(of);
            const bool is_direct = m.id == "org.calot.rod-direct",
                       is_cosserat = m.id == "org.calot.rod-cosserat";
            const bool is_reference = nodes == 100;
            progress << last_word(m.id) << ' ' << nodes << " nodes" << std::flush;
            const auto add = [&](const char* quantity, double value, double bound) {
                Row r = plain_row("compare", of, uniform, quantity, value);
                if (std::isfinite(bound)) r.error = value, r.bound = bound;
                rows.push_back(r);
            };
            const auto skip = [&](const char* quantity, const std::string& why) {
                Row r = plain_row("compare", of, uniform, quantity, std::nan(""));
                r.setting = why;
                rows.push_back(r);
            };
            const double none = std::numeric_limits<double>::infinity();
            try {
                const Cost free = free_cost(m.make, uniform, 0.25 * compare.patience);
                cost_of[m.id][nodes] = free.microseconds;
                add("us_free", free.microseconds, none);
                add("solves_free", free.solves,
                    !is_reference ? none
                    : is_direct   ? 2.5
                    : is_cosserat ? 147 / 17.5
                                  : none);
                const double step = 1e-6 * free.microseconds * uniform.dt / 1e-3;
                const Cost contacts =
                    contact_cost(m.make, uniform, o.friction.value_or(0.2), 0.25 * compare.patience);
                add("us_contacts", contacts.microseconds, none);
                add("solves_contacts", contacts.solves, is_direct && is_reference ? 5 : none);
                add("contacts", contacts.contacts, none);
                // Wall time of what follows, by the number of steps.
                const auto lasts = [&](double seconds) { return seconds / uniform.dt * step; };
                const auto unless_too_long = [&](const char* quantity, double seconds, const auto& measure) {
                    if (lasts(seconds) > compare.patience) {
                        char why[80];
                        std::snprintf(why, sizeof why, "skipped: %.0f s of processor time", lasts(seconds));
                        skip(quantity, why);
                    } else {
                        measure();
                    }
                };
                unless_too_long("stretch", 1.2, [&] {
                    add("stretch", stretch_of(m.make, uniform), is_direct ? 1e-6 : none);
                });
                const double w = uniform.lowest_frequency();
                RodOptions at = of;
                at.bending = uniform.bending, at.torsion = uniform.torsion, at.length = uniform.length;
                at.radius = uniform.radius, at.mass_per_length = uniform.mass_per_length, at.dt = uniform.dt;
                at.load = 5 * uniform.bending / (uniform.length * uniform.length);
                unless_too_long("elastica_error", 20 / w, [&] {
                    add("elastica_error", error_of(run_elastica(m.make, at), "tip_drop"), none);
                });
                unless_too_long("heavy_error", 20 / w, [&] {
                    add("heavy_error", error_of(run_heavy(m.make, at), "tip_drop"), none);
                });
                if (is_reference || compare.nodes.size() == 1) {
                    unless_too_long("damping_ratio", 60 / w, [&] {
                        add("damping_ratio", damping_ratio_of(m.make, uniform), is_direct ? 0.003 : none);
                    });
                    add("stable_at_10_ms", is_stable_at_ten_ms(m.make, uniform) ? 1 : 0, none);
                    if (is_direct)
                        rows.back().error = rows.back().measured > 0 ? 0 : 1, rows.back().bound = 0;
                }
            } catch (const host::PluginError& e) {
                skip("failed", e.function + ": " + e.message);
            }
            progress << '\n';
        }
    for (const auto& [model, by_nodes] : cost_of) {
        const auto small = by_nodes.find(100), large = by_nodes.find(1000);
        if (small == by_nodes.end() || large == by_nodes.end()) continue;
        RodOptions of = o;
        of.model = model, of.nodes = 1000;
        Row r =
            plain_row("compare", of, bench_rod(of), "cost_of_1000_over_100", large->second / small->second);
        if (model == "org.calot.rod-direct") r.error = r.measured, r.bound = 11;
        rows.push_back(r);
    }
    if (compare.has_peers)
        for (const char* program : {"calot-bench-bullet", "calot-bench-simbody"})
            if (const auto peer = run_peer(program, progress)) {
                RodOptions of = o;
                of.model = peer->name, of.nodes = peer->links + 1, of.dt = peer->step;
                rows.push_back(plain_row("compare", of, bench_rod(of), "us_free", peer->microseconds));
                rows.push_back(
                    plain_row("compare", of, bench_rod(of), "real_time_factor", 1e3 / peer->microseconds));
                rows.push_back(plain_row("compare", of, bench_rod(of), "largest_stable_step", peer->step));
            }
    // The floors, in microseconds.
    {
        std::vector<double> solve, chain, step;
        const auto time = [&](std::vector<double>& to, const auto& run) {
            const double start = cpu_seconds();
            for (int k = 0; k < 20; ++k)
                keep = run();
            to.push_back(1e6 * (cpu_seconds() - start) / 20);
        };
        for (int k = 0; k < 200; ++k) {
            time(solve, [] { return block_solve(); });
            time(chain, [] { return tridiagonal_run(99); });
            time(step, [] { return explicit_step_run(100); });
        }
        RodOptions of;
        of.model = "floor", of.nodes = 100;
        const UniformRod uniform = bench_rod(of);
        rows.push_back(plain_row("compare", of, uniform, "us_block_solve_99x6", median(solve)));
        rows.push_back(plain_row("compare", of, uniform, "us_tridiagonal_99", median(chain)));
        rows.push_back(plain_row("compare", of, uniform, "us_explicit_step_100", median(step)));
    }
    if (!compare.folder.empty()) {
        std::error_code ignored;
        std::filesystem::create_directories(compare.folder, ignored);
        draw_chart(rows, compare.folder);
        std::ostringstream csv;
        write_csv(csv, rows);
        plot::write_whole(compare.folder / "compare.csv", csv.str());
    }
    return rows;
}

void write_comparison(std::ostream& out, const std::vector<Row>& rows) {
    constexpr const char* columns[] = {"us_free",       "solves_free",    "us_contacts",    "solves_contacts",
                                       "contacts",      "stretch",        "elastica_error", "heavy_error",
                                       "damping_ratio", "stable_at_10_ms"};
    char text[200];
    std::snprintf(text, sizeof text, "%-16s%6s%10s%9s%12s%10s%10s%11s%11s%11s%10s%8s\n", "model", "nodes",
                  "us free", "solves", "us contacts", "solves", "contacts", "stretch", "elastica", "heavy",
                  "damping", "10 ms");
    out << text;
    std::vector<std::pair<std::string, int>> lines;
    std::map<std::pair<std::string, int>, std::map<std::string, const Row*>> of;
    for (const Row& r : rows) {
        const std::pair key{r.model, r.nodes};
        if (of.find(key) == of.end()) lines.push_back(key);
        of[key][r.quantity] = &r;
    }
    std::string notes;
    for (const auto& key : lines) {
        const auto& values = of[key];
        if (values.count("us_free") == 0) continue;
        std::snprintf(text, sizeof text, "%-16s%6d", last_word(key.first).c_str(), key.second);
        out << text;
        constexpr int widths[] = {10, 9, 12, 10, 10, 11, 11, 11, 10, 8};
        for (std::size_t k = 0; k < std::size(columns); ++k) {
            const auto found = values.find(columns[k]);
            if (found == values.end() || !std::isfinite(found->second->measured)) {
                std::snprintf(text, sizeof text, "%*s", widths[k], found == values.end() ? "" : "skipped");
                if (found != values.end())
                    notes += last_word(key.first) + ", " + std::to_string(key.second) + " nodes, " +
                             columns[k] + ": " + found->second->setting + "\n";
            } else {
                std::snprintf(text, sizeof text, "%*.3g", widths[k], found->second->measured);
            }
            out << text;
        }
        out << '\n';
    }
    out << "\nus: processor time of a simulated millisecond; solves: the same in 6x6 block-tridiagonal "
           "solves of 99 blocks\n";
    for (const Row& r : rows)
        if (r.model == "floor" || r.quantity == "cost_of_1000_over_100" || r.quantity == "real_time_factor" ||
            r.quantity == "largest_stable_step") {
            std::snprintf(text, sizeof text, "%s %s: %.3g\n", last_word(r.model).c_str(), r.quantity.c_str(),
                          r.measured);
            out << text;
        }
    for (const Row& r : rows)
        if (std::isfinite(r.bound)) {
            std::snprintf(text, sizeof text, "%s, %d nodes, %s: %.4g, error %.4g, bound %.4g: %s\n",
                          last_word(r.model).c_str(), r.nodes, r.quantity.c_str(), r.measured, r.error,
                          r.bound, r.met() ? "met" : "MISSED");
            out << text;
        }
    for (const Row& r : rows)
        if (r.quantity == "failed")
            notes +=
                last_word(r.model) + ", " + std::to_string(r.nodes) + " nodes failed: " + r.setting + "\n";
    out << notes;
}

} // namespace calot::bench
