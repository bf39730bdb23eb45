#include "fields.hpp"

#include <algorithm>
#include <cmath>

namespace calot::mesher {
namespace {

std::string shown(double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", v);
    return text;
}

} // namespace

void Fields::fail(std::string_view key, const std::string& what) const {
    const toml::node* at = key.empty() ? nullptr : table_->get(key);
    const auto line = at ? at->source().begin.line : table_->source().begin.line;
    std::string field = where_;
    if (!key.empty()) field += (field.empty() ? "" : ".") + std::string(key);
    throw DescriptionError(file_ + ":" + std::to_string(line) + ": " + (field.empty() ? "" : field + ": ") +
                           what);
}

const toml::node& Fields::node(std::string_view key) {
    known_.emplace_back(key);
    const toml::node* found = table_->get(key);
    if (!found) fail("", "'" + std::string(key) + "' is missing: add it");
    return *found;
}

double Fields::checked(const toml::node& node, std::string_view key, double low, double high) const {
    const auto v = node.value<double>();
    if (!v || !node.is_number())
        fail(key, "not a number: give one from " + shown(low) + " to " + shown(high));
    if (!(*v >= low && *v <= high))
        fail(key, shown(*v) + " is out of bounds: give a number from " + shown(low) + " to " + shown(high));
    return *v;
}

std::string Fields::text(std::string_view key) {
    const auto v = node(key).value<std::string>();
    if (!v || v->empty() || v->size() > 200) fail(key, "not a text of 1 to 200 characters");
    return *v;
}

std::string Fields::text_or(std::string_view key, const std::string& otherwise) {
    known_.emplace_back(key);
    return has(key) ? text(key) : otherwise;
}

double Fields::number(std::string_view key, double low, double high) {
    return checked(node(key), key, low, high);
}

double Fields::number_or(std::string_view key, double low, double high, double otherwise) {
    known_.emplace_back(key);
    return has(key) ? number(key, low, high) : otherwise;
}

std::int64_t Fields::integer(std::string_view key, std::int64_t low, std::int64_t high) {
    const toml::node& n = node(key);
    const auto v = n.value<std::int64_t>();
    if (!n.is_integer() || !v || *v < low || *v > high)
        fail(key, "not a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    return *v;
}

std::int64_t Fields::integer_or(std::string_view key, std::int64_t low, std::int64_t high,
                                std::int64_t otherwise) {
    known_.emplace_back(key);
    return has(key) ? integer(key, low, high) : otherwise;
}

Vec Fields::vec(std::string_view key, double low, double high) {
    const toml::array* a = node(key).as_array();
    if (!a || a->size() != 3) fail(key, "not three numbers: write [x, y, z]");
    return {checked((*a)[0], key, low, high), checked((*a)[1], key, low, high),
            checked((*a)[2], key, low, high)};
}

Vec Fields::vec_or(std::string_view key, double low, double high, Vec otherwise) {
    known_.emplace_back(key);
    return has(key) ? vec(key, low, high) : otherwise;
}

Vec Fields::vec_or_number(std::string_view key, double low, double high) {
    if (node(key).is_array()) return vec(key, low, high);
    const double v = number(key, low, high);
    return {v, v, v};
}

std::vector<std::string> Fields::texts(std::string_view key) {
    const toml::node& n = node(key);
    if (n.is_string()) return {text(key)};
    const toml::array* a = n.as_array();
    if (!a || a->empty() || a->size() > 400) fail(key, "not a text or a list of 1 to 400 texts");
    std::vector<std::string> out;
    for (const auto& each : *a) {
        const auto v = each.value<std::string>();
        if (!v || v->empty() || v->size() > 400) fail(key, "an entry is not a text of 1 to 400 characters");
        out.push_back(*v);
    }
    return out;
}

std::vector<std::vector<double>> Fields::rows(std::string_view key, std::size_t most) {
    const toml::array* a = node(key).as_array();
    if (!a || a->empty() || a->size() > most)
        fail(key, "not a list of 1 to " + std::to_string(most) + " lists of numbers");
    std::vector<std::vector<double>> out;
    for (const auto& each : *a) {
        const toml::array* row = each.as_array();
        if (!row || row->size() > 16)
            fail(key, "entry " + std::to_string(out.size() + 1) + " is not a list of numbers");
        out.emplace_back();
        for (const auto& v : *row)
            out.back().push_back(checked(v, key, -5000, 5000));
    }
    return out;
}

const toml::array& Fields::tables(std::string_view key) {
    const toml::array* a = node(key).as_array();
    if (!a || a->empty() || a->size() > 1000 || !a->is_array_of_tables())
        fail(key, "not a list of tables: write [[" + std::string(key) + "]] before each");
    return *a;
}

void Fields::finish() const {
    for (const auto& [key, value] : *table_) {
        if (std::find(known_.begin(), known_.end(), key.str()) != known_.end()) continue;
        std::string list;
        for (const auto& k : known_)
            if (list.find(k) == std::string::npos) list += (list.empty() ? "" : ", ") + k;
        fail(key.str(), "unknown key: remove it, or use one of " + list);
    }
}

} // namespace calot::mesher
