// calot fit
#include "app/commands.hpp"
#include "fitting/fit_report.hpp"
#include "fitting/fitted_datasheet.hpp"
#include "plot/whole_file.hpp"
#include "simulation/assets.hpp"
#include "simulation/endoscope_datasheet.hpp"

#include <CLI/CLI.hpp>

#include <iostream>
#include <memory>

namespace calot::app {
namespace {

struct Options {
    std::string table, endoscope = "gif-2t160", out, picture;
    bool as_csv = false;
};

int fit_endoscope(const Options& o) {
    if (!o.picture.empty()) plot::require_picture_name(o.picture, "--plot");
    const auto fits = fitting::fit(fitting::read_bench_table(o.table), o.table);
    if (o.as_csv)
        fitting::write_csv(std::cout, fits);
    else
        fitting::write_report(std::cout, fits);
    if (!o.out.empty()) {
        const auto base =
            simulation::find_datasheet(simulation::find_assets() / "endoscopes", o.endoscope, "--endoscope");
        const auto sheet =
            fitting::fitted_datasheet(fits, base, std::filesystem::path(o.table).filename().string());
        plot::write_whole(o.out, sheet.text);
        for (const std::string& note : sheet.notes)
            std::cerr << "calot: " << note << '\n';
    }
    if (!o.picture.empty()) plot::draw(fitting::panels(fits), o.picture);
    return completed;
}

} // namespace

void add_fit(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("fit", "Find a datasheet's figures from measurements");
    command->require_subcommand(1);
    const auto o = std::make_shared<Options>();
    CLI::App* endoscope = command->add_subcommand(
        "endoscope", "EI, GJ and damping of an endoscope's segments from bench tests, with every residual");
    endoscope->add_option("BENCH.csv", o->table, "what was measured; its columns are below")->required();
    endoscope->add_option("--out", o->out, "write a datasheet with the fitted figures")
        ->type_name("FILE.toml");
    endoscope->add_option("--endoscope", o->endoscope, "whose other figures it keeps: a name or a file")
        ->type_name("NAME|FILE")
        ->capture_default_str();
    endoscope->add_option("--plot", o->picture, "draw data against fit")->type_name("FILE.png|.svg");
    endoscope->add_flag("--csv", o->as_csv, "print the figures comma-separated");
    endoscope->footer("Columns, in any order, SI units; a row leaves empty what its test does not need:\n"
                      "  test       bend (three-point bend), twist or vibration\n"
                      "  segment    the name of a segment of the datasheet\n"
                      "  span       m, bend: distance of the supports\n"
                      "  deflection m, bend: of the middle, at most a fifth of the span\n"
                      "  force      N, bend: at the middle\n"
                      "  length     m, twist: between the clamps\n"
                      "  angle      rad, twist: positive for a right-handed turn\n"
                      "  torque     N m, twist\n"
                      "  time       s, vibration: of a peak; one that goes back begins another recording\n"
                      "  amplitude  vibration: of successive peaks to the same side, any unit\n" +
                      examples({"calot fit endoscope assets/endoscopes/example-bench.csv --plot fit.png",
                                "calot fit endoscope mine.csv --endoscope colonoscope --out mine.toml"}));
    endoscope->callback([o, &action] { action = [o] { return fit_endoscope(*o); }; });
}

} // namespace calot::app
