// The metrics of a finished case, read from its files for the table that the launcher shows.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace calot::launcher {

/// Rows of fields, by RFC 4180: comma, quotes doubled inside quotes, CRLF or LF. Throws std::runtime_error
/// (line number, without file) for an unclosed quote, or more than a million fields.
std::vector<std::vector<std::string>> parse_csv(std::string_view text);

struct Result {
    std::string id, title, unit, definition;
    std::string task;  // empty: of the whole case
    std::string value; // as written; empty: not measured
};

/// metrics.csv (a header row and one row) joined with metrics-dictionary.csv of the case's folder. Columns
/// that the dictionary does not have are shown under their own name. Throws std::runtime_error: file and what
/// is wrong with it.
std::vector<Result> read_results(const std::filesystem::path& folder);

} // namespace calot::launcher
