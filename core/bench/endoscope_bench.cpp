#include "bench/endoscope_bench.hpp"

#include "bench/endoscope_jig.hpp"
#include "host/plugins.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::bench {

namespace {

using simulation::InstrumentDatasheet;
using simulation::MeasuredAngulation;

constexpr double degrees = std::numbers::pi / 180;
constexpr double shaft_kept = 0.18;      // m
constexpr double hold = 1.0;             // s at each end of a wheel's way, so that nothing moves any more
constexpr double stop_wheel_speed = 1.0; // rad/s against the stop
constexpr double shape_every = 45 * degrees;
constexpr double neutral = 45 * degrees; // what is drawn larger, to either side

struct Moment {
    double wheel = 0, angulation = 0; // rad
};

// One wheel from neutral to one stop, to the other, and back to the first.
struct Loop {
    std::vector<Moment> out, away, back; // to the first stop; to the other; and back to the first
    double most = 0, least = 0;          // angulation, rad
    double torque = 0;                   // N m at the first stop
    double radius = 0;                   // m, likewise
    double released = 0;                 // rad that are left at neutral on the way from the first stop
    std::vector<std::vector<std::array<double, 2>>> shapes; // on the way out
};

class Bench {
  public:
    Bench(const MakeInstance& make, const EndoscopeBench& bench)
        : make_(make), bench_(bench), end_(shortened(bench.sheet, shaft_kept)) {
        const double all = bench.nodes.value_or(simulation::usual_nodes(bench.sheet)) - 1.0;
        const double pieces = all * end_.working_length / bench.sheet.working_length;
        nodes_ = static_cast<std::uint32_t>(std::clamp(std::round(pieces) + 1, 20.0, 2000.0));
    }

    EndoscopeJig jig(const std::optional<InstrumentDatasheet>& instrument) const {
        return {make_, end_, nodes_, instrument, instrument ? channel_for(*instrument) : 0};
    }

    std::size_t channel_for(const InstrumentDatasheet& instrument) const {
        for (std::size_t k = 0; k < end_.channels.size(); ++k)
            if (instrument.diameter <= end_.channels[k].diameter) return k;
        throw host::UserError(instrument.file, "diameter",
                              "is larger than every channel of " + end_.file + "; choose another endoscope");
    }

    Loop loop(const std::optional<InstrumentDatasheet>& instrument, std::size_t axis) const {
        EndoscopeJig rod = jig(instrument);
        const double ratio = end_.angulation.wheel_ratio;
        const double first = (axis == 0 ? end_.angulation.up : end_.angulation.left) / ratio;
        const double other = -(axis == 0 ? end_.angulation.down : end_.angulation.right) / ratio;
        Loop l;
        double wheel = 0;
        std::array<double, 2> wheels{};
        const auto step = [&](std::vector<Moment>& to) {
            wheels[axis] = wheel;
            rod.step(wheels);
            to.push_back({wheel, rod.angulation()[axis]});
        };
        const auto turn = [&](double target, std::vector<Moment>& to, bool draws) {
            const double by = bench_.wheel_speed * EndoscopeJig::step_seconds;
            double next_shape = 0;
            while (wheel != target) {
                wheel += std::clamp(target - wheel, -by, by);
                step(to);
                if (draws && wheel >= next_shape) l.shapes.push_back(rod.shape()), next_shape += shape_every;
            }
            for (auto k = std::llround(hold / EndoscopeJig::step_seconds); k > 0; --k)
                step(to);
            if (draws) l.shapes.push_back(rod.shape());
        };
        turn(first, l.out, axis == 0);
        l.most = l.out.back().angulation;
        l.torque = rod.wheel_torque()[axis];
        l.radius = rod.smallest_bend_radius();
        turn(0, l.away, false);
        l.released = l.away.back().angulation;
        turn(other, l.away, false);
        l.least = l.away.back().angulation;
        turn(first, l.back, false);
        return l;
    }

    // N at the tip, straight against a stop, with the up wheel at its end.
    double tip_force(const std::optional<InstrumentDatasheet>& instrument) const {
        EndoscopeJig rod = jig(instrument);
        rod.set_stop(true);
        const double end = end_.angulation.up / end_.angulation.wheel_ratio;
        double wheel = 0;
        while (wheel < end) {
            wheel = std::min(wheel + stop_wheel_speed * EndoscopeJig::step_seconds, end);
            rod.step({wheel, 0});
        }
        for (int k = 0; k < 2000; ++k)
            rod.step({wheel, 0});
        double sum = 0;
        constexpr int last = 200;
        for (int k = 0; k < last; ++k) {
            rod.step({wheel, 0});
            sum += rod.tip_force();
        }
        return sum / last;
    }

    std::uint32_t nodes() const { return nodes_; }

  private:
    const MakeInstance& make_;
    const EndoscopeBench& bench_;
    simulation::EndoscopeDatasheet end_;
    std::uint32_t nodes_ = 0;
};

// The largest difference between two ways through the same wheel angle.
double widest(const Loop& l) {
    double most = 0;
    auto other = l.away.rbegin();
    for (const Moment& m : l.back) {
        while (other != l.away.rend() && other->wheel < m.wheel)
            ++other;
        if (other == l.away.rend()) break;
        most = std::max(most, std::abs(other->angulation - m.angulation));
    }
    return most;
}

const MeasuredAngulation* find_measured(const simulation::EndoscopeDatasheet& sheet,
                                        const std::string& instrument) {
    for (const MeasuredAngulation& m : sheet.measured)
        if (m.instrument == instrument) return &m;
    return nullptr;
}

class Report {
  public:
    Report(const EndoscopeBench& bench, int nodes) : bench_(bench), nodes_(nodes) {}

    void angle(const char* quantity, const std::string& with, double rad, std::optional<double> reference,
               double tolerance) {
        Row r = row(quantity, with, rad / degrees);
        if (reference) {
            r.reference = *reference / degrees;
            r.error = std::abs(r.measured - r.reference);
            r.bound = tolerance / degrees;
        }
        rows.push_back(r);
    }
    void plain(const char* quantity, const std::string& with, double value) {
        rows.push_back(row(quantity, with, value));
    }
    std::vector<Row> rows;

  private:
    Row row(const char* quantity, const std::string& with, double value) const {
        Row r;
        r.problem = bench_.sheet.id;
        r.model = bench_.model;
        r.nodes = nodes_;
        r.dt = EndoscopeJig::step_seconds;
        r.quantity = with.empty() ? quantity : quantity + ("_with_" + with);
        r.setting = with.empty() ? "empty channels" : with;
        r.measured = value;
        return r;
    }
    const EndoscopeBench& bench_;
    int nodes_;
};

// The curve where the wheel is within `most` of neutral.
plot::Series curve(const std::vector<Moment>& way, const std::string& label, int colour, plot::Mark mark,
                   double most = 1e9) {
    plot::Series s{.label = label, .mark = mark, .colour = colour};
    for (std::size_t i = 0; i < way.size(); i += i + 51 < way.size() ? 50 : 1) {
        if (std::abs(way[i].wheel) > most) continue;
        s.x.push_back(way[i].wheel / degrees);
        s.y.push_back(way[i].angulation / degrees);
    }
    return s;
}

plot::Series outline(const std::vector<std::array<double, 2>>& line, const std::string& label, int colour,
                     plot::Mark mark) {
    plot::Series s{.label = label, .mark = mark, .colour = colour};
    for (const auto& p : line)
        s.x.push_back(1e3 * p[0]), s.y.push_back(1e3 * p[1]);
    return s;
}

} // namespace

EndoscopeFindings run(const MakeInstance& make, const EndoscopeBench& bench) {
    const Bench on(make, bench);
    Report report(bench, static_cast<int>(on.nodes()));
    plot::Panel loops{.title = bench.sheet.id + ": hysteresis",
                      .x_label = "up-down wheel, degrees",
                      .y_label = "angulation, degrees"};
    plot::Panel middle{
        .title = bench.sheet.id + ": around neutral", .x_label = loops.x_label, .y_label = loops.y_label};
    plot::Panel shapes{.title = bench.sheet.id + ": the tip on its way up",
                       .x_label = "along the shaft, mm",
                       .y_label = "up, mm",
                       .is_to_scale = true};
    std::vector<std::optional<InstrumentDatasheet>> contents{std::nullopt};
    contents.insert(contents.end(), bench.instruments.begin(), bench.instruments.end());
    plot::Series measured{.label = "measured", .mark = plot::Mark::points, .colour = 6};
    int colour = 0;
    for (const auto& content : contents) {
        const std::string with = content ? content->id : "";
        const MeasuredAngulation* found = find_measured(bench.sheet, with);
        const MeasuredAngulation was = found != nullptr ? *found : MeasuredAngulation{};
        const Loop up = on.loop(content, 0);
        report.angle("up_degrees", with, up.most, was.up, was.tolerance);
        report.angle("down_degrees", with, -up.least, was.down, was.tolerance);
        if (!content) {
            const Loop left = on.loop(content, 1);
            report.angle("left_degrees", with, left.most, was.left, was.tolerance);
            report.angle("right_degrees", with, -left.least, was.right, was.tolerance);
        }
        report.angle("hysteresis_degrees", with, widest(up), {}, 0);
        report.angle("released_degrees", with, up.released, {}, 0);
        report.plain("wheel_torque", with, up.torque);
        report.plain("smallest_bend_radius", with, up.radius);
        report.plain("tip_force", with, on.tip_force(content));

        const std::string label = content ? "with " + with : "empty channels";
        loops.series.push_back(curve(up.out, "", colour, plot::Mark::dashed));
        loops.series.push_back(curve(up.away, label, colour, plot::Mark::line));
        loops.series.push_back(curve(up.back, "", colour, plot::Mark::line));
        middle.series.push_back(curve(up.out, "", colour, plot::Mark::dashed, neutral));
        middle.series.push_back(curve(up.away, label, colour, plot::Mark::line, neutral));
        middle.series.push_back(curve(up.back, "", colour, plot::Mark::line, neutral));
        for (std::size_t k = 0; k < up.shapes.size(); ++k) {
            const bool is_last = k + 1 == up.shapes.size();
            if (content && !is_last) continue; // with an instrument the end of the way only
            shapes.series.push_back(outline(up.shapes[k], is_last ? label : "", colour,
                                            is_last ? plot::Mark::line_and_points : plot::Mark::line));
        }
        const auto mark = [&](std::optional<double> angle, double stop, double sign) {
            if (!angle) return;
            measured.x.push_back(sign * stop / bench.sheet.angulation.wheel_ratio / degrees);
            measured.y.push_back(sign * *angle / degrees);
        };
        mark(was.up, bench.sheet.angulation.up, 1), mark(was.down, bench.sheet.angulation.down, -1);
        ++colour;
    }
    if (!measured.x.empty()) loops.series.push_back(measured);
    return {std::move(report.rows), {std::move(loops), std::move(middle), std::move(shapes)}};
}

int run_endoscope(host::Plugins& plugins, const std::filesystem::path& assets,
                  const std::vector<std::string>& arguments, std::ostream& out, std::ostream& errors) {
    CLI::App app("Turns an endoscope's wheels slowly through their range and back, through a rod model, and "
                 "compares\nwith what its datasheet says was measured",
                 "calot bench endoscope");
    EndoscopeBench bench;
    bench.model = "org.calot.rod-cosserat";
    std::string endoscope = "gif-hq190", picture;
    std::vector<std::string> instruments;
    std::uint32_t nodes = 0;
    double speed = 15;
    bool as_csv = false;
    app.add_option("--endoscope", endoscope, "A datasheet: NAME in assets/endoscopes, or a file")
        ->capture_default_str();
    app.add_option(
        "--instrument", instruments,
        "What else to put into a channel: NAME in assets/instruments, or a file; several times. Those "
        "that\nthe datasheet has measured figures for unless given");
    app.add_option("--model", bench.model, "Id of the rod model")->capture_default_str();
    app.add_option("--nodes", nodes, "Along the whole endoscope; about one a centimetre unless given")
        ->check(CLI::Range(20u, 2000u));
    app.add_option("--speed", speed, "Of the wheels, degrees a second")
        ->check(CLI::Range(1.0, 180.0))
        ->capture_default_str();
    app.add_option("--out", picture, "Draw the loops and the tip's shapes: FILE.png or FILE.svg");
    app.add_flag("--csv", as_csv, "Comma-separated instead of a table");
    app.footer(
        "Quantities: *_degrees up, down, left, right: angulation with the wheel at its stop; "
        "hysteresis_degrees:\n"
        "the widest difference between both ways through a wheel's angle; released_degrees: what is left "
        "when\n"
        "the wheel comes back to neutral from up; wheel_torque: N m, up; smallest_bend_radius: m, up;\n"
        "tip_force: N, of the straight tip on a rigid stop with the wheel up at its end.\n"
        "Exit code: 0 within the tolerances of the datasheet, 1 not, 2 bad input, 3 the plugin failed.\n\n"
        "Examples:\n  calot bench endoscope --endoscope gif-hq190 --out loop.png\n"
        "  calot bench endoscope --endoscope colonoscope --instrument forceps --csv");
    try {
        std::vector<std::string> reversed(arguments.rbegin(), arguments.rend()); // as CLI11 takes them
        app.parse(reversed);
        if (!picture.empty()) plot::require_picture_name(picture, "--out");
        if (nodes != 0) bench.nodes = nodes;
        bench.wheel_speed = speed * degrees;
        bench.sheet = simulation::read_endoscope(
            simulation::find_datasheet(assets / "endoscopes", endoscope, "--endoscope"));
        if (instruments.empty())
            for (const MeasuredAngulation& m : bench.sheet.measured)
                if (!m.instrument.empty()) instruments.push_back(m.instrument);
        for (const std::string& name : instruments)
            bench.instruments.push_back(simulation::read_instrument(
                simulation::find_datasheet(assets / "instruments", name, "--instrument")));
        plugins.find(host::Kind::rod, bench.model);
        const MakeInstance make = [&] { return plugins.make(host::Kind::rod, bench.model); };
        const EndoscopeFindings found = run(make, bench);
        if (!picture.empty()) plot::draw(found.panels, picture);
        if (as_csv)
            write_csv(out, found.rows);
        else
            write_table(out, found.rows);
        return std::all_of(found.rows.begin(), found.rows.end(), [](const Row& r) { return r.met(); }) ? 0
                                                                                                       : 1;
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
