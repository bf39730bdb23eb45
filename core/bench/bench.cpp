#include "bench/bench.hpp"

#include "bench/rod_cost.hpp"
#include "bench/rod_problems.hpp"
#include "host/plugins.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>

namespace calot::bench {

namespace {

std::string problem_list() {
    std::string text;
    for (const RodProblem& p : rod_problems())
        text += (text.empty() ? "" : ", ") + std::string(p.id);
    return text;
}

template<class T>
void number(CLI::App& app, const char* name, std::optional<T>& to, const char* what, double low,
            double high) {
    app.add_option(name, to, what)->check(CLI::Range(low, high));
}

} // namespace

int run_rod(host::Plugins& plugins, const std::vector<std::string>& arguments, std::ostream& out,
            std::ostream& errors) {
    CLI::App app("Reference problems and costs of rod models", "calot bench rod");
    std::string problem;
    RodOptions o;
    o.model = "org.calot.rod-cosserat";
    bool as_csv = false;
    app.add_option("problem", problem, "One of " + problem_list() + "; none: costs");
    app.add_option("--model", o.model, "Id of the rod model")->capture_default_str();
    number(app, "--nodes", o.nodes, "Number of nodes", 5, 5000);
    number(app, "--dt", o.dt, "Length of a step, s", 1e-6, 1e-2);
    number(app, "--EI", o.bending, "Bending stiffness, N m2", 1e-9, 1e6);
    number(app, "--GJ", o.torsion, "Torsional stiffness, N m2", 1e-9, 1e6);
    number(app, "--length", o.length, "From the clamped to the loaded cross-section, m", 1e-3, 100);
    number(app, "--radius", o.radius, "m", 1e-5, 1);
    number(app, "--mass-per-length", o.mass_per_length, "kg/m", 1e-6, 1e3);
    number(app, "--load", o.load, "N for forces, N m for moments and torques", 1e-9, 1e6);
    number(app, "--friction", o.friction, "Coulomb coefficient", 0, 10);
    number(app, "--angle", o.angle, "rad", 1e-3, 30);
    app.add_option("--seed", o.seed, "Of what is random in a problem");
    app.add_flag("--csv", as_csv, "Comma-separated instead of a table");
    try {
        std::vector<std::string> reversed(arguments.rbegin(), arguments.rend()); // as CLI11 takes them
        app.parse(reversed);
        const RodProblem* found = problem.empty() ? nullptr : find_rod_problem(problem);
        if (!problem.empty() && found == nullptr)
            throw host::UserError(
                "", "problem", "no rod problem is called \"" + problem + "\"; there are " + problem_list());
        const host::Found model = plugins.find(host::Kind::rod, o.model);
        const MakeInstance make = [&] { return plugins.make(host::Kind::rod, o.model); };
        const auto rows =
            found != nullptr ? found->run(make, o) : rod_costs(make, o, model.model->budget_microseconds);
        if (as_csv)
            write_csv(out, rows);
        else
            write_table(out, rows);
        const bool is_met = std::all_of(rows.begin(), rows.end(), [](const Row& r) { return r.met(); });
        return found == nullptr || is_met ? 0 : 1;
    } catch (const CLI::ParseError& e) {
        return app.exit(e, out, errors) == 0 ? 0 : 2;
    } catch (const host::UserError& e) {
        errors << "calot: " << e.what() << '\n';
        return 2;
    } catch (const host::PluginError& e) {
        errors << "calot: " << e.plugin << ": " << e.function << ": " << e.field << ": " << e.message << '\n';
        return 3;
    }
}

} // namespace calot::bench
