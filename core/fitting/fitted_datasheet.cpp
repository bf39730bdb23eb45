#include "fitting/fitted_datasheet.hpp"

#include "host/error.hpp"
#include "simulation/endoscope_datasheet.hpp"
#include "simulation/toml_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace calot::fitting {

namespace {

double rounded(double value, double half_width) {
    // To a hundredth of the confidence: more digits say nothing.
    if (!(half_width > 0) || !std::isfinite(half_width)) return value;
    const double unit = std::pow(10.0, std::floor(std::log10(half_width)) - 1);
    double decimal = std::round(value / unit) * unit; // 0.10450000000000001
    char text[40];
    const auto end = std::to_chars(text, text + sizeof text, decimal, std::chars_format::general, 12).ptr;
    std::from_chars(text, end, decimal);
    return decimal;
}

std::string source(const std::string& table, const Figure& figure, const SegmentFit& fit) {
    std::ostringstream text;
    text << "fitted to " << table << ": -+ " << std::setprecision(2) << figure.half_width << " (95 %), "
         << fit.used << " readings";
    return text.str();
}

// The formatter writes 0.7 as 0.69999999999999996: each number outside of quotes in its shortest form.
std::string tidied(const std::string& toml) {
    std::string out;
    char quote = 0;
    for (std::size_t i = 0; i < toml.size();) {
        const char c = toml[i];
        if (quote != 0 || c == '\'' || c == '"') {
            if (quote == 0)
                quote = c;
            else if (c == '\\' && quote == '"' && i + 1 < toml.size())
                out += toml[i++];
            else if (c == quote)
                quote = 0;
            out += toml[i++];
            continue;
        }
        const std::size_t end = std::min(toml.find_first_not_of("0123456789.e+-", i), toml.size());
        double value = 0;
        const bool is_number =
            end > i && std::from_chars(&toml[i], &toml[i] + (end - i), value).ptr == &toml[i] + (end - i) &&
            toml.substr(i, end - i).find('.') != std::string::npos;
        if (is_number) {
            char text[40];
            std::string shortest(text, std::to_chars(text, text + sizeof text, value).ptr);
            if (shortest.find_first_of(".e") == std::string::npos) shortest += ".0";
            out += shortest;
        } else {
            out += toml.substr(i, std::max<std::size_t>(end - i, 1));
        }
        i += std::max<std::size_t>(end - i, 1);
    }
    return out;
}

class Writer {
  public:
    Writer(toml::table& root, std::string base, std::string table)
        : root_(root), base_(std::move(base)), table_(std::move(table)) {}

    toml::table& segment(const std::string& name) {
        std::string known;
        for (toml::node& node : *root_["segment"].as_array()) {
            toml::table& table = *node.as_table();
            const std::string here = table["name"].value_or(std::string());
            if (here == name) return table;
            known += (known.empty() ? "" : ", ") + here;
        }
        throw host::UserError(table_, "segment",
                              "\"" + name + "\" is no segment of " + base_ + "; it has " + known);
    }

    void set(toml::table& table, const std::string& key, const Figure& figure, const SegmentFit& fit) {
        table.insert_or_assign(key, rounded(figure.value, figure.half_width));
        if (!table["source"].is_table()) table.insert_or_assign("source", toml::table{});
        table["source"].as_table()->insert_or_assign(key, source(table_, figure, fit));
    }

  private:
    toml::table& root_;
    std::string base_, table_;
};

} // namespace

FittedDatasheet fitted_datasheet(const std::vector<SegmentFit>& fits, const std::filesystem::path& base,
                                 const std::string& table) {
    const std::string text = simulation::read_text(base);
    simulation::parse_endoscope(text, base.string()); // sound before anything is replaced in it
    toml::table root = simulation::parse_toml(text, base.string());
    Writer writer(root, base.string(), table);
    FittedDatasheet result;
    double asymmetry = 0;
    const SegmentFit* widest = nullptr; // of asymmetry: the surest
    for (const SegmentFit& f : fits) {
        toml::table& segment = writer.segment(f.segment);
        if (f.test == BenchTest::bend) writer.set(segment, "flexural_rigidity", f.rigidity, f);
        if (f.test == BenchTest::twist) {
            const bool is_both = !std::isnan(f.right.value);
            writer.set(segment, "torsional_rigidity", is_both ? f.right : f.rigidity, f);
            if (is_both && (widest == nullptr || f.used > widest->used)) {
                widest = &f;
                asymmetry = 1 - f.left.value / f.right.value;
            }
        }
        if (f.test == BenchTest::vibration) {
            if (f.damping.value <= simulation::most_bending_damping) {
                writer.set(segment, "bending_damping", f.damping, f);
                continue;
            }
            std::ostringstream note;
            note << std::setprecision(3) << "bending_damping of " << f.segment << " is " << f.damping.value
                 << " s, more than a datasheet may hold (" << simulation::most_bending_damping
                 << " s): a sheath does not lose so much; it stays as it was. Clamp the segment shorter, so "
                    "that it swings faster and loses less to the air and the clamp, and read again; or give "
                    "the same decay as drag = "
                 << 2 * f.decay.value << " 1/s";
            result.notes.push_back(note.str());
        }
    }
    if (widest != nullptr) {
        const double spread = std::hypot(widest->left.half_width / widest->right.value,
                                         widest->right.half_width * widest->left.value /
                                             (widest->right.value * widest->right.value));
        if (asymmetry >= 0 && asymmetry <= 0.5)
            writer.set(*root["torque"].as_table(), "asymmetry", {asymmetry, spread}, *widest);
        else
            result.notes.push_back(
                "GJ is lower for positive angles than for negative ones, or by more than a "
                "half; [torque] asymmetry stays as it was: let positive be the stiffer way");
    }
    std::ostringstream out;
    out << "# Made by `calot fit endoscope` from " << table << " and " << base.filename().string()
        << ". Comments of the latter are not kept.\n"
        << root << '\n';
    result.text = tidied(out.str());
    simulation::parse_endoscope(result.text, "the fitted datasheet");
    return result;
}

} // namespace calot::fitting
