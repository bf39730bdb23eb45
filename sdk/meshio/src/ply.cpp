#include "ply.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>

namespace calot::meshio {
namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };

struct Property {
    std::string name;
    Type type;
    bool list = false;
    Type count_type = Type::u8;
};

struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
};

class Parser {
  public:
    Parser(const std::string& bytes, const std::string& file, const ReadOptions& options)
        : bytes_(bytes), file_(file), options_(options) {}

    TriangleMesh run() {
        read_header();
        TriangleMesh mesh;
        for (const auto& element : elements_) {
            if (element.name == "vertex")
                read_vertices(element, mesh);
            else
                read_others(element, mesh);
        }
        for (const auto& tri : mesh.triangles)
            for (const auto v : tri)
                if (v >= mesh.vertices.size())
                    fail("a face uses vertex " + std::to_string(v) + " of " +
                         std::to_string(mesh.vertices.size()));
        return mesh;
    }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw MeshError(file_ + ": " + what + ": export the PLY file again, or convert it to GLB or STL");
    }

    std::string line() {
        const std::size_t end = bytes_.find('\n', at_);
        if (end == std::string::npos || end - at_ > 4096) fail("the header does not end");
        std::string text = bytes_.substr(at_, end - at_);
        at_ = end + 1;
        if (!text.empty() && text.back() == '\r') text.pop_back();
        return text;
    }

    Type type(const std::string& name) const {
        static constexpr std::pair<const char*, Type> names[] = {
            {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
            {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
            {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
            {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};
        for (const auto& [known, value] : names)
            if (name == known) return value;
        fail("the header has the unknown type '" + name.substr(0, 32) + "'");
    }

    void read_header() {
        if (line() != "ply") fail("it does not start with 'ply'");
        for (int lines = 0;; ++lines) {
            if (lines > 1000) fail("the header has more than 1000 lines");
            std::istringstream words(line());
            std::string word;
            words >> word;
            if (word == "end_header") break;
            if (word == "format") {
                words >> word;
                if (word == "ascii")
                    ascii_ = true;
                else if (word == "binary_little_endian")
                    ascii_ = false, big_ = false;
                else if (word == "binary_big_endian")
                    ascii_ = false, big_ = true;
                else
                    fail("unknown format '" + word.substr(0, 32) + "'");
            } else if (word == "element") {
                Element element;
                if (!(words >> element.name >> element.count)) fail("an element without a name and count");
                if (element.count > 100'000'000)
                    fail("element '" + element.name.substr(0, 32) + "' is too large");
                elements_.push_back(element);
                if (elements_.size() > 32) fail("more than 32 elements");
            } else if (word == "property") {
                if (elements_.empty()) fail("a property before the first element");
                Property property;
                words >> word;
                if (word == "list") {
                    property.list = true;
                    words >> word;
                    property.count_type = type(word);
                    words >> word;
                }
                property.type = type(word);
                words >> property.name;
                elements_.back().properties.push_back(property);
                if (elements_.back().properties.size() > 256) fail("more than 256 properties");
            } else if (word != "comment" && word != "obj_info" && !word.empty()) {
                fail("the header has the unknown word '" + word.substr(0, 32) + "'");
            }
        }
    }

    double value(Type type) {
        if (ascii_) {
            while (at_ < bytes_.size() && std::isspace(static_cast<unsigned char>(bytes_[at_])))
                ++at_;
            double number = 0;
            const char* begin = bytes_.data() + at_;
            const auto [end, error] = std::from_chars(begin, bytes_.data() + bytes_.size(), number);
            if (error != std::errc()) fail("a number is missing or malformed (truncated?)");
            at_ += static_cast<std::size_t>(end - begin);
            return number;
        }
        static constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
        const std::size_t size = sizes[static_cast<int>(type)];
        if (bytes_.size() - at_ < size) fail("the data end early (truncated?)");
        unsigned char raw[8] = {};
        for (std::size_t i = 0; i < size; ++i)
            raw[i] = static_cast<unsigned char>(bytes_[at_ + (big_ ? size - 1 - i : i)]);
        at_ += size;
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < size; ++i)
            bits |= std::uint64_t(raw[i]) << (8 * i);
        switch (type) {
        case Type::i8:
            return static_cast<std::int8_t>(bits);
        case Type::u8:
            return static_cast<std::uint8_t>(bits);
        case Type::i16:
            return static_cast<std::int16_t>(bits);
        case Type::u16:
            return static_cast<std::uint16_t>(bits);
        case Type::i32:
            return static_cast<std::int32_t>(bits);
        case Type::u32:
            return static_cast<std::uint32_t>(bits);
        case Type::f32:
            return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
        case Type::f64:
            return std::bit_cast<double>(bits);
        }
        return 0;
    }

    std::uint32_t length(const Property& property) {
        const double n = value(property.count_type);
        if (!(n >= 0 && n <= 1000 && n == std::floor(n))) fail("a list of a length other than 0 to 1000");
        return static_cast<std::uint32_t>(n);
    }

    void read_vertices(const Element& element, TriangleMesh& mesh) {
        if (!mesh.vertices.empty()) fail("two vertex elements");
        if (element.count > options_.max_vertices)
            fail(std::to_string(element.count) + " vertices, more than " +
                 std::to_string(options_.max_vertices));
        int found = 0;
        for (const auto& property : element.properties)
            found += property.name == "x" || property.name == "y" || property.name == "z";
        if (found != 3) fail("vertices without x, y and z");
        for (std::uint64_t i = 0; i < element.count; ++i) {
            Vec3 p{};
            for (const auto& property : element.properties) {
                if (property.list) {
                    for (std::uint32_t n = length(property); n > 0; --n)
                        value(property.type);
                    continue;
                }
                const double v = value(property.type);
                if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
                    p[static_cast<std::size_t>(property.name[0] - 'x')] = v;
            }
            mesh.vertices.push_back(p);
        }
    }

    void read_others(const Element& element, TriangleMesh& mesh) {
        if (element.properties.empty()) return;
        std::vector<std::uint32_t> corners;
        for (std::uint64_t i = 0; i < element.count; ++i)
            for (const auto& property : element.properties) {
                const std::uint32_t n = property.list ? length(property) : 1;
                const bool face = element.name == "face" && property.list &&
                                  (property.name == "vertex_indices" || property.name == "vertex_index");
                corners.clear();
                for (std::uint32_t k = 0; k < n; ++k) {
                    const double v = value(property.type);
                    if (!face) continue;
                    if (!(v >= 0 && v < 4294967295.0 && v == std::floor(v)))
                        fail("a vertex index that is no index");
                    corners.push_back(static_cast<std::uint32_t>(v));
                }
                for (std::size_t k = 2; k < corners.size(); ++k) {
                    mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
                    if (mesh.triangles.size() > options_.max_triangles)
                        fail("more than " + std::to_string(options_.max_triangles) + " triangles");
                }
            }
    }

    const std::string& bytes_;
    const std::string& file_;
    const ReadOptions& options_;
    std::size_t at_ = 0;
    bool ascii_ = true, big_ = false;
    std::vector<Element> elements_;
};

} // namespace

TriangleMesh parse_ply(const std::string& bytes, const std::string& file, const ReadOptions& options) {
    return Parser(bytes, file, options).run();
}

} // namespace calot::meshio
