#include "fitting/fit.hpp"
#include "fitting/fit_report.hpp"
#include "fitting/fitted_datasheet.hpp"
#include "fitting/three_point_bend.hpp"
#include "host/error.hpp"
#include "simulation/endoscope_datasheet.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>
#include <sstream>

namespace calot::fitting {

namespace {

const std::filesystem::path endoscopes = std::filesystem::path(CALOT_SOURCE_DIR) / "assets/endoscopes";

// Normal numbers that are the same with every library.
class Noise {
  public:
    explicit Noise(unsigned seed) : generator_(seed) {}
    double operator()() {
        const double u = (static_cast<double>(generator_()) + 1) / 4294967297.0;
        const double v = static_cast<double>(generator_()) / 4294967296.0;
        return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
    }

  private:
    std::mt19937 generator_;
};

Reading reading(BenchTest test, double size, double x, double load, int line) {
    Reading r;
    r.test = test, r.segment = "shaft", r.size = size, r.x = x, r.load = load, r.line = line;
    return r;
}

// Spans of 200 and 300 mm, deflections up to a fifth; force noise of `noise` N.
std::vector<Reading> bends(double ei, double noise, unsigned seed) {
    Noise random(seed);
    std::vector<Reading> all;
    for (const double span : {0.2, 0.3})
        for (int k = 1; k <= 10; ++k) {
            const double share = 0.019 * k;
            const double force = ei / (span * span) * three_point_load(share) + noise * random();
            all.push_back(
                reading(BenchTest::bend, span, share * span, force, static_cast<int>(all.size()) + 2));
        }
    return all;
}

std::vector<Reading> twists(double right, double left, double noise, unsigned seed) {
    Noise random(seed);
    std::vector<Reading> all;
    for (int k = -6; k <= 6; ++k) {
        const double angle = 0.1 * k;
        const double torque = (angle > 0 ? right : left) * angle / 0.5 + noise * random();
        all.push_back(reading(BenchTest::twist, 0.5, angle, torque, static_cast<int>(all.size()) + 2));
    }
    return all;
}

std::vector<Reading> decays(double decay, double frequency, double noise, unsigned seed) {
    Noise random(seed);
    std::vector<Reading> all;
    for (const double begin : {0.03, 0.02}) // two recordings
        for (int k = 0; k < 8; ++k) {
            const double t = 0.1 + 2 * std::numbers::pi / frequency * k;
            const double amplitude = begin * std::exp(-decay * t) * (1 + noise * random());
            all.push_back(reading(BenchTest::vibration, 0, t, amplitude, static_cast<int>(all.size()) + 2));
        }
    return all;
}

std::string refusal(const std::vector<Reading>& readings) {
    try {
        fit(readings, "bench.csv");
    } catch (const host::UserError& error) {
        return error.what();
    }
    return "nothing was refused";
}

// The load that turns the middle of a beam level, found by shooting through the beam's equation, and the
// deflection it makes: nothing of the closed form.
std::array<double, 2> shot(double slope) {
    double low = 0, high = 40, depth = 0;
    for (int k = 0; k < 60; ++k) {
        const double load = 0.5 * (low + high); // F span^2 / EI
        double x = 0, y = 0, angle = slope;
        constexpr double ds = 2e-5;
        while (x < 0.5 && angle > 0) { // mid-point rule
            const auto bend = [&](double px, double py) { return 0.5 * load * (px + std::tan(slope) * py); };
            const double half = angle - 0.5 * ds * bend(x, y);
            const double hx = x + 0.5 * ds * std::cos(angle), hy = y + 0.5 * ds * std::sin(angle);
            angle -= ds * bend(hx, hy);
            x += ds * std::cos(half), y += ds * std::sin(half);
        }
        (angle > 0 ? low : high) = load; // not level yet in the middle: press harder
        depth = y;
    }
    return {depth, 0.5 * (low + high)};
}

} // namespace

TEST(ThreePointBend, agrees_with_the_small_beam_and_with_shooting_for_the_large_one) {
    EXPECT_NEAR(three_point_load(1e-4) / 48e-4, 1, 1e-6);
    EXPECT_EQ(three_point_load(0), 0);
    for (const double slope : {0.1, 0.3, 0.55}) {
        const auto [deflection, load] = shot(slope);
        EXPECT_NEAR(three_point_load(deflection) / load, 1, 1e-3) << "at a deflection of " << deflection;
        EXPECT_EQ(three_point_load(-deflection), -three_point_load(deflection));
    }
    EXPECT_THROW(three_point_load(0.21), std::invalid_argument);
    EXPECT_THROW(three_point_load(std::nan("")), std::invalid_argument);
}

TEST(Fit, recovers_stiffness_from_noisy_tests_within_its_confidence) {
    int bend = 0, right = 0, left = 0, damping = 0;
    constexpr int trials = 200;
    for (unsigned seed = 1; seed <= trials; ++seed) {
        const auto in = [](const Figure& f, double truth) {
            return std::abs(f.value - truth) <= f.half_width ? 1 : 0;
        };
        bend += in(fit(bends(0.033, 0.2, seed), "b")[0].rigidity, 0.033);
        const auto twist = fit(twists(0.44, 0.396, 0.01, seed), "b");
        right += in(twist[0].right, 0.44), left += in(twist[0].left, 0.396);
        damping += in(fit(decays(0.3, 6, 0.02, seed), "b")[0].damping, 2 * 0.3 / 36);
    }
    // Of 200 trials at 95 %, 181 to 199 hold the truth with a chance of 99.9 % each; setting outliers aside
    // takes a little off.
    for (const int count : {bend, right, left, damping}) {
        EXPECT_GE(count, 178);
        EXPECT_LT(count, trials) << "the interval is not merely wide";
    }
    const auto one = fit(bends(0.033, 0.2, 1), "b")[0];
    EXPECT_NEAR(one.rigidity.value, 0.033, 0.002);
    EXPECT_LT(one.rigidity.half_width, 0.002);
    EXPECT_EQ(one.used, 20);
    EXPECT_NEAR(one.rms, 0.2, 0.1);
}

TEST(Fit, exact_data_give_exact_figures) {
    const auto bend = fit(bends(0.005, 0, 1), "b")[0];
    EXPECT_NEAR(bend.rigidity.value / 0.005, 1, 1e-12);
    EXPECT_NEAR(bend.rigidity.half_width, 0, 1e-12);
    EXPECT_EQ(bend.set_aside, 0);
    const auto vibration = fit(decays(0.02, 50, 0, 1), "b")[0];
    EXPECT_NEAR(vibration.decay.value, 0.02, 1e-9);
    EXPECT_NEAR(vibration.frequency.value, 50, 1e-7);
    EXPECT_NEAR(vibration.damping.value, 2 * 0.02 / 2500, 1e-9);
}

TEST(Fit, names_the_reading_that_is_far_out_and_leaves_it_aside) {
    auto readings = bends(0.033, 0.1, 3);
    readings[7].load *= 10; // a slipped decimal point
    const auto found = fit(readings, "b")[0];
    EXPECT_EQ(found.set_aside, 1);
    EXPECT_TRUE(found.residuals[7].is_set_aside);
    EXPECT_NEAR(found.rigidity.value, 0.033, 0.0005);
    std::ostringstream report;
    write_report(report, {found});
    EXPECT_NE(report.str().find("line 9 was set aside"), std::string::npos) << report.str();
}

TEST(Fit, refuses_what_no_figure_follows_from_naming_line_and_column) {
    auto deep = bends(0.033, 0, 1);
    deep[4].x = 0.21 * deep[4].size;
    EXPECT_EQ(refusal(deep),
              "bench.csv: line 6: deflection: is more than a fifth of the span, where the load "
              "hardly grows with it; bend less, or over a longer span");
    EXPECT_NE(refusal({deep.begin(), deep.begin() + 2}).find("fewer than three rows of bend"),
              std::string::npos);
    auto wrong = twists(0.4, 0.4, 0, 1);
    for (Reading& r : wrong)
        r.load = -r.load;
    EXPECT_NE(refusal(wrong).find("line 2: torque: does not grow"), std::string::npos);
    for (Reading& r : wrong)
        r.x = 0;
    EXPECT_NE(refusal(wrong).find("angle: is zero in every row"), std::string::npos);
    auto growing = decays(-0.1, 6, 0, 1);
    EXPECT_NE(refusal(growing).find("amplitude: does not decay"), std::string::npos);
    auto twice = decays(0.1, 6, 0, 1);
    twice[3].x = twice[2].x;
    EXPECT_NE(refusal(twice).find("line 5: time: is that of the row before"), std::string::npos);
    EXPECT_NE(refusal({twice.begin(), twice.begin() + 3}).find("fewer than four peaks"), std::string::npos);
}

TEST(Fit, fills_a_datasheet_that_can_be_read_again) {
    auto readings = bends(0.028, 0.1, 5);
    for (const Reading& r : twists(0.40, 0.34, 0.005, 5))
        readings.push_back(r);
    for (const Reading& r : decays(0.3, 50, 0.01, 5))
        readings.push_back(r);
    const auto fits = fit(readings, "b");
    const auto filled = fitted_datasheet(fits, endoscopes / "gif-2t160.toml", "b.csv");
    EXPECT_TRUE(filled.notes.empty());
    const auto sheet = simulation::parse_endoscope(filled.text, "filled");
    EXPECT_NEAR(sheet.segments[0].flexural_rigidity.to, 0.028, 0.0005);
    EXPECT_NEAR(sheet.segments[0].torsional_rigidity.to, 0.40, 0.01);
    EXPECT_NEAR(sheet.torque_asymmetry, 0.15, 0.03);
    EXPECT_NEAR(sheet.segments[0].bending_damping, 2 * 0.3 / 2500, 3e-5);
    EXPECT_DOUBLE_EQ(sheet.segments[1].flexural_rigidity.to, 0.005) << "what was not measured stays";
    EXPECT_NE(filled.text.find("fitted to b.csv: -+ "), std::string::npos);
    EXPECT_NE(filled.text.find("wire_stiffness = 0.7\n"), std::string::npos)
        << "numbers as people write them";

    // A sheath's own, of some tens of milliseconds, goes in.
    const auto usual =
        fitted_datasheet(fit(decays(0.3, 6, 0.01, 5), "b"), endoscopes / "gif-2t160.toml", "b");
    EXPECT_TRUE(usual.notes.empty());
    EXPECT_NEAR(simulation::parse_endoscope(usual.text, "u").segments[0].bending_damping, 2 * 0.3 / 36, 2e-3);

    const auto heavy =
        fitted_datasheet(fit(decays(0.3, 2, 0.01, 5), "b"), endoscopes / "gif-2t160.toml", "b");
    ASSERT_EQ(heavy.notes.size(), 1u) << "0.15 s is more than a datasheet may hold";
    EXPECT_NE(heavy.notes[0].find("drag = "), std::string::npos) << heavy.notes[0];
    EXPECT_DOUBLE_EQ(simulation::parse_endoscope(heavy.text, "h").segments[0].bending_damping, 2e-5);

    readings[0].segment = "tail";
    readings[1].segment = "tail";
    readings[2].segment = "tail";
    EXPECT_THROW(fitted_datasheet(fit(readings, "b"), endoscopes / "gif-2t160.toml", "b"), host::UserError);
}

TEST(Fit, of_the_example_finds_the_figures_that_it_was_generated_from) {
    const auto fits = fit(read_bench_table(endoscopes / "example-bench.csv"), "example");
    int checked = 0;
    for (const SegmentFit& f : fits) {
        const auto holds = [&](const Figure& figure, double truth) {
            EXPECT_NEAR(figure.value, truth, 1.5 * figure.half_width) << f.segment << " " << name(f.test);
            EXPECT_LT(figure.half_width, 0.1 * truth) << f.segment << " " << name(f.test);
            ++checked;
        };
        const bool is_shaft = f.segment == "shaft";
        if (f.test == BenchTest::bend) holds(f.rigidity, is_shaft ? 0.033 : 0.005);
        if (f.test == BenchTest::twist) holds(f.right, 0.44), holds(f.left, 0.396);
        if (f.test == BenchTest::vibration) holds(f.decay, 0.40);
    }
    EXPECT_EQ(checked, 5);
    std::ostringstream csv;
    write_csv(csv, fits);
    EXPECT_TRUE(csv.str().starts_with("segment,quantity,value,low,high,rms,worst,used,set_aside\n"));
    EXPECT_EQ(panels(fits).size(), 3u);
}

} // namespace calot::fitting
