#pragma once

#include "bench/bench_rod.hpp"
#include "bench/row.hpp"

#include <span>
#include <string_view>
#include <vector>

namespace calot::bench {

/// Which of the options that not every problem has a use for a problem takes. Nodes, dt, EI, GJ, length,
/// radius and mass per length are every rod's.
struct Takes {
    bool load = false, friction = false, angle = false, seed = false;
    bool duration = false; ///< and anatomy and endoscope
};

/// A reference problem for rods. `docs/rods.md` says where each reference comes from.
struct RodProblem {
    std::string_view id;
    std::string_view what;
    std::vector<Row> (*run)(const MakeInstance& make, const RodOptions& options);
    Takes takes;
    std::string_view explanation; ///< for --help: the scene, what --load and the like mean, what is measured
    std::string_view example;     ///< arguments after "calot bench rod"
};

std::span<const RodProblem> rod_problems();
/// Null if there is none of this name.
const RodProblem* find_rod_problem(std::string_view id);

// rod_statics.cpp
std::vector<Row> run_rest(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_cantilever(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_elastica(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_heavy(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_circle(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_twist(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_refine(const MakeInstance& make, const RodOptions& options);
// rod_dynamics.cpp
std::vector<Row> run_rotate(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_energy(const MakeInstance& make, const RodOptions& options);
// rod_instability.cpp
std::vector<Row> run_buckle(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_ring(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_loop(const MakeInstance& make, const RodOptions& options);
// rod_contacts.cpp
std::vector<Row> run_compress(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_capstan(const MakeInstance& make, const RodOptions& options);
std::vector<Row> run_hang_on(const MakeInstance& make, const RodOptions& options);
// rod_press.cpp
std::vector<Row> run_press(const MakeInstance& make, const RodOptions& options);
// rod_torque.cpp
std::vector<Row> run_torque_lag(const MakeInstance& make, const RodOptions& options);
// rod_soak.cpp
std::vector<Row> run_push_soak(const MakeInstance& make, const RodOptions& options);

/// A row with the relative error against `reference`, and with an absolute one.
Row relative_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
                 double measured, double reference, double bound, std::string setting = {});
Row absolute_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
                 double measured, double reference, double error, double bound, std::string setting = {});
/// A row that is printed and not judged.
Row plain_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
              double measured, std::string setting = {});
/// Whether something that must happen did: measured 1 or 0 against 1.
Row happens_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
                bool does, std::string setting = {});

/// "name=1.5"
std::string setting(const char* name, double value);

} // namespace calot::bench
