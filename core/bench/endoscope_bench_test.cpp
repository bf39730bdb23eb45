#include "bench/endoscope_bench.hpp"
#include "bench/endoscope_jig.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <unistd.h>

namespace calot::bench {

namespace {

const std::filesystem::path assets = std::filesystem::path(CALOT_SOURCE_DIR) / "assets";

host::Plugins::Options built() {
    const std::filesystem::path build = CALOT_BINARY_DIR;
    host::Plugins::Options o;
    o.places = {{build / "lib/calot/plugins", "the build", true, 0}};
    o.probe_program = build / "bin/calot-probe";
    return o;
}

class EndoscopeOnTheBench : public testing::Test {
  protected:
    host::Services services;
    host::Plugins plugins{services, built()};
    MakeInstance make = [this] { return plugins.make(host::Kind::rod, "org.calot.rod-cosserat"); };

    static EndoscopeBench bench(const std::string& endoscope,
                                const std::vector<std::string>& instruments = {}) {
        EndoscopeBench b;
        b.model = "org.calot.rod-cosserat";
        b.sheet = simulation::read_endoscope(assets / "endoscopes" / (endoscope + ".toml"));
        for (const std::string& name : instruments)
            b.instruments.push_back(simulation::read_instrument(assets / "instruments" / (name + ".toml")));
        b.wheel_speed = 1.0; // quicker than by hand, so that the test is
        return b;
    }
    static double measured(const std::vector<Row>& rows, const std::string& quantity) {
        for (const Row& r : rows)
            if (r.quantity == quantity) return r.measured;
        ADD_FAILURE() << quantity << " is not reported";
        return 0;
    }
    int command(const std::vector<std::string>& words) {
        out.str(""), errors.str("");
        return run_endoscope(plugins, assets, words, out, errors);
    }
    std::ostringstream out, errors;
};

} // namespace

TEST_F(EndoscopeOnTheBench, reaches_what_was_measured_bare_and_with_instruments_through_the_rod) {
    const auto found = run(make, bench("gif-hq190", {"needle", "forceps"}));
    EXPECT_NEAR(measured(found.rows, "up_degrees"), 164, 5);
    EXPECT_NEAR(measured(found.rows, "up_degrees_with_needle"), 132, 5);
    EXPECT_NEAR(measured(found.rows, "up_degrees_with_forceps"), 138, 5);
    EXPECT_GT(measured(found.rows, "hysteresis_degrees"), 5);
    EXPECT_LT(measured(found.rows, "hysteresis_degrees"), 25);
    EXPECT_GT(measured(found.rows, "tip_force"), 0.5);
    EXPECT_LT(measured(found.rows, "tip_force"), 10);
    EXPECT_NEAR(measured(found.rows, "smallest_bend_radius"), 0.085 / 2.86, 0.006) << "m: an even curve";
    for (const Row& r : found.rows)
        EXPECT_TRUE(r.met()) << r.quantity << ": got " << r.measured << ", expected " << r.reference;
}

TEST_F(EndoscopeOnTheBench, a_stiffer_instrument_costs_more_angle_than_any_table_says) {
    EndoscopeBench b = bench("gif-hq190", {"needle"});
    b.instruments[0].flexural_rigidity = 0.004; // as much as the bending section itself
    const auto found = run(make, b);
    EXPECT_NEAR(measured(found.rows, "up_degrees_with_needle"), 0.5 * measured(found.rows, "up_degrees"), 3);
}

TEST_F(EndoscopeOnTheBench, comes_to_rest_after_the_fastest_wheel_whatever_damps_it) {
    for (const double drag : {6.0, 0.6}) { // N s/m2
        EndoscopeBench b = bench("gif-2t160");
        for (simulation::ShaftSegment& s : b.sheet.segments)
            s.drag = drag;
        EndoscopeJig rod(make, shortened(b.sheet, 0.18), 27, std::nullopt, 0);
        for (const double target : {3.0, -1.0, 0.5}) {
            const auto wait = [&](int ticks) {
                double least = 1e9, most = -1e9;
                for (int k = 0; k < ticks; ++k) {
                    rod.step({target, 0});
                    least = std::min(least, rod.angulation()[0]), most = std::max(most, rod.angulation()[0]);
                }
                return most - least;
            };
            wait(20'000);
            EXPECT_LT(wait(500), 2e-3) << "rad, with a drag of " << drag << " at " << target;
        }
    }
}

TEST_F(EndoscopeOnTheBench, depends_little_on_the_nodes) {
    EndoscopeBench b = bench("gif-2t160");
    const double usual = measured(run(make, b).rows, "up_degrees");
    b.nodes = 220;
    EXPECT_NEAR(measured(run(make, b).rows, "up_degrees"), usual, 3);
}

TEST_F(EndoscopeOnTheBench, is_cut_off_with_the_stiffness_that_its_end_has) {
    const auto sheet = bench("colonoscope").sheet;
    const auto end = shortened(sheet, 0.7); // 0.5 m of the soft part and half of the middle one
    EXPECT_NEAR(end.working_length, 0.8, 1e-12);
    ASSERT_EQ(end.segments.size(), 3u);
    EXPECT_NEAR(end.segments[0].flexural_rigidity.from, 0.033, 1e-12);
    EXPECT_NEAR(end.segments[0].flexural_rigidity.to, 0.026, 1e-12);
    EXPECT_EQ(shortened(sheet, 5).segments.size(), 4u) << "what is shorter stays";
}

TEST_F(EndoscopeOnTheBench, prints_rows_and_draws_a_picture) {
    const auto picture =
        std::filesystem::temp_directory_path() / ("calot-loop-" + std::to_string(::getpid()) + ".svg");
    EXPECT_EQ(command({"--endoscope", "gif-2t160", "--speed", "90", "--csv", "--out", picture.string()}), 0)
        << errors.str();
    EXPECT_TRUE(
        out.str().starts_with("problem,model,nodes,dt,quantity,measured,reference,error,bound,met\n"));
    EXPECT_NE(out.str().find("gif-2t160,org.calot.rod-cosserat,"), std::string::npos);
    EXPECT_GT(std::filesystem::file_size(picture), 1000u);
    std::filesystem::remove(picture);
}

TEST_F(EndoscopeOnTheBench, refuses_what_it_cannot_do_in_one_line) {
    EXPECT_EQ(command({"--endoscope", "spoon"}), 2);
    EXPECT_EQ(errors.str(),
              "calot: --endoscope: spoon: is neither a file nor one of colonoscope, gif-2t160, gif-hq190\n");
    EXPECT_EQ(command({"--out", "loop.jpg"}), 2);
    EXPECT_NE(errors.str().find("end in .png or .svg"), std::string::npos);
    EXPECT_EQ(command({"--nodes", "7"}), 2);
    EXPECT_EQ(command({"--model", "org.example.none"}), 2);
    EndoscopeBench b = bench("gif-hq190", {"needle"});
    b.instruments[0].diameter = 0.0035;
    EXPECT_THROW(run(make, b), host::UserError) << "it fits no channel";
}

} // namespace calot::bench
