#include "fitting/fit_report.hpp"

#include "fitting/three_point_bend.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

namespace calot::fitting {

namespace {

std::string number(double value, int digits = 0) {
    char text[40];
    const auto end =
        digits == 0 ? std::to_chars(text, text + sizeof text, value).ptr
                    : std::to_chars(text, text + sizeof text, value, std::chars_format::general, digits).ptr;
    return {text, end};
}

using Table = std::vector<std::vector<std::string>>;

// The first `words` columns to the left, the others to the right.
void write_table(std::ostream& out, const Table& table, std::size_t words) {
    std::vector<std::size_t> width(table.front().size(), 0);
    for (const auto& row : table)
        for (std::size_t k = 0; k < row.size(); ++k)
            width[k] = std::max(width[k], row[k].size());
    for (const auto& row : table) {
        std::string line;
        for (std::size_t k = 0; k < row.size(); ++k) {
            const std::string pad(width[k] - row[k].size(), ' ');
            line += (k < words ? row[k] + pad : pad + row[k]) + "  ";
        }
        line.erase(line.find_last_not_of(' ') + 1);
        out << line << '\n';
    }
}

struct Named {
    const char* quantity;
    const char* unit;
    Figure figure;
};

std::vector<Named> figures(const SegmentFit& f) {
    switch (f.test) {
    case BenchTest::bend:
        return {{"flexural_rigidity", "N m2", f.rigidity}};
    case BenchTest::twist: {
        std::vector<Named> all{{"torsional_rigidity", "N m2", f.rigidity}};
        if (!std::isnan(f.right.value)) {
            all.push_back({"torsional_rigidity_right", "N m2", f.right});
            all.push_back({"torsional_rigidity_left", "N m2", f.left});
        }
        return all;
    }
    default:
        return {{"decay", "1/s", f.decay},
                {"frequency", "rad/s", f.frequency},
                {"damping_ratio",
                 "",
                 {f.decay.value / f.frequency.value, f.decay.half_width / f.frequency.value}},
                {"bending_damping", "s", f.damping}};
    }
}

const char* residual_unit(BenchTest test) {
    return test == BenchTest::bend ? "N" : test == BenchTest::twist ? "N m" : "of the logarithm";
}

// The readings' x from its least to its largest, with the fit's load there.
plot::Series fitted_curve(const SegmentFit& f, double size, int colour) {
    plot::Series s{.mark = plot::Mark::line, .colour = colour};
    double low = 0, high = 0;
    for (const Residual& r : f.residuals)
        if (r.reading.size == size) low = std::min(low, r.reading.x), high = std::max(high, r.reading.x);
    constexpr int steps = 60;
    for (int k = 0; k <= steps; ++k) {
        const double x = low + (high - low) * k / steps;
        double rigidity = f.rigidity.value;
        if (!std::isnan(f.right.value)) rigidity = x >= 0 ? f.right.value : f.left.value;
        s.x.push_back(x);
        s.y.push_back(f.test == BenchTest::twist ? rigidity * x / size
                                                 : rigidity * three_point_load(x / size) / (size * size));
    }
    return s;
}

} // namespace

void write_report(std::ostream& out, const std::vector<SegmentFit>& fits) {
    Table rows{{"segment", "test", "line", "x", "load", "fitted", "residual", ""}};
    for (const SegmentFit& f : fits)
        for (const Residual& r : f.residuals)
            rows.push_back({f.segment, name(f.test), std::to_string(r.reading.line), number(r.reading.x, 5),
                            number(r.reading.load, 5), number(r.fitted, 5), number(r.residual, 2),
                            r.is_set_aside ? "set aside" : ""});
    write_table(out, rows, 2);
    out << "x and load: deflection (m) and force (N); angle (rad) and torque (N m); time (s) and amplitude, "
           "whose "
           "residual\nis of its logarithm.\n\n";
    Table sums{{"segment", "quantity", "unit", "value", "-+ 95 %", "", "rms", "worst", "used", "set aside"}};
    for (const SegmentFit& f : fits)
        for (const Named& n : figures(f))
            sums.push_back({f.segment, n.quantity, n.unit, number(n.figure.value, 5),
                            number(n.figure.half_width, 2),
                            number(100 * n.figure.half_width / n.figure.value, 2) + " %", number(f.rms, 2),
                            number(f.worst, 2), std::to_string(f.used), std::to_string(f.set_aside)});
    write_table(out, sums, 3);
    std::string units;
    for (const BenchTest test : {BenchTest::bend, BenchTest::twist, BenchTest::vibration})
        if (std::any_of(fits.begin(), fits.end(), [&](const SegmentFit& f) { return f.test == test; }))
            units += (units.empty() ? "" : ", ") + std::string(name(test)) + " " + residual_unit(test);
    out << "rms and worst residual: " << units << ".\n";
    for (const SegmentFit& f : fits)
        for (const Residual& r : f.residuals)
            if (r.is_set_aside)
                out << "line " << r.reading.line << " was set aside: its load is "
                    << (std::abs(r.residual) < 1e6 * f.rms
                            ? number(std::abs(r.residual) / f.rms, 3) + " times the others' rms from the fit"
                            : "off the fit, which the others meet exactly")
                    << "; look at it.\n";
}

void write_csv(std::ostream& out, const std::vector<SegmentFit>& fits) {
    out << "segment,quantity,value,low,high,rms,worst,used,set_aside\n";
    for (const SegmentFit& f : fits)
        for (const Named& n : figures(f))
            out << f.segment << ',' << n.quantity << ',' << number(n.figure.value) << ','
                << number(n.figure.value - n.figure.half_width) << ','
                << number(n.figure.value + n.figure.half_width) << ',' << number(f.rms) << ','
                << number(f.worst) << ',' << f.used << ',' << f.set_aside << '\n';
}

std::vector<plot::Panel> panels(const std::vector<SegmentFit>& fits) {
    std::vector<plot::Panel> all;
    for (const BenchTest test : {BenchTest::bend, BenchTest::twist, BenchTest::vibration}) {
        plot::Panel panel;
        switch (test) {
        case BenchTest::bend:
            panel.title = "Three-point bend", panel.x_label = "deflection, m", panel.y_label = "force, N";
            break;
        case BenchTest::twist:
            panel.title = "Twist", panel.x_label = "angle, rad", panel.y_label = "torque, N m";
            break;
        default:
            panel.title = "Free vibration", panel.x_label = "time, s", panel.y_label = "amplitude";
            panel.is_log_y = true;
        }
        int colour = 0;
        for (const SegmentFit& f : fits) {
            if (f.test != test) continue;
            plot::Series points{.label = f.segment, .mark = plot::Mark::points, .colour = colour};
            plot::Series aside{.label = "set aside", .mark = plot::Mark::points, .colour = 7};
            plot::Series decay{.mark = plot::Mark::line, .colour = colour};
            std::map<double, bool> sizes;
            double last = 0;
            for (const Residual& r : f.residuals) {
                plot::Series& to = r.is_set_aside ? aside : points;
                to.x.push_back(r.reading.x), to.y.push_back(r.reading.load);
                if (r.reading.x < last) decay.x.push_back(NAN), decay.y.push_back(NAN); // another recording
                decay.x.push_back(r.reading.x), decay.y.push_back(r.fitted);
                last = r.reading.x;
                sizes[r.reading.size] = true;
            }
            panel.series.push_back(points);
            if (!aside.x.empty()) panel.series.push_back(aside);
            if (test == BenchTest::vibration)
                panel.series.push_back(decay);
            else
                for (const auto& [size, there] : sizes)
                    panel.series.push_back(fitted_curve(f, size, colour));
            ++colour;
        }
        if (!panel.series.empty()) all.push_back(std::move(panel));
    }
    return all;
}

} // namespace calot::fitting
