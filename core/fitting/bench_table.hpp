// What was measured on the bench: a CSV with one row a reading.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace calot::fitting {

enum class BenchTest { bend, twist, vibration };

const char* name(BenchTest test);

/// One row. `x` and `load` by test: deflection (m) and force (N) at mid-span; angle (rad) and torque (N m);
/// time (s) and amplitude of a peak (any unit). `size` (m): span, length, nothing.
struct Reading {
    int line = 0; // in the file, from 1
    BenchTest test = BenchTest::bend;
    std::string segment;
    double size = 0, x = 0, load = 0;
};

constexpr std::size_t most_readings = 20'000;

/// Columns test, segment, span, deflection, force, length, angle, torque, time, amplitude, in any order;
/// those that no test in the file needs may be missing, cells that a row's test does not need may be empty.
/// Lines that begin with # and empty ones are left out. Throws host::UserError: "FILE: line N: COLUMN: what;
/// remedy".
std::vector<Reading> parse_bench_table(std::string_view text, const std::string& file);
std::vector<Reading> read_bench_table(const std::filesystem::path& file);

} // namespace calot::fitting
