#include "fitting/bench_table.hpp"

#include "host/error.hpp"
#include "simulation/toml_reader.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

namespace calot::fitting {

namespace {

constexpr std::size_t most_columns = 32, longest_cell = 64;

struct Column {
    std::string_view name;
    double least, most; // of its numbers
};

constexpr std::array columns{Column{"span", 0.01, 5},    Column{"deflection", -1, 1},
                             Column{"force", -1e4, 1e4}, Column{"length", 0.01, 5},
                             Column{"angle", -100, 100}, Column{"torque", -1e3, 1e3},
                             Column{"time", -1e6, 1e6},  Column{"amplitude", 1e-9, 1e6}};

const Column& column(std::string_view name) {
    return *std::find_if(columns.begin(), columns.end(), [&](const Column& c) { return c.name == name; });
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view blanks = " \t\r";
    const std::size_t first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

// For messages: what was read, without what a terminal would act on.
std::string shown(std::string_view cell) {
    std::string text;
    for (const char c : cell.substr(0, 24))
        text += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
    return "\"" + text + (cell.size() > 24 ? "...\"" : "\"");
}

class Parser {
  public:
    Parser(const std::string& file) : file_(file) {}

    [[noreturn]] void refuse(const std::string& field, const std::string& what) const {
        throw host::UserError(file_, "line " + std::to_string(line_) + (field.empty() ? "" : ": " + field),
                              what);
    }

    void line(std::string_view text) {
        ++line_;
        const std::string_view content = trimmed(text);
        if (content.empty() || content[0] == '#') return;
        std::vector<std::string_view> cells;
        for (std::size_t begin = 0;;) {
            const std::size_t comma = content.find(',', begin);
            cells.push_back(trimmed(content.substr(begin, comma - begin)));
            if (cells.back().size() > longest_cell)
                refuse("column " + std::to_string(cells.size()), "holds more than 64 bytes; shorten it");
            if (cells.size() > most_columns) refuse("", "has more than 32 columns; remove some");
            if (comma == std::string_view::npos) break;
            begin = comma + 1;
        }
        if (header_.empty())
            header(cells);
        else
            row(cells);
    }

    std::vector<Reading> take() {
        if (header_.empty()) {
            ++line_;
            refuse("", "there is no line with the columns' names; begin with test,segment,...");
        }
        if (readings_.empty()) refuse("", "no row follows the columns' names; add what was measured");
        return std::move(readings_);
    }

  private:
    void header(const std::vector<std::string_view>& cells) {
        for (const std::string_view cell : cells) {
            const bool is_known =
                cell == "test" || cell == "segment" ||
                std::any_of(columns.begin(), columns.end(), [&](const Column& c) { return c.name == cell; });
            if (!is_known)
                refuse(shown(cell),
                       "is no column; use test, segment, span, deflection, force, length, angle, "
                       "torque, time, amplitude");
            if (!header_.emplace(cell, header_.size()).second)
                refuse(shown(cell), "stands twice; remove one");
        }
        for (const char* needed : {"test", "segment"})
            if (!header_.contains(std::string(needed)))
                refuse(needed, "is missing among the columns; add it");
        width_ = cells.size();
    }

    std::string_view cell(const std::vector<std::string_view>& cells, std::string_view name) const {
        const auto found = header_.find(name);
        if (found == header_.end())
            refuse(std::string(name), "is missing among the columns, and this row's test needs it; add it");
        return cells[found->second];
    }

    double number(const std::vector<std::string_view>& cells, std::string_view name) const {
        const std::string_view text = cell(cells, name);
        const Column& c = column(name);
        double value = std::numeric_limits<double>::quiet_NaN();
        const char* end = text.data() + text.size();
        const auto result = std::from_chars(text.data(), end, value);
        if (text.empty() || result.ec != std::errc() || result.ptr != end || !std::isfinite(value))
            refuse(std::string(name), (text.empty() ? "is empty" : "is " + shown(text)) +
                                          "; give a number with a decimal point, in SI units");
        if (value < c.least || value > c.most) {
            std::ostringstream message;
            message << "is " << value << "; it must lie between " << c.least << " and " << c.most
                    << " (SI units)";
            refuse(std::string(name), message.str());
        }
        return value;
    }

    void row(const std::vector<std::string_view>& cells) {
        if (cells.size() != width_)
            refuse("", "has " + std::to_string(cells.size()) + " columns, the first line " +
                           std::to_string(width_) + "; correct it");
        if (readings_.size() == most_readings) refuse("", "is one more than 20000 rows; leave some out");
        Reading r;
        r.line = line_;
        r.segment = cell(cells, "segment");
        const bool is_word =
            !r.segment.empty() && std::all_of(r.segment.begin(), r.segment.end(), [](char c) {
                return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
            });
        if (!is_word)
            refuse("segment", "is " + shown(r.segment) +
                                  "; give a datasheet's segment by its name: lower-case "
                                  "letters, digits and hyphens");
        const std::string_view test = cell(cells, "test");
        const auto take = [&](BenchTest which, std::initializer_list<std::string_view> needed) {
            r.test = which;
            for (const auto& [name, place] : header_)
                if (name != "test" && name != "segment" && !cells[place].empty() &&
                    std::find(needed.begin(), needed.end(), name) == needed.end())
                    refuse(name,
                           "is filled, but " + std::string(test) + " has no use for it; leave it empty");
            std::array<double, 3> values{};
            std::size_t k = 3 - needed.size();
            for (const std::string_view name : needed)
                values[k++] = number(cells, name);
            r.size = values[0], r.x = values[1], r.load = values[2];
        };
        if (test == "bend")
            take(BenchTest::bend, {"span", "deflection", "force"});
        else if (test == "twist")
            take(BenchTest::twist, {"length", "angle", "torque"});
        else if (test == "vibration")
            take(BenchTest::vibration, {"time", "amplitude"});
        else
            refuse("test", "is " + shown(test) + "; use bend, twist or vibration");
        readings_.push_back(std::move(r));
    }

    const std::string& file_;
    int line_ = 0;
    std::map<std::string, std::size_t, std::less<>> header_;
    std::size_t width_ = 0;
    std::vector<Reading> readings_;
};

} // namespace

const char* name(BenchTest test) {
    return test == BenchTest::bend ? "bend" : test == BenchTest::twist ? "twist" : "vibration";
}

std::vector<Reading> parse_bench_table(std::string_view text, const std::string& file) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3); // as spreadsheets write it
    Parser parser(file);
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        parser.line(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return parser.take();
}

std::vector<Reading> read_bench_table(const std::filesystem::path& file) {
    return parse_bench_table(simulation::read_text(file, 4u << 20), file.string());
}

} // namespace calot::fitting
