#include "rendering/appearance.hpp"

#include "host/toml.hpp"

#include <set>
#include <stdexcept>
#include <string_view>

namespace calot::rendering {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& entry,
                         const std::string& field, const std::string& what) {
    throw std::runtime_error(file.string() + ": [" + entry + "] " + field + " " + what);
}

class Reader {
  public:
    Reader(const std::filesystem::path& file, std::string entry, const toml::table& table)
        : file_(file), entry_(std::move(entry)), table_(table) {}

    float number(const char* key, double low, double high) {
        seen_.insert(key);
        return check(table_[key], key, low, high);
    }

    std::array<float, 3> colour(const char* key) {
        seen_.insert(key);
        const toml::array* values = table_[key].as_array();
        if (!values || values->size() != 3)
            refuse(file_, entry_, key, "must be three numbers, as in [0.7, 0.3, 0.2]");
        std::array<float, 3> out{};
        for (std::size_t i = 0; i < 3; ++i)
            out[i] = check(toml::node_view<const toml::node>(values->get(i)), key, 0, 1);
        return out;
    }

    void refuse_others() const {
        for (const auto& [key, value] : table_)
            if (!seen_.contains(std::string(key.str())))
                refuse(file_, entry_, std::string(key.str()),
                       "is not a known field; remove it or correct its name");
    }

  private:
    float check(toml::node_view<const toml::node> node, const char* key, double low, double high) const {
        const auto value = node.value<double>();
        if (!value || !(*value >= low && *value <= high))
            refuse(file_, entry_, key,
                   "must be a number in " + std::to_string(low) + ".." + std::to_string(high));
        return static_cast<float>(*value);
    }

    const std::filesystem::path& file_;
    std::string entry_;
    const toml::table& table_;
    std::set<std::string> seen_;
};

} // namespace

std::vector<Appearance> read_appearances(const std::filesystem::path& file) {
    toml::table root;
    try {
        root = toml::parse_file(file.string());
    } catch (const toml::parse_error& error) {
        throw std::runtime_error(file.string() + ":" + std::to_string(error.source().begin.line) + ": " +
                                 std::string(error.description()));
    }
    std::vector<Appearance> out;
    for (const auto& [key, node] : root) {
        const std::string name(key.str());
        const toml::table* table = node.as_table();
        if (!table) throw std::runtime_error(file.string() + ": " + name + " must be a table [" + name + "]");
        Reader read(file, name, *table);
        Appearance a;
        a.name = name;
        a.albedo = read.colour("albedo");
        a.mottled = read.colour("mottled");
        a.crease = read.colour("crease");
        a.mottle = read.number("mottle", 0, 1);
        a.patch = read.number("patch", 1e-4, 1);
        a.vessels = read.number("vessels", 0, 1);
        a.sheen = read.number("sheen", 0, 1);
        a.wet = read.number("wet", 0, 1);
        a.bump = read.number("bump", 0, 1);
        a.soft = read.number("soft", 0, 1);
        read.refuse_others();
        out.push_back(std::move(a));
    }
    if (out.empty()) throw std::runtime_error(file.string() + ": holds no appearance");
    return out;
}

std::size_t find_appearance(const std::vector<Appearance>& table, const std::string& name) {
    std::string known;
    for (std::size_t i = 0; i < table.size(); ++i) {
        if (table[i].name == name) return i;
        known += (known.empty() ? "" : ", ") + table[i].name;
    }
    throw std::invalid_argument("appearance \"" + name + "\" is not in appearance.toml; known are: " + known);
}

} // namespace calot::rendering
