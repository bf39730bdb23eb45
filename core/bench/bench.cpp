#include "bench/bench.hpp"

#include "bench/rod_compare.hpp"
#include "bench/rod_cost.hpp"
#include "bench/rod_problems.hpp"
#include "bench/rod_vessel.hpp"
#include "bench/watch.hpp"
#include "host/plugins.hpp"
#include "plot/chart.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <sstream>

namespace calot::bench {

namespace {

constexpr const char* usual_model = "org.calot.rod-cosserat";
// Of push-soak, among all problems, for a model that is not real-time: s simulated, s that it may take.
constexpr double brief_soak = 2, brief_soak_patience = 60;

std::string problem_list() {
    std::string text;
    for (const RodProblem& p : rod_problems())
        text += (text.empty() ? "" : ", ") + std::string(p.id);
    return text;
}

// Broken into lines of at most `width`, each with `indent` blanks before it.
std::string wrapped(std::string_view text, std::size_t indent, std::size_t width) {
    std::string out, line;
    std::istringstream words{std::string(text)};
    for (std::string word; words >> word;) {
        if (!line.empty() && indent + line.size() + 1 + word.size() > width) {
            out += std::string(indent, ' ') + line + '\n';
            line.clear();
        }
        line += (line.empty() ? "" : " ") + word;
    }
    return out + std::string(indent, ' ') + line + '\n';
}

// Names of the numbers that are given and mean nothing in this problem.
std::string meaningless(const RodProblem& problem, const RodOptions& o, bool is_seed_given,
                        bool is_picture_given) {
    std::string names;
    const auto look = [&](bool is_given, bool is_taken, const char* name) {
        if (is_given && !is_taken) names += (names.empty() ? "--" : ", --") + std::string(name);
    };
    look(o.load.has_value(), problem.takes.load, "load");
    look(o.friction.has_value(), problem.takes.friction, "friction");
    look(o.angle.has_value(), problem.takes.angle, "angle");
    look(is_seed_given, problem.takes.seed, "seed");
    look(o.duration.has_value(), problem.takes.duration, "duration");
    look(!o.endoscope.empty(), problem.takes.duration, "endoscope");
    look(is_picture_given, false, "out");
    return names;
}

std::string explained() {
    std::string text = "Problems (all: every one of them; no problem: what a step costs)\n";
    for (const RodProblem& p : rod_problems()) {
        text += "  " + std::string(p.id) + ": " + std::string(p.what) + "\n" + wrapped(p.explanation, 6, 100);
        std::string also;
        for (const auto& [is_taken, name] : {std::pair{p.takes.load, "--load"},
                                             {p.takes.friction, "--friction"},
                                             {p.takes.angle, "--angle"},
                                             {p.takes.seed, "--seed"}})
            if (is_taken) also += std::string(also.empty() ? "" : " ") + name;
        text += "      takes " + (also.empty() ? "no other numbers than the rod's" : also) + "\n";
        text += "      calot bench rod " + std::string(p.example) + "\n";
    }
    return text +
           "\nvessel: the compression test of Korzeniowski et al. (2016), figure 6: every model of --models "
           "into one "
           "random\nvessel, compression and cost side by side, drawn to --out FILE.png\n      takes --load "
           "--friction "
           "--seed\n      calot bench rod vessel --out vessel.png\n--compare: cost and accuracy of all "
           "models beside each "
           "other, drawn to --out FOLDER\n      calot bench rod --compare --out comparison\n"
           "\nEvery problem takes the rod's numbers: --nodes --dt --EI --GJ --length --radius "
           "--mass-per-length. A "
           "number that a\nproblem has no use for is ignored, and said so. Without --mass-per-length or "
           "--dt, a "
           "problem chooses what lets the rod\ncome to rest soon. Exit code: 0 all claims are met, 1 one is "
           "missed, 2 bad input, 3 the plugin failed.";
}

// A finite number between two bounds; text that is no number is refused by CLI11.
CLI::Validator between(double low, double high) {
    return CLI::Validator(
        [low, high](std::string& text) {
            char* end = nullptr;
            const double v = std::strtod(text.c_str(), &end);
            if (end != text.c_str() && *end == '\0' && v >= low && v <= high) return std::string();
            std::ostringstream message;
            message << "is " << text << ", must be a number from " << low << " to " << high;
            return message.str();
        },
        "NUMBER");
}

template<class T>
void number(CLI::App& app, const char* name, std::optional<T>& to, const char* what, double low,
            double high) {
    app.add_option(name, to, what)->check(between(low, high));
}

bool claims(const host::Found& found, std::string_view problem) {
    const auto& all = found.model->claims;
    return std::find(all.begin(), all.end(), problem) != all.end();
}

// What is left of a problem that the model could not go through with.
Row failed_row(const RodProblem& problem, const RodOptions& o) {
    Row r;
    r.problem = problem.id, r.model = o.model, r.nodes = o.nodes.value_or(0), r.dt = o.dt.value_or(0);
    r.quantity = "completed";
    r.measured = 0, r.reference = 1, r.error = std::numeric_limits<double>::infinity(), r.bound = 0;
    return r;
}

void say(std::ostream& errors, const host::PluginError& e) {
    errors << "calot: " << e.plugin << ": " << e.function << ": " << e.field << ": " << e.message << '\n';
}

} // namespace

int run_rod(host::Plugins& plugins, const std::vector<std::string>& arguments, std::ostream& out,
            std::ostream& errors) {
    CLI::App app("Reference problems and costs of rod models", "calot bench rod");
    app.footer(explained());
    std::string problem;
    RodOptions o;
    bool as_csv = false;
    app.add_option("problem", problem, "One of those below, or all; none: costs");
    app.add_option("--model", o.model,
                   "Id of the rod model, as calot list rod has it; without: " + std::string(usual_model) +
                       ", with problem all every one found");
    number(app, "--nodes", o.nodes, "Number of nodes", 5, 5000);
    number(app, "--dt", o.dt, "Length of a tick, s; a model may divide it", 1e-6, 1e-2);
    number(app, "--EI", o.bending, "Bending stiffness, N m2", 1e-9, 1e6);
    number(app, "--GJ", o.torsion, "Torsional stiffness, N m2", 1e-9, 1e6);
    number(app, "--length", o.length, "From the clamped to the loaded cross-section, m", 1e-3, 100);
    number(app, "--radius", o.radius, "m", 1e-5, 1);
    number(app, "--mass-per-length", o.mass_per_length, "kg/m", 1e-6, 1e3);
    number(app, "--load", o.load, "N for forces, N m for moments and torques", 1e-9, 1e6);
    number(app, "--friction", o.friction, "Coulomb coefficient", 0, 10);
    number(app, "--angle", o.angle, "rad", 1e-3, 30);
    CLI::Option* seed = app.add_option("--seed", o.seed, "Of what is random in a problem");
    number(app, "--duration", o.duration, "Of push-soak, s", 0.1, 36'000);
    app.add_option("--anatomy", o.anatomy, "Of push-soak: reference or colon")->capture_default_str();
    app.add_option("--endoscope", o.endoscope, "Of push-soak: a datasheet, its file or name");
    bool compares = false;
    CompareOptions comparison;
    std::vector<std::string> model_ids;
    std::string picture;
    app.add_flag("--compare", compares, "All models beside each other; --nodes: only that number");
    app.add_option("--models", model_ids, "Of vessel and --compare: ids; all rod models unless given")
        ->delimiter(',');
    app.add_option("--out", picture, "Of vessel: the picture, .png or .svg; of --compare: a folder");
    app.add_flag("!--no-peers", comparison.has_peers, "--compare leaves out the chains of other engines");
    app.add_option("--patience", comparison.patience,
                   "Of --compare: s for one number; what would take longer is skipped")
        ->check(between(0.1, 3600))
        ->capture_default_str();
    app.add_flag("--csv", as_csv, "Comma-separated instead of a table");
    try {
        std::vector<std::string> reversed(arguments.rbegin(), arguments.rend()); // as CLI11 takes them
        app.parse(reversed);
        const bool is_vessel = problem == "vessel";
        if (is_vessel || compares) {
            if (compares && !problem.empty())
                throw host::UserError("", "--compare",
                                      "compares models on problems of its own: leave " + problem + " out");
            if (!o.model.empty()) model_ids.push_back(o.model);
            std::vector<VesselModel> wanted;
            const auto add = [&](const std::string& id) {
                wanted.push_back({id, [&plugins, id] { return plugins.make(host::Kind::rod, id); }});
            };
            for (const std::string& id : model_ids)
                add(plugins.find(host::Kind::rod, id).model->id);
            if (model_ids.empty())
                for (const host::Found& found : plugins.models(host::Kind::rod))
                    add(found.model->id);
            if (is_vessel) {
                if (!picture.empty()) plot::require_picture_name(picture, "--out");
                const auto rows = [&] {
                    const Watch watch(errors, "vessel");
                    return run_vessel(wanted, o, picture);
                }();
                as_csv ? write_csv(out, rows) : write_table(out, rows);
                return 0;
            }
            if (o.nodes) comparison.nodes = {*o.nodes};
            comparison.folder = picture;
            const auto rows = compare_rods(wanted, o, comparison, errors);
            as_csv ? write_csv(out, rows) : write_comparison(out, rows);
            return std::all_of(rows.begin(), rows.end(), [](const Row& r) { return r.met(); }) ? 0 : 1;
        }
        const bool is_all = problem == "all";
        std::vector<const RodProblem*> wanted;
        for (const RodProblem& p : rod_problems())
            if (is_all || p.id == problem) wanted.push_back(&p);
        if (!problem.empty() && wanted.empty())
            throw host::UserError("", "problem",
                                  "no rod problem is called \"" + problem + "\"; there are all, " +
                                      problem_list());
        std::vector<host::Found> models;
        if (is_all && o.model.empty()) {
            models = plugins.models(host::Kind::rod);
            if (models.empty())
                throw host::UserError("", "--model", "no rod model is there: see calot list rod");
        } else {
            models.push_back(plugins.find(host::Kind::rod, o.model.empty() ? usual_model : o.model));
        }

        RowPrinter printer(out, as_csv);
        bool has_failed = false;
        std::size_t done = 0;
        for (const host::Found& found : models) {
            o.model = found.model->id;
            const MakeInstance make = [&] { return plugins.make(host::Kind::rod, o.model); };
            if (wanted.empty()) printer.print(rod_costs(make, o, found.model->budget_microseconds));
            for (const RodProblem* p : wanted) {
                const std::string ignored = meaningless(*p, o, seed->count() > 0, !picture.empty());
                if (!is_all && !ignored.empty())
                    errors << "calot: " << p->id << " has no use for " << ignored << '\n';
                if (is_all)
                    errors << '[' << ++done << '/' << models.size() * wanted.size() << "] " << o.model << ' '
                           << p->id << ' ' << std::flush;
                RodOptions of = o;
                // Minutes for a model that is not real-time; by name, as long as one likes.
                if (is_all && p->run == &run_push_soak && !found.model->is_realtime) {
                    of.duration = std::min(o.duration.value_or(10), brief_soak);
                    of.patience = brief_soak_patience;
                }
                const auto start = std::chrono::steady_clock::now();
                std::vector<Row> more;
                try {
                    const Watch watch(errors, o.model + ' ' + std::string(p->id));
                    more = p->run(make, of);
                } catch (const host::PluginError& e) {
                    if (!is_all) throw;
                    errors << "failed\n";
                    say(errors, e);
                    more = {failed_row(*p, o)};
                }
                for (Row& r : more) {
                    r.is_claimed = claims(found, p->id);
                    has_failed = has_failed || r.fails();
                    if (!r.remark.empty()) errors << "calot: " << p->id << ": " << r.remark << '\n';
                }
                if (is_all)
                    errors << std::round(
                                  10 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start)
                                           .count()) /
                                  10
                           << " s" << std::endl;
                printer.print(more);
            }
        }
        return has_failed ? 1 : 0;
    } catch (const CLI::ParseError& e) {
        return app.exit(e, out, errors) == 0 ? 0 : 2;
    } catch (const host::UserError& e) {
        errors << "calot: " << e.what() << '\n';
        return 2;
    } catch (const host::PluginError& e) {
        say(errors, e);
        return 3;
    }
}

} // namespace calot::bench
