#include "simulation/toml_reader.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace calot::simulation {

std::string read_text(const std::filesystem::path& file, std::size_t most) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw host::UserError(file.string(), "", "can't be opened; check the path and its permissions");
    std::string text(most + 1, '\0');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (in.bad()) throw host::UserError(file.string(), "", "can't be read; check the disk");
    text.resize(static_cast<std::size_t>(in.gcount()));
    if (text.size() > most)
        throw host::UserError(file.string(), "",
                              "is larger than " + std::to_string(most) +
                                  " bytes; shorten it or choose another");
    return text;
}

toml::table parse_toml(std::string_view text, const std::string& file) {
    if (text.size() > (1u << 20)) throw host::UserError(file, "", "is larger than 1 MiB; shorten it");
    if (const std::size_t line = host::line_of_stray_byte(text); line > 0)
        throw host::UserError(file, "line " + std::to_string(line),
                              "has a character outside ASCII that is in no text or comment; remove it");
    try {
        return toml::parse(text, file);
    } catch (const toml::parse_error& error) {
        throw host::UserError(file, "line " + std::to_string(error.source().begin.line),
                              std::string(error.description()) + "; see docs/scenes.md");
    }
}

void TomlReader::refuse(std::string_view key, const std::string& what_and_remedy) const {
    throw host::UserError(file_, prefix_ + std::string(key), what_and_remedy);
}

const toml::node* TomlReader::find(std::string_view key) {
    asked_.emplace(key);
    return table_.get(key);
}

const toml::node& TomlReader::need(std::string_view key) {
    const toml::node* node = find(key);
    if (node == nullptr) refuse(key, "is missing; add it (docs/scenes.md)");
    return *node;
}

double TomlReader::number_of(std::string_view key, const toml::node& node, double least, double most) const {
    if (!node.is_number()) refuse(key, "must be a number");
    const double value =
        node.is_integer() ? static_cast<double>(node.as_integer()->get()) : node.as_floating_point()->get();
    if (!(value >= least && value <= most)) {
        std::ostringstream message;
        message << "is " << value << "; it must lie between " << least << " and " << most;
        refuse(key, message.str());
    }
    return value;
}

double TomlReader::number(std::string_view key, double least, double most) {
    return number_of(key, need(key), least, most);
}

double TomlReader::number(std::string_view key, double least, double most, double otherwise) {
    const toml::node* node = find(key);
    return node == nullptr ? otherwise : number_of(key, *node, least, most);
}

std::int64_t TomlReader::whole(std::string_view key, std::int64_t least, std::int64_t most) {
    const toml::node& node = need(key);
    if (!node.is_integer()) refuse(key, "must be a whole number");
    const std::int64_t value = node.as_integer()->get();
    if (value < least || value > most)
        refuse(key, "is " + std::to_string(value) + "; it must lie between " + std::to_string(least) +
                        " and " + std::to_string(most));
    return value;
}

bool TomlReader::truth(std::string_view key, bool otherwise) {
    const toml::node* node = find(key);
    if (node == nullptr) return otherwise;
    if (!node->is_boolean()) refuse(key, "must be true or false");
    return node->as_boolean()->get();
}

std::string TomlReader::text_of(std::string_view key, const toml::node& node, std::size_t longest) const {
    if (!node.is_string()) refuse(key, "must be a text in quotes");
    const std::string& text = node.as_string()->get();
    if (text.empty() || text.size() > longest)
        refuse(key, "must have 1 to " + std::to_string(longest) + " bytes");
    if (std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
        refuse(key, "must not contain control characters");
    return text;
}

std::string TomlReader::text(std::string_view key, std::size_t longest) {
    return text_of(key, need(key), longest);
}

std::string TomlReader::text(std::string_view key, const std::string& otherwise, std::size_t longest) {
    const toml::node* node = find(key);
    return node == nullptr ? otherwise : text_of(key, *node, longest);
}

std::string TomlReader::word_of(std::string_view key, const toml::node& node) const {
    std::string text = text_of(key, node, 60);
    if (!std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; }))
        refuse(key, "must consist of lower-case letters, digits and hyphens");
    return text;
}

std::string TomlReader::word(std::string_view key) {
    return word_of(key, need(key));
}

std::string TomlReader::word(std::string_view key, const std::string& otherwise) {
    const toml::node* node = find(key);
    return node == nullptr ? otherwise : word_of(key, *node);
}

std::vector<std::string> TomlReader::words(std::string_view key, std::size_t most) {
    std::vector<std::string> found;
    const toml::node* node = find(key);
    if (node == nullptr) return found;
    if (!node->is_array()) refuse(key, "must be a list of texts");
    if (node->as_array()->size() > most) refuse(key, "has more than " + std::to_string(most) + " entries");
    for (const toml::node& item : *node->as_array())
        found.push_back(word_of(key, item));
    return found;
}

std::vector<double> TomlReader::numbers(std::string_view key, std::size_t count, double least, double most,
                                        bool is_exact) {
    const toml::node& node = need(key);
    if (!node.is_array()) refuse(key, "must be a list of numbers");
    const toml::array& array = *node.as_array();
    if (is_exact ? array.size() != count : array.size() > count)
        refuse(key,
               "must have " + std::string(is_exact ? "" : "at most ") + std::to_string(count) + " numbers");
    std::vector<double> values;
    for (const toml::node& item : array)
        values.push_back(number_of(key, item, least, most));
    return values;
}

std::vector<double> TomlReader::points(std::string_view key, std::size_t most, double least, double highest) {
    const toml::node& node = need(key);
    if (!node.is_array()) refuse(key, "must be a list of points [x, y, z]");
    const toml::array& array = *node.as_array();
    if (array.size() < 2 || array.size() > most)
        refuse(key, "must have 2 to " + std::to_string(most) + " points");
    std::vector<double> values;
    for (const toml::node& point : array) {
        if (!point.is_array() || point.as_array()->size() != 3)
            refuse(key, "must be a list of points [x, y, z]");
        for (const toml::node& item : *point.as_array())
            values.push_back(number_of(key, item, least, highest));
    }
    return values;
}

const toml::table& TomlReader::table(std::string_view key) {
    const toml::node& node = need(key);
    if (!node.is_table()) refuse(key, "must be a table");
    return *node.as_table();
}

const toml::table* TomlReader::find_table(std::string_view key) {
    const toml::node* node = find(key);
    if (node != nullptr && !node->is_table()) refuse(key, "must be a table");
    return node == nullptr ? nullptr : node->as_table();
}

std::vector<const toml::table*> TomlReader::tables(std::string_view key, std::size_t most) {
    std::vector<const toml::table*> found;
    const toml::node* node = find(key);
    if (node == nullptr) return found;
    if (!node->is_array()) refuse(key, "must be a list of tables");
    if (node->as_array()->size() > most) refuse(key, "has more than " + std::to_string(most) + " entries");
    for (const toml::node& item : *node->as_array()) {
        if (!item.is_table()) refuse(key, "must be a list of tables");
        found.push_back(item.as_table());
    }
    return found;
}

void TomlReader::finish() const {
    for (auto&& [key, value] : table_)
        if (!asked_.contains(key.str())) refuse(key.str(), "is unknown; remove it or correct its name");
}

} // namespace calot::simulation
