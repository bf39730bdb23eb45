#include "bench/row.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace calot::bench {

namespace {

// The shortest text that reads back as the same number, or with so many digits; nothing for what is no
// number.
std::string number(double v, int digits = 0) {
    if (!std::isfinite(v)) return "";
    char text[40];
    const auto result = digits == 0
                            ? std::to_chars(text, text + sizeof text, v)
                            : std::to_chars(text, text + sizeof text, v, std::chars_format::general, digits);
    return {text, result.ptr};
}

std::string error_text(const Row& r, int digits = 0) {
    return std::isinf(r.error) ? "inf" : number(r.error, digits);
}

std::string met_text(const Row& r) {
    if (!r.is_suited) return "unsuited";
    if (std::isinf(r.bound)) return "-";
    if (r.met()) return "yes";
    return r.is_claimed ? "NO" : "no (not claimed)";
}

// "org.calot.rod-direct" is plain enough as "rod-direct".
std::string short_name(const std::string& id) {
    return id.substr(id.rfind('.') + 1);
}

const std::vector<std::string> titles{"problem",  "model",     "nodes", "setting", "quantity",
                                      "measured", "reference", "error", "bound",   "met"};

std::vector<std::string> cells(const Row& r) {
    return {r.problem,
            short_name(r.model),
            std::to_string(r.nodes),
            r.setting,
            r.quantity,
            number(r.measured, 7),
            number(r.reference, 7),
            error_text(r, 3),
            number(r.bound, 3),
            met_text(r)};
}

void write_line(std::ostream& out, const std::vector<std::string>& line,
                const std::vector<std::size_t>& width) {
    std::string text;
    for (std::size_t k = 0; k < line.size(); ++k) {
        const std::string pad(width[k] - line[k].size(), ' ');
        const bool is_number = k == 2 || (k >= 5 && k <= 8);
        text += (is_number ? pad + line[k] : line[k] + pad) + "  ";
    }
    text.erase(text.find_last_not_of(' ') + 1);
    out << text << '\n';
}

void write_csv_header(std::ostream& out) {
    out << "problem,model,nodes,dt,quantity,measured,reference,error,bound,met\n";
}

void write_csv_line(std::ostream& out, const Row& r) {
    out << r.problem << ',' << r.model << ',' << r.nodes << ',' << number(r.dt) << ',' << r.quantity << ','
        << number(r.measured) << ',' << number(r.reference) << ',' << error_text(r) << ',' << number(r.bound)
        << ','
        << (!r.is_suited ? "unsuited"
            : r.met()    ? "true"
                         : "false")
        << '\n';
}

} // namespace

void write_csv(std::ostream& out, std::span<const Row> rows) {
    write_csv_header(out);
    for (const Row& r : rows)
        write_csv_line(out, r);
}

void write_table(std::ostream& out, std::span<const Row> rows) {
    RowPrinter(out, false).print(rows);
}

void RowPrinter::print(std::span<const Row> rows) {
    if (is_csv_) {
        if (!is_begun_) write_csv_header(out_);
        for (const Row& r : rows)
            write_csv_line(out_, r);
    } else {
        std::vector<std::vector<std::string>> lines;
        if (!is_begun_) lines.push_back(titles);
        for (const Row& r : rows)
            lines.push_back(cells(r));
        width_.resize(titles.size(), 0);
        for (const auto& line : lines)
            for (std::size_t k = 0; k < line.size(); ++k)
                width_[k] = std::max(width_[k], line[k].size());
        for (const auto& line : lines)
            write_line(out_, line, width_);
    }
    is_begun_ = true;
    out_ << std::flush;
}

} // namespace calot::bench
