// All rod models beside each other: what a simulated millisecond costs, and what it is worth.
#pragma once

#include "bench/rod_vessel.hpp"
#include "bench/row.hpp"

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

namespace calot::bench {

struct CompareOptions {
    std::vector<int> nodes{25, 50, 100, 200, 400, 1000};
    double patience =
        20; ///< s of processor time for one number; what would take longer is skipped, and said so
    std::filesystem::path folder; ///< for compare.png, compare.svg and compare.csv; empty: none
    bool has_peers = true;        ///< chains of other engines, where their programs lie beside this one
};

/// The rod: 1 m, radius 6 mm, 0.15 kg/m, w L^3/EI = 5 (EI = 0.2943 N m^2), GJ = 2/3 EI; the options' numbers
/// instead where they are given. Columns of the table: processor time of a simulated millisecond swinging
/// free and with 20 frictional contacts, and both in plain 6x6 block-tridiagonal solves of 99 blocks timed in
/// between (floors.hpp); stretch under a push of 0.2 m against a held tip; errors of elastica (P L^2/EI = 5)
/// and heavy (w L^3/EI = 5); damping ratio of the first mode. `progress` is told what is being measured.
/// Returns the rows for CSV, with the bounds that docs/rods.md gives, where they belong to a model.
std::vector<Row> compare_rods(const std::vector<VesselModel>& models, const RodOptions& options,
                              const CompareOptions& compare, std::ostream& progress);
/// The rows as one line for each model and number of nodes.
void write_comparison(std::ostream& out, const std::vector<Row>& rows);

} // namespace calot::bench
