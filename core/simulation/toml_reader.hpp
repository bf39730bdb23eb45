// Strict reading of the TOML files that people write: every key is asked for once, what was not asked for is
// an error, and every error is one line "FILE: FIELD: what; remedy" (host::UserError).
#pragma once

#include "host/error.hpp"
#include "host/toml.hpp"

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace calot::simulation {

/// Whole text of a file of at most `most` bytes.
std::string read_text(const std::filesystem::path& file, std::size_t most = 1 << 20);

/// Parses; a syntax error names the line.
toml::table parse_toml(std::string_view text, const std::string& file);

class TomlReader {
  public:
    /// `prefix`: of the fields in messages ("shaft."). `source`, the place of a figure's origin, is allowed
    /// in every table. The table and file must outlive the reader.
    TomlReader(const std::string& file, std::string prefix, const toml::table& table)
        : file_(file), prefix_(std::move(prefix)), table_(table), asked_{"source"} {}

    [[noreturn]] void refuse(std::string_view key, const std::string& what_and_remedy) const;

    bool has(std::string_view key) const { return table_.contains(key); }

    double number(std::string_view key, double least, double most);
    double number(std::string_view key, double least, double most, double otherwise);
    std::int64_t whole(std::string_view key, std::int64_t least, std::int64_t most);
    bool truth(std::string_view key, bool otherwise);
    std::string text(std::string_view key, std::size_t longest = 200);
    std::string text(std::string_view key, const std::string& otherwise, std::size_t longest = 200);
    /// Lower-case letters, digits and hyphens: what names files, organs, landmarks.
    std::string word(std::string_view key);
    std::string word(std::string_view key, const std::string& otherwise);
    std::vector<std::string> words(std::string_view key, std::size_t most);
    /// Exactly `count` numbers, or at most when `is_exact` is false.
    std::vector<double> numbers(std::string_view key, std::size_t count, double least, double most,
                                bool is_exact = true);
    /// Points of three coordinates each, interleaved.
    std::vector<double> points(std::string_view key, std::size_t most, double least, double highest);

    const toml::table& table(std::string_view key);
    /// Null when there is none; an empty list when there is none.
    const toml::table* find_table(std::string_view key);
    std::vector<const toml::table*> tables(std::string_view key, std::size_t most);
    const toml::node* find(std::string_view key);

    /// Must come last: refuses keys that were not asked for.
    void finish() const;
    const std::string& file() const { return file_; }
    const std::string& prefix() const { return prefix_; }

  private:
    const toml::node& need(std::string_view key);
    double number_of(std::string_view key, const toml::node& node, double least, double most) const;
    std::string text_of(std::string_view key, const toml::node& node, std::size_t longest) const;
    std::string word_of(std::string_view key, const toml::node& node) const;

    const std::string& file_;
    std::string prefix_;
    const toml::table& table_;
    std::set<std::string, std::less<>> asked_;
};

} // namespace calot::simulation
