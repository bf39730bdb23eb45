// The reference problems, and the claims that plugins make about them.
#include "bench/bench.hpp"
#include "bench/lumen.hpp"
#include "bench/press_body.hpp"
#include "bench/references.hpp"
#include "bench/rod_problems.hpp"
#include "bench/self_contact.hpp"
#include "bench/test_plugins.hpp"
#include "simulation/endoscope_datasheet.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace calot::bench {
namespace {

int run(const std::vector<std::string>& arguments, std::string& out, std::string& errors) {
    std::ostringstream o, e;
    const int code = run_rod(plugins(), arguments, o, e);
    out = o.str(), errors = e.str();
    return code;
}

TEST(References, agree_with_mattiasson) {
    // K. Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145, table 1.
    const double alpha[] = {1, 2, 5, 10}, drop[] = {0.30172, 0.49346, 0.71379, 0.81061};
    const double shortening[] = {0.05643, 0.16064, 0.38763, 0.55500};
    for (int k = 0; k < 4; ++k) {
        const PlanarTip tip = planar_tip(alpha[k], 0);
        EXPECT_NEAR(tip.drop, drop[k], 6e-6) << "alpha " << alpha[k];
        EXPECT_NEAR(tip.shortening, shortening[k], 6e-6) << "alpha " << alpha[k];
    }
    EXPECT_NEAR(planar_tip(0, 5).drop, 0.495905, 1e-6);
    // The linear beam, P L^3 / 3 EI and w L^4 / 8 EI.
    EXPECT_NEAR(planar_tip(1e-3, 0).drop, 1e-3 / 3, 1e-9);
    EXPECT_NEAR(planar_tip(0, 1e-3).drop, 1e-3 / 8, 1e-9);
    // A load so great that all bending is near the clamp: delta' = -2 sqrt(alpha) sin(delta / 2), so the rod
    // reaches sqrt(2 / alpha) forward.
    EXPECT_NEAR(1 - planar_tip(1e4, 0).shortening, std::sqrt(2.0) * 1e-2, 1e-5);
}

// Every problem that a rod model's manifest claims, at a size that a test can wait for.
struct Claim {
    std::string model, problem;
};

std::vector<Claim> all_claims() {
    std::vector<Claim> all;
    for (const host::Found& found : plugins().models(host::Kind::rod))
        for (const std::string& problem : found.model->claims)
            all.push_back({found.model->id, problem});
    return all;
}

int test_nodes(const std::string& problem) {
    if (problem == "compress") return 128;
    if (problem == "elastica" || problem == "refine") return 100;
    return 40;
}

// Where the shooting ends, the long rod's formula goes on.
TEST(References, go_on_as_a_long_rod_under_large_loads) {
    const PlanarTip shot = planar_tip(359'000, 0), formula = planar_tip(361'000, 0);
    EXPECT_NEAR((1 - shot.drop) * std::sqrt(359e3), (1 - formula.drop) * std::sqrt(361e3), 1e-6);
    EXPECT_NEAR((1 - shot.shortening) * std::sqrt(359e3), (1 - formula.shortening) * std::sqrt(361e3), 1e-6);
    EXPECT_GT(planar_tip(1e9, 0).drop, formula.drop);
}

// A soft rope gives Euler's formula; where stiffness counts the free ends' angles follow from its strain
// energy.
TEST(References, a_stiff_rope_on_a_drum_comes_from_eulers) {
    EXPECT_NEAR(stiff_capstan(0.3, 2, 1e-9).ratio, std::exp(0.6), 1e-6);
    EXPECT_TRUE(stiff_capstan(0.3, 2, 0.2).holds);
    const StiffCapstan c = stiff_capstan(0.3, 2, 0.2);
    EXPECT_NEAR(1 - std::cos(c.slack), 0.1, 1e-12);
    EXPECT_NEAR(1 - std::cos(c.taut), 0.1 / c.ratio, 1e-12);
    // Without friction there is no difference, however stiff.
    EXPECT_NEAR(stiff_capstan(0, 2, 0.5).ratio, 1, 1e-12);
    EXPECT_FALSE(stiff_capstan(0.3, 0.5, 1).holds) << "it leaves the drum before it comes to it";
}

class Claims : public testing::TestWithParam<Claim> {};

TEST_P(Claims, are_met) {
    RodOptions options;
    options.model = GetParam().model;
    options.nodes = test_nodes(GetParam().problem);
    options.is_short = true;
    options.duration = 2; // of a soak
    const RodProblem* problem = find_rod_problem(GetParam().problem);
    ASSERT_NE(problem, nullptr) << "no problem of this name";
    const auto rows = problem->run([&] { return plugins().make(host::Kind::rod, options.model); }, options);
    ASSERT_FALSE(rows.empty());
    bool is_judged = false;
    for (const Row& r : rows) {
        is_judged = is_judged || std::isfinite(r.bound);
        EXPECT_TRUE(r.is_suited) << r.problem << ' ' << r.quantity << ": " << r.remark;
        EXPECT_TRUE(r.met()) << r.problem << ' ' << r.quantity << " (" << r.setting << "): got " << r.measured
                             << ", expected " << r.reference << ", error " << r.error << ", bound "
                             << r.bound;
    }
    EXPECT_TRUE(is_judged);
}

INSTANTIATE_TEST_SUITE_P(EveryModel, Claims, testing::ValuesIn(all_claims()), [](const auto& info) {
    std::string name = info.param.model.substr(info.param.model.rfind('.') + 1) + "_" + info.param.problem;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
});

TEST(EveryRod, claims_what_every_rod_must) {
    const auto models = plugins().models(host::Kind::rod);
    ASSERT_FALSE(models.empty());
    for (const host::Found& found : models)
        for (const char* must : {"rest", "cantilever", "twist", "rotate"})
            EXPECT_NE(std::find(found.model->claims.begin(), found.model->claims.end(), must),
                      found.model->claims.end())
                << found.model->id << " does not claim " << must;
}

// A rod that is thrown at 5 m/s, and one whose clamp is drawn along: in parts of a millimetre as in one.
TEST(EveryRod, takes_a_step_in_parts_as_in_one) {
    for (const host::Found& found : plugins().models(host::Kind::rod)) {
        const MakeInstance make = [&] { return plugins().make(host::Kind::rod, found.model->id); };
        for (const bool is_clamped : {false, true}) {
            BenchRod::Setup s;
            s.rod.nodes = 41, s.rod.length = 0.4;
            s.position = straight_line(s.rod, {}, along_x);
            BenchRod parts(make, s), whole(make, s);
            for (BenchRod* rod : {&parts, &whole}) {
                if (is_clamped) {
                    rod->clamp_base({5e-3, 0, 0}, along_x);
                } else {
                    rod->input.gravity[1] = 5000;
                    rod->step();
                    rod->input.gravity[1] = 0;
                }
            }
            whole.step();
            std::vector<Vec3> places;
            parts.step_in_parts(
                [&] {
                    places.push_back(parts.position(0));
                    return std::span<const calot_contact>();
                },
                1e-3);
            places.push_back(parts.position(0));
            const std::string label = found.model->id + (is_clamped ? ", clamped" : ", thrown");
            EXPECT_NEAR(whole.position(0).x + whole.position(0).y, is_clamped ? 5e-3 : 10e-3, 3e-3) << label;
            EXPECT_LT(norm(parts.position(0) - whole.position(0)), 1e-9) << label;
            if (!found.model->is_realtime) continue; // needs not end a step early
            EXPECT_GE(places.size(), 5u) << label;
            for (std::size_t k = 1; k < places.size(); ++k)
                EXPECT_LE(norm(places[k] - places[k - 1]), 1.3e-3) << label << ", part " << k;
        }
    }
}

// However much of it acts, more damping must not shake a rod: bent and let go, it loses energy in every step.
TEST(EveryRod, bears_the_most_damping_that_a_datasheet_may_hold) {
    for (const host::Found& found : plugins().models(host::Kind::rod)) {
        UniformRod uniform;
        uniform.nodes = 60, uniform.length = 0.5;
        BenchRod::Setup s;
        s.rod = uniform;
        s.position = straight_line(uniform, {}, along_x);
        s.frame = same_frames(uniform, along_x);
        s.bending_damping = simulation::most_bending_damping, s.torsion_damping = 0.1, s.drag = 5;
        BenchRod rod([&] { return plugins().make(host::Kind::rod, found.model->id); }, std::move(s));
        rod.clamp_base({}, along_x);
        rod.load_tip({0, 0.1, 0}, {});
        for (int k = 0; k < 1500; ++k)
            rod.step();
        const double bent = rod.position(59).y, most = 0.1 * 0.125 / 3 / uniform.bending;
        EXPECT_GT(bent, 0.3 * most) << found.model->id;
        rod.load_tip({}, {});
        double before = rod.energy(), rise = 0;
        const double start = before;
        for (int k = 0; k < 1500; ++k) {
            rod.step();
            rise = std::max(rise, rod.energy() - before);
            before = std::min(before, rod.energy());
        }
        EXPECT_LE(rise, 1e-3 * start) << found.model->id;
        EXPECT_LT(before, 0.2 * start) << found.model->id << " comes back";
        EXPECT_LT(std::abs(rod.position(59).y), bent) << found.model->id;
    }
}

// An endoscope's shaft that is pushed and turned in a bent tube, through the contract.
struct Scene {
    BenchRod rod;
    Lumen lumen;

    static BenchRod::Setup setup() {
        UniformRod uniform;
        uniform.nodes = 40, uniform.length = 0.4;
        BenchRod::Setup s;
        s.rod = uniform;
        s.position = straight_line(uniform, {-0.3, 0, 0}, along_x);
        s.frame = same_frames(uniform, along_x);
        s.drag = 5, s.bending_damping = 2e-5;
        calot_guide guide{};
        guide.present = 1;
        guide.direction[0] = 1;
        s.guide = guide;
        s.max_contacts = 41;
        return s;
    }
    Scene()
        : rod([] { return plugins().make(host::Kind::rod, "org.calot.rod-cosserat"); }, setup()),
          lumen(Lumen::bend(0.05, 0.08, 1.5, 0.5), 0.01, false, 0.2) {
        rod.input.gravity[1] = 9.81;
        rod.input.base.mode = CALOT_END_COUPLED;
        rod.input.base.insertion = {-0.3, 0.2, 5000, 50, 50};
        rod.input.base.rotation = {0, 3, 10, 0.1, 1};
    }
    void run(int steps) {
        for (int k = 0; k < steps; ++k) {
            rod.step(lumen.contacts(rod));
            rod.input.base.insertion.target += 0.2 * rod.rod().dt;
            rod.input.base.rotation.target += 3 * rod.rod().dt;
        }
    }
    std::vector<std::uint8_t> save() {
        std::vector<std::uint8_t> bytes;
        const calot_sink sink{sizeof(calot_sink), &bytes, [](void* self, calot_bytes more) {
                                  auto& to = *static_cast<std::vector<std::uint8_t>*>(self);
                                  to.insert(to.end(), more.data, more.data + more.size);
                                  return calot_status{CALOT_OK};
                              }};
        calot_instance* abi = rod.instance().abi();
        EXPECT_EQ(abi->save_state(abi->self, &sink, nullptr), CALOT_OK);
        return bytes;
    }
    calot_status load(std::span<const std::uint8_t> bytes) {
        const calot_source source{sizeof(calot_source), &bytes, [](void* self, calot_bytes_out to) {
                                      auto& from = *static_cast<std::span<const std::uint8_t>*>(self);
                                      const std::size_t n = std::min<std::size_t>({to.size, from.size(), 7});
                                      std::copy_n(from.begin(), n, to.data);
                                      from = from.subspan(n);
                                      return std::uint64_t{n};
                                  }};
        calot_instance* abi = rod.instance().abi();
        return abi->load_state(abi->self, &source, nullptr);
    }
};

TEST(RodCosserat, resumes_to_the_same_bits_in_another_instance) {
    Scene first, second;
    first.run(700);
    EXPECT_GT(first.rod.position(39).y, 0.01) << "the tube should have bent it";
    const auto state = first.save();
    ASSERT_EQ(second.load(state), CALOT_OK);
    second.rod.input = first.rod.input;
    second.lumen = first.lumen;
    second.rod.refresh();
    EXPECT_EQ(second.save(), state);
    first.run(300), second.run(300);
    EXPECT_EQ(first.save(), second.save());
}

TEST(RodCosserat, refuses_a_spoilt_state_and_goes_on) {
    Scene scene;
    scene.run(200);
    const auto state = scene.save();
    auto spoilt = state;
    spoilt[spoilt.size() / 2] ^= 1;
    EXPECT_EQ(scene.load(spoilt), CALOT_ERROR);
    EXPECT_EQ(scene.load(std::span(state).first(state.size() - 9)), CALOT_ERROR);
    EXPECT_EQ(scene.save(), state);
    scene.run(10);
}

TEST(RodCosserat, reset_is_a_new_instance) {
    Scene used, fresh;
    const auto start = fresh.save();
    used.run(300);
    used.rod.set_drag(50);
    calot_instance* abi = used.rod.instance().abi();
    ASSERT_EQ(abi->reset(abi->self, 1, nullptr), CALOT_OK);
    EXPECT_EQ(used.save(), start);
}

TEST(RodCosserat, discards_what_is_not_finite_and_stays_as_it_was) {
    Scene scene;
    scene.run(50);
    const auto state = scene.save();
    for (double bad : {std::nan(""), HUGE_VAL, 1e300}) {
        const double good = scene.rod.input.base.insertion.target;
        scene.rod.input.base.insertion.target = bad;
        EXPECT_THROW(scene.rod.step(), host::PluginError);
        scene.rod.input.base.insertion.target = good;
        EXPECT_EQ(scene.save(), state);
    }
}

TEST(BenchRod, csv_has_the_agreed_columns) {
    std::string out, errors;
    ASSERT_EQ(run({"twist", "--nodes", "20", "--load", "0.1", "--csv"}, out, errors), 0) << errors;
    std::istringstream lines(out);
    std::string header, row;
    std::getline(lines, header), std::getline(lines, row);
    EXPECT_EQ(header, "problem,model,nodes,dt,quantity,measured,reference,error,bound,met");
    EXPECT_EQ(row.rfind("twist,org.calot.rod-cosserat,20,0.001,tip_angle,0.22", 0), 0u) << row;
    EXPECT_EQ(std::count(row.begin(), row.end(), ','), 9);
}

// Everything printed before the last problem begins, whatever happens then.
TEST(BenchRod, prints_rows_as_soon_as_they_are_known) {
    Row row;
    row.problem = "rest", row.model = "org.example.rod", row.quantity = "drift";
    for (const bool is_csv : {true, false}) {
        std::ostringstream out;
        RowPrinter printer(out, is_csv);
        printer.print({&row, 1});
        const std::string first = out.str();
        EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 2) << "a header and a row: " << first;
        row.quantity = "a_quantity_of_a_longer_name";
        printer.print({&row, 1});
        const std::string both = out.str();
        EXPECT_EQ(both.substr(0, first.size()), first);
        EXPECT_EQ(std::count(both.begin(), both.end(), '\n'), 3) << "one header only: " << both;
        EXPECT_NE(both.find("a_quantity_of_a_longer_name"), std::string::npos);
        row.quantity = "drift";
    }
}

TEST(BenchRod, prints_what_a_step_costs) {
    std::string out, errors;
    ASSERT_EQ(run({"--nodes", "30", "--csv"}, out, errors), 0) << errors;
    for (const char* part : {"\nrod,", "\nconstraints,", "\ncontacts,"})
        EXPECT_NE(out.find(part), std::string::npos) << out;
    EXPECT_NE(out.find("us_per_simulated_ms"), std::string::npos);
}

TEST(BenchRod, names_what_is_wrong_with_its_arguments) {
    std::string out, errors;
    EXPECT_EQ(run({"levitate"}, out, errors), 2);
    EXPECT_NE(errors.find("levitate"), std::string::npos) << errors;
    EXPECT_EQ(run({"rest", "--nodes", "-4"}, out, errors), 2);
    EXPECT_NE(errors.find("--nodes"), std::string::npos) << errors;
    EXPECT_EQ(run({"rest", "--EI", "nan"}, out, errors), 2);
    EXPECT_NE(errors.find("--EI"), std::string::npos) << errors;
    EXPECT_EQ(run({"rest", "--model", "org.example.none"}, out, errors), 2);
    EXPECT_NE(errors.find("org.example.none"), std::string::npos) << errors;
    EXPECT_EQ(run({"rest", "--model", "rod-direct"}, out, errors), 2);
    EXPECT_NE(errors.find("do you mean org.calot.rod-direct?"), std::string::npos) << errors;
}

TEST(BenchRod, says_which_numbers_a_problem_has_no_use_for) {
    std::string out, errors;
    ASSERT_EQ(
        run({"twist", "--nodes", "10", "--friction", "0.2", "--angle", "1", "--duration", "3"}, out, errors),
        0)
        << errors;
    EXPECT_NE(errors.find("twist has no use for --friction, --angle, --duration"), std::string::npos)
        << errors;
}

// A vessel of 3 mm radius holds no shaft of 6 mm: it grows with the rod.
TEST(BenchRod, compress_has_a_vessel_for_any_rod) {
    for (const char* radius : {"0.006", "0.02"}) {
        std::string out, errors;
        EXPECT_EQ(run({"compress", "--radius", radius, "--nodes", "60", "--csv"}, out, errors), 0)
            << out << errors;
        EXPECT_NE(out.find(",push,5,5,"), std::string::npos) << "was never pushed: " << out;
    }
}

// A tip of 6 g on 5 kN/m: what the load moves its node in a tick is ten times the give of the body.
TEST(BenchRod, a_light_rod_bears_on_a_stiff_body_with_its_load) {
    std::string out, errors;
    ASSERT_EQ(run({"press", "--EI", "0.002", "--GJ", "0.002", "--length", "0.3", "--mass-per-length", "0.02",
                   "--load", "1", "--csv"},
                  out, errors),
              0)
        << out << errors;
    int count = 0;
    const std::string quantity = ",held_force,";
    for (std::size_t at = 0; (at = out.find(quantity, at)) != std::string::npos;
         at += quantity.size(), ++count)
        EXPECT_NEAR(std::stod(out.substr(at + quantity.size())), 1.0, 1e-6) << out;
    EXPECT_EQ(count, 2) << out;
}

// At the other numbers of the problem the pull is 100 N on 50 g a metre; at the second ones all contacts
// stick and slip at once when it begins.
TEST(BenchRod, a_taut_rod_slides_about_a_rough_drum_with_every_model_for_real_time) {
    for (const char* model : {"org.calot.rod-cosserat", "org.calot.rod-direct"})
        for (const auto& [friction, angle] : {std::pair{"2", "1.5"}, {"0.4", "8"}}) {
            std::string out, errors;
            EXPECT_EQ(run({"capstan", "--friction", friction, "--angle", angle, "--model", model, "--csv"},
                          out, errors),
                      0)
                << out << errors;
            EXPECT_NE(out.find(",true\n"), std::string::npos) << out;
        }
}

TEST(BenchRod, judges_nobody_where_the_reference_does_not_hold) {
    std::string out, errors;
    EXPECT_EQ(run({"capstan", "--csv", "--model", "org.calot.rod-direct", "--EI", "0.3", "--length", "0.4",
                   "--load", "1"},
                  out, errors),
              0)
        << errors;
    EXPECT_NE(out.find(",unsuited\n"), std::string::npos) << out;
    EXPECT_NE(errors.find("too stiff to lie on a drum"), std::string::npos) << errors;
    for (const auto& [problem, load] : {std::pair{"twist", "1000"}, {"circle", "10"}, {"elastica", "1e5"}}) {
        EXPECT_EQ(run({problem, "--load", load, "--model", "org.calot.rod-direct", "--csv"}, out, errors), 0)
            << out << errors;
        EXPECT_NE(out.find(",unsuited\n"), std::string::npos) << problem << ": " << out;
    }
}

// Too coarse for its bound, and no more than that.
TEST(BenchRod, fails_where_a_claim_is_missed) {
    std::string out, errors;
    EXPECT_EQ(run({"circle", "--nodes", "12", "--csv"}, out, errors), 1) << out << errors;
    EXPECT_NE(out.find(",false\n"), std::string::npos) << out;
}

TEST(BenchRod, explains_every_problem) {
    std::string out, errors;
    ASSERT_EQ(run({"--help"}, out, errors), 0);
    for (const RodProblem& p : rod_problems()) {
        EXPECT_NE(out.find("calot bench rod " + std::string(p.example) + "\n"), std::string::npos) << p.id;
        EXPECT_EQ(p.example.substr(0, p.example.find(' ')), p.id) << "the example is of another problem";
    }
}

TEST(Row, that_is_not_claimed_is_told_apart_in_the_table) {
    Row row;
    row.problem = "buckle", row.model = "org.example.rod", row.quantity = "critical_torque";
    row.error = 0.2, row.bound = 0.05, row.is_claimed = false;
    std::ostringstream table, csv;
    write_table(table, {&row, 1});
    EXPECT_NE(table.str().find("no (not claimed)"), std::string::npos) << table.str();
    row.error = std::numeric_limits<double>::infinity();
    write_csv(csv, {&row, 1});
    EXPECT_NE(csv.str().find(",inf,0.05,false\n"), std::string::npos) << csv.str();
}

// Of two masses in the reference: at rest, the drive's and the body's springs in series carry the load.
TEST(PressReference, comes_to_rest_at_the_load) {
    PressScene p;
    p.tool_mass = 0.1, p.drive_stiffness = 2000, p.drive_damping = 20, p.drive_limit = 100;
    p.body_mass = 0.02, p.body_stiffness = 500, p.body_damping = 1, p.gap = 0.005;
    p.depth = 3.0 / p.body_stiffness + 3.0 / p.drive_stiffness;
    const PressReference right = press_reference(p, 1000);
    EXPECT_NEAR(right.force[795], 3, 0.01);
    EXPECT_NEAR(right.tool[795], p.gap + 3.0 / p.body_stiffness, 1e-5);
    EXPECT_EQ(right.force.back(), 0) << "withdrawn at the end";
}

TEST(PressBody, under_a_steady_force_rests_where_its_spring_says) {
    PressScene p;
    p.body_mass = 0.02, p.body_stiffness = 500, p.body_damping = 2;
    PressBody body(p, 1e-3);
    for (int k = 0; k < 900; ++k)
        body.end_tick(2e-3); // 2 N
    EXPECT_NEAR(body.surface(), 2.0 / 500, 1e-6);
    // The law: what it would do by itself, and what the impulse adds.
    EXPECT_NEAR(body.free_surface() + body.compliance() * 2e-3, 2.0 / 500, 1e-6);
}

TEST(SelfContacts, closest_points_of_two_segments) {
    const ClosestPair across = closest_points({0, 0, 0}, {2, 0, 0}, {0.5, -1, 0.3}, {0.5, 3, 0.3});
    EXPECT_NEAR(across.s, 0.25, 1e-12);
    EXPECT_NEAR(across.t, 0.25, 1e-12);
    EXPECT_NEAR(across.distance, 0.3, 1e-12);
    const ClosestPair apart = closest_points({0, 0, 0}, {1, 0, 0}, {4, 4, 0}, {4, 9, 0});
    EXPECT_EQ(apart.s, 1);
    EXPECT_EQ(apart.t, 0);
    EXPECT_NEAR(apart.distance, 5, 1e-12);
    EXPECT_NEAR(closest_points({0, 0, 0}, {1, 0, 0}, {0, 0.2, 0}, {1, 0.2, 0}).distance, 0.2, 1e-12);
}

} // namespace
} // namespace calot::bench
