#pragma once

#include "description.hpp"

// toml++ 3.3 asserts what it then reports as an error of the file: in debug builds a broken key would abort.
#define TOML_ASSERT(expr) static_cast<void>(0)
#include <toml++/toml.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace calot::mesher {

/// A TOML table that is read key by key, each with its bounds, and that knows its unread keys.
class Fields {
  public:
    Fields(const toml::table& table, std::string file, std::string where)
        : table_(&table), file_(std::move(file)), where_(std::move(where)) {}

    [[noreturn]] void fail(std::string_view key, const std::string& what) const;
    bool has(std::string_view key) const { return table_->contains(key); }

    std::string text(std::string_view key);
    std::string text_or(std::string_view key, const std::string& otherwise);
    double number(std::string_view key, double low, double high);
    double number_or(std::string_view key, double low, double high, double otherwise);
    std::int64_t integer(std::string_view key, std::int64_t low, std::int64_t high);
    std::int64_t integer_or(std::string_view key, std::int64_t low, std::int64_t high,
                            std::int64_t otherwise);
    Vec vec(std::string_view key, double low, double high);
    Vec vec_or(std::string_view key, double low, double high, Vec otherwise);
    /// A number for all three axes, or three numbers.
    Vec vec_or_number(std::string_view key, double low, double high);
    /// A string, or an array of strings; not empty.
    std::vector<std::string> texts(std::string_view key);
    /// An array of arrays of numbers.
    std::vector<std::vector<double>> rows(std::string_view key, std::size_t most);
    const toml::array& tables(std::string_view key);

    /// Fails on the first key that was not asked for.
    void finish() const;

    /// How messages name this table from now on.
    void rename(std::string where) { where_ = std::move(where); }

  private:
    const toml::node& node(std::string_view key);
    double checked(const toml::node& node, std::string_view key, double low, double high) const;

    const toml::table* table_;
    std::string file_, where_;
    std::vector<std::string> known_;
};

} // namespace calot::mesher
