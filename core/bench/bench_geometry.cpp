// calot bench geometry: what questions to surfaces cost, beside Embree's point queries in the same run.
#include "bench/bench.hpp"
#include "bench/embree_spheres.hpp"
#include "bench/geometry_scenes.hpp"
#include "bench/row.hpp"
#include "geometry/self_contacts.hpp"
#include "host/error.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <numbers>

namespace calot::bench {

namespace {

using geometry::Chain;
using geometry::Vec3;

constexpr double shaft_radius = 6.3e-3, sphere = 6e-3, margin = 2e-3, colon_margin = 1e-3; // m
constexpr std::size_t spheres = 100;

// Processor time of this thread: others on the machine count less.
double thread_seconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Task {
    std::string name, setting;
    int queries;              // spheres, capsules or triangles at one go
    double bound;             // against Embree's spheres anywhere in the box; infinite: not judged
    std::function<int()> run; // returns what it found
    int found = 0;
    double best = std::numeric_limits<double>::infinity(); // s
};

// A shaft that slides to and fro by `step` a tick, in each of which it is asked `queries` times: at as many
// places as far apart as a twentieth of the step, as solvers that ask again within a tick do.
class Sliding {
  public:
    Sliding(const FoldedTube& tube, std::size_t nodes, double step, int queries = 1)
        : tube_(tube), step_(step), queries_(queries), radii_(nodes - 1, shaft_radius), contacts_(nodes) {}
    int next(const geometry::TriangleScene& scene, double reach) {
        if (places_.empty())
            for (int i = 0; i < (step_ > 0 ? 80 : 1); ++i)
                places_.push_back(tube_.shaft_on_wall(radii_.size() + 1, shaft_radius, along(i)));
        const auto chain = Chain::of_block(places_[at_], radii_);
        if (at_ + 1 >= places_.size()) back_ = true;
        if (at_ == 0) back_ = false;
        if (places_.size() > 1) at_ = back_ ? at_ - 1 : at_ + 1;
        return static_cast<int>(contacts_.find(scene, chain, reach).size());
    }

  private:
    double along(int place) const {
        const int whole = place / queries_;
        return step_ * (whole + 0.05 * (place % queries_));
    }

    const FoldedTube& tube_;
    double step_;
    int queries_;
    std::vector<std::vector<double>> places_; // made when first asked for
    std::vector<double> radii_;
    geometry::ChainContacts contacts_;
    std::size_t at_ = 0;
    bool back_ = false;
};

std::vector<Vec3> centres_on(const std::vector<double>& block) {
    std::vector<Vec3> centres;
    for (std::size_t i = 0; i < spheres; ++i)
        centres.push_back({block[i], block[spheres + i], block[2 * spheres + i]});
    return centres;
}

// Everywhere in the stomach's box, without a random number: fractions of the golden ratio's kin.
std::vector<Vec3> centres_anywhere() {
    std::vector<Vec3> centres;
    for (std::size_t i = 0; i < spheres; ++i) {
        const auto part = [&](double step) {
            return 2 * std::fmod(0.5 + step * static_cast<double>(i), 1) - 1;
        };
        centres.push_back(
            {0.064 * part(0.8191725134), 0.064 * part(0.6710436067), 0.124 * part(0.5497004779)});
    }
    return centres;
}

std::vector<double> wound(double pitch) {
    std::vector<double> block(303);
    for (std::size_t i = 0; i < 101; ++i) {
        const double angle = static_cast<double>(i) * 0.01 / 0.03;
        block[i] = 0.03 * std::cos(angle);
        block[101 + i] = 0.03 * std::sin(angle);
        block[202 + i] = pitch * angle / (2 * std::numbers::pi);
    }
    return block;
}

// Everything that the tasks work on, alive while they run.
struct Bench {
    FoldedTube stomach_tube{FoldedTube::Kind::stomach}, colon_tube{FoldedTube::Kind::colon};
    Surface stomach_wall = stomach_tube.wall(70, 71), colon_wall = colon_tube.wall(260, 36);
    geometry::TriangleScene stomach = stomach_wall.scene(), colon = colon_wall.scene();
    std::unique_ptr<EmbreeSpheres> embree = EmbreeSpheres::make(stomach_wall);
    std::vector<Vec3> on_wall = centres_on(stomach_tube.shaft_on_wall(spheres, shaft_radius, 0)),
                      anywhere = centres_anywhere();
    Sliding at_rest{stomach_tube, 101, 0}, slow{stomach_tube, 101, 3e-5}, fast{stomach_tube, 101, 3e-4},
        faster{stomach_tube, 101, 1e-3}, fastest{stomach_tube, 101, 3e-3}, again{stomach_tube, 101, 3e-4, 4};
    Sliding in_colon{colon_tube, 150, 1e-4};
    // Tissue: small steps between two shapes, as a tissue model's every third tick.
    Surface soft_wall[2] = {stomach_tube.wall(27, 28), stomach_tube.wall(27, 28, 1e-4)};
    geometry::TriangleScene soft = soft_wall[0].scene(), refitted = soft_wall[0].scene();
    Sliding on_soft{stomach_tube, 101, 3e-5};
    geometry::SelfContacts self{101}, self_straight{101};
    std::vector<double> coil = wound(2 * shaft_radius), radii = std::vector<double>(100, shaft_radius);
    std::vector<double> straight = std::vector<double>(303, 0.0);
    int soft_tick = 0;
    std::size_t refit = 0;

    Bench() {
        for (std::size_t i = 0; i < 101; ++i)
            straight[i] = 0.01 * static_cast<double>(i);
    }
    int nearest(const std::vector<Vec3>& centres) const {
        int found = 0;
        for (const Vec3& p : centres)
            found += static_cast<bool>(nearest_point(stomach, p, sphere));
        return found;
    }
    std::vector<Task> tasks();
};

std::vector<Task> Bench::tasks() {
    // 100 spheres of 6 mm against 20,000 triangles took Embree 19.6 us where the others' bounds come from.
    constexpr double embree_us = 19.6, unjudged = std::numeric_limits<double>::infinity();
    std::vector<Task> tasks;
    const auto add = [&](const char* name, std::string setting, int queries, double bound_us, auto run) {
        tasks.push_back({name, std::move(setting), queries, bound_us / embree_us, std::function<int()>(run)});
    };
    if (embree) {
        add("spheres-embree", "anywhere", spheres, unjudged,
            [this] { return static_cast<int>(1e6 * embree->distances(anywhere, sphere)); });
        add("spheres-embree", "touching", spheres, unjudged,
            [this] { return static_cast<int>(1e6 * embree->distances(on_wall, sphere)); });
    }
    add("spheres", "anywhere", spheres, 20, [this] { return nearest(anywhere); });
    add("spheres", "touching", spheres, 20, [this] { return nearest(on_wall); });
    add("capsules", "at rest", 100, 40, [this] { return at_rest.next(stomach, margin); });
    add("capsules", "30 um a tick", 100, 40, [this] { return slow.next(stomach, margin); });
    add("capsules", "300 um a tick", 100, 40, [this] { return fast.next(stomach, margin); });
    add("capsules", "1 mm a tick", 100, unjudged, [this] { return faster.next(stomach, margin); });
    add("capsules", "3 mm a tick", 100, unjudged, [this] { return fastest.next(stomach, margin); });
    add("capsules", "4 times in each of 300 um", 100, 40, [this] { return again.next(stomach, margin); });
    add("capsules-colon", "100 um a tick", 149, 250, [this] { return in_colon.next(colon, colon_margin); });
    add("refit", "3,000 triangles", static_cast<int>(refitted.triangles().size()), 15, [this] {
        refitted.move_vertices(soft_wall[++refit % 2].vertices);
        return 1;
    });
    add("capsules-moving", "wall moves every 3rd tick", 100, unjudged, [this] {
        if (++soft_tick % 3 == 0) soft.move_vertices(soft_wall[soft_tick / 3 % 2].vertices);
        return on_soft.next(soft, margin);
    });
    add("self", "wound into touching turns", 100, unjudged,
        [this] { return static_cast<int>(self.find(Chain::of_block(coil, radii), margin).size()); });
    add("inside", "on the wall", spheres, unjudged, [this] {
        int found = 0;
        for (const Vec3& p : on_wall)
            found += organ_containing(stomach, p) != geometry::TriangleScene::none;
        return found;
    });
    add("self", "straight", 100, unjudged, [this] {
        return static_cast<int>(self_straight.find(Chain::of_block(straight, radii), margin).size());
    });
    return tasks;
}

// Rounds over all tasks, so that what disturbs one disturbs the others; of each the quickest counts.
void time_all(std::vector<Task>& tasks, int rounds) {
    constexpr int repeats = 30; // of which three are a tissue's step
    for (Task& task : tasks)
        task.run(); // not timed: makes what it needs
    for (int round = 0; round < rounds; ++round)
        for (Task& task : tasks) {
            const double start = thread_seconds();
            for (int i = 0; i < repeats; ++i)
                task.found = task.run();
            task.best = std::min(task.best, (thread_seconds() - start) / repeats);
        }
}

} // namespace

int run_geometry(const std::vector<std::string>& arguments, std::ostream& out, std::ostream& errors) {
    CLI::App app("What questions to surfaces cost, and their ratio to Embree's in the same run",
                 "calot bench geometry");
    int rounds = 200;
    bool as_csv = false;
    std::string only, setting;
    app.add_option("task", only,
                   "Only this: spheres, capsules, capsules-colon, refit, capsules-moving, inside, self");
    app.add_option("--setting", setting, "Only settings that contain this, as \"300 um\"");
    app.add_option("--rounds", rounds, "Of thirty calls each; the quickest counts")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    app.add_flag("--csv", as_csv, "Comma-separated instead of a table");
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend())); // as CLI11 takes them
        Bench bench;
        std::vector<Task> tasks = bench.tasks();
        const auto is_named = [&](const Task& t) { return only.empty() || t.name == only; };
        const auto is_wanted = [&](const Task& t) {
            return is_named(t) && t.setting.find(setting) != std::string::npos;
        };
        if (std::none_of(tasks.begin(), tasks.end(), is_named))
            throw host::UserError("", "task", "\"" + only + "\" is none; --help lists them");
        if (std::none_of(tasks.begin(), tasks.end(), is_wanted))
            throw host::UserError("", "--setting", "no task has one with \"" + setting + "\" in it");
        std::erase_if(tasks, [&](const Task& t) { return !is_wanted(t) && t.name != "spheres-embree"; });
        time_all(tasks, rounds);

        std::vector<Row> rows;
        const bool has_peer = tasks.front().name == "spheres-embree";
        for (const Task& task : tasks) {
            Row row;
            row.problem = task.name;
            row.model = task.name == "spheres-embree" ? "embree" : "calot";
            row.nodes = task.queries;
            row.quantity = "us";
            row.setting = task.setting + ", " + std::to_string(task.found) + " found";
            if (row.model == "embree") row.setting = task.setting;
            row.measured = 1e6 * task.best;
            if (has_peer) {
                // Spheres beside Embree's on the same centres, everything else beside those anywhere.
                const bool on_wall = task.name.starts_with("spheres") && task.setting == "touching";
                row.reference = 1e6 * tasks[on_wall ? 1 : 0].best;
                row.error = row.measured / row.reference;
                row.bound = task.bound;
            }
            rows.push_back(row);
        }
        if (as_csv) {
            write_csv(out, rows);
        } else {
            write_table(out, rows);
            out << "microseconds of processor time, quickest of " << rounds
                << " rounds; reference: Embree's 100 spheres in this run; error and bound: the ratio to it\n";
        }
        return std::all_of(rows.begin(), rows.end(), [](const Row& r) { return r.met(); }) ? 0 : 1;
    } catch (const CLI::ParseError& e) {
        return app.exit(e, out, errors) == 0 ? 0 : 2;
    } catch (const host::UserError& e) {
        errors << "calot: " << e.what() << '\n';
        return 2;
    }
}

} // namespace calot::bench
