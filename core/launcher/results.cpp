#include "launcher/results.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <stdexcept>

namespace calot::launcher {
namespace {

constexpr std::size_t kMostBytes = 4u << 20, kMostFields = 1'000'000;

std::string read_bounded(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw std::runtime_error(file.string() + ": cannot be read");
    std::string text(kMostBytes + 1, '\0');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMostBytes) throw std::runtime_error(file.string() + ": is larger than 4 MiB");
    return text;
}

std::vector<std::vector<std::string>> read_table(const std::filesystem::path& file) {
    try {
        return parse_csv(read_bounded(file));
    } catch (const std::runtime_error& error) {
        const std::string what = error.what();
        throw std::runtime_error(what.starts_with(file.string()) ? what : file.string() + ": " + what);
    }
}

} // namespace

std::vector<std::vector<std::string>> parse_csv(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    std::vector<std::vector<std::string>> rows;
    std::vector<std::string> row;
    std::string field;
    bool quoted = false, any = false;
    std::size_t line = 1, count = 0;
    const auto end_field = [&] {
        if (++count > kMostFields) throw std::runtime_error("more than a million fields");
        row.push_back(std::move(field));
        field.clear();
    };
    const auto end_row = [&] {
        if (any) {
            end_field();
            rows.push_back(std::move(row));
        }
        row.clear();
        any = false;
    };
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '\n') ++line;
        if (quoted) {
            if (c != '"')
                field += c;
            else if (i + 1 < text.size() && text[i + 1] == '"')
                field += text[++i];
            else
                quoted = false;
        } else if (c == '"' && field.empty()) {
            quoted = any = true;
        } else if (c == ',') {
            any = true;
            end_field();
        } else if (c == '\n') {
            end_row();
        } else if (c != '\r') {
            any = true;
            field += c;
        }
    }
    if (quoted) throw std::runtime_error("line " + std::to_string(line) + ": a quote is not closed");
    end_row();
    return rows;
}

std::vector<Result> read_results(const std::filesystem::path& folder) {
    const auto values = read_table(folder / "metrics.csv");
    if (values.size() < 2)
        throw std::runtime_error((folder / "metrics.csv").string() +
                                 ": needs a header row and a row of values");
    const auto dictionary = read_table(folder / "metrics-dictionary.csv");

    // The dictionary's columns by name; its first one names the metric.
    std::map<std::string, std::size_t> column;
    if (!dictionary.empty())
        for (std::size_t i = 0; i < dictionary[0].size(); ++i)
            column.emplace(dictionary[0][i], i);
    const auto cell = [&](const std::vector<std::string>& row, const char* name) {
        const auto at = column.find(name);
        return at != column.end() && at->second < row.size() ? row[at->second] : std::string();
    };
    std::map<std::string, const std::vector<std::string>*> known;
    for (std::size_t i = 1; i < dictionary.size(); ++i)
        if (!dictionary[i].empty()) known.emplace(dictionary[i][0], &dictionary[i]);

    std::vector<Result> out;
    for (std::size_t i = 0; i < values[0].size(); ++i) {
        Result r;
        r.id = values[0][i];
        r.value = i < values[1].size() ? values[1][i] : std::string();
        if (const auto at = known.find(r.id); at != known.end()) {
            r.title = cell(*at->second, "title");
            r.unit = cell(*at->second, "unit");
            r.definition = cell(*at->second, "definition");
            r.task = cell(*at->second, "task");
        }
        if (r.title.empty()) { // "tip_path" reads better as "Tip path"
            r.title = r.id;
            std::replace(r.title.begin(), r.title.end(), '_', ' ');
            if (!r.title.empty() && r.title[0] >= 'a' && r.title[0] <= 'z')
                r.title[0] = static_cast<char>(r.title[0] - 'a' + 'A');
        }
        out.push_back(std::move(r));
    }
    return out;
}

} // namespace calot::launcher
