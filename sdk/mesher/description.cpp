#include "description.hpp"

#include "fields.hpp"
#include "patterns.hpp"

#include <calot/meshio/mesh.hpp>
#include <calot/meshio/sha256.hpp>

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>

namespace calot::mesher {
namespace {

constexpr double far = 2000;      // mm: no organ description reaches farther from the origin
constexpr double largest = 1000;  // mm: no radius or size is larger
constexpr double smallest = 0.05; // mm
constexpr std::uintmax_t most_bytes = 4u << 20;
constexpr std::size_t most_cost = 4000;
constexpr int deepest_use = 6; // descriptions that use others that use others

std::string read_text(const std::filesystem::path& file) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
        throw DescriptionError(file.string() + ": no such file: name a description (.toml)");
    if (std::filesystem::file_size(file, error) > most_bytes || error)
        throw DescriptionError(file.string() + ": larger than 4 MiB: this is no description");
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    if (!in) throw DescriptionError(file.string() + ": cannot be read: check its permissions");
    return text.str();
}

class Reader {
  public:
    Reader(std::string file, const std::vector<std::string>& facts, int depth = 0)
        : file_(std::move(file)), facts_(facts), depth_(depth) {}

    Organ run(const std::string& text) {
        toml::table root;
        try {
            root = toml::parse(text, file_);
        } catch (const toml::parse_error& error) {
            throw DescriptionError(file_ + ":" + std::to_string(error.source().begin.line) +
                                   ": not valid TOML: " + std::string(error.description()));
        }
        Fields top(root, file_, "");
        if (top.integer("format", 0, 1000) != 1) top.fail("format", "this mesher reads format 1");
        Organ organ;
        organ.name = top.text("name");
        if (organ.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos)
            top.fail("name", "use lower-case letters, digits and hyphens");
        organ.title = top.text("title");
        organ.triangles = static_cast<std::size_t>(top.integer("triangles", 100, 400'000));
        const double edge = organ.edge = top.number("edge", 0.3, 50),
                     deviation = top.number("deviation", 0.01, 10);
        for (const auto& each : top.tables("shape"))
            read_shape(*each.as_table());
        cost_ = 0;
        organ.solid = find(top, "solid");
        if (!organ.solid->bounds().bounded())
            top.fail("solid", "reaches to infinity: intersect its half-spaces with a bounded shape");
        int index = 0;
        const toml::array& regions = top.tables("region");
        for (const auto& each : regions) {
            Fields f(*each.as_table(), file_, "region " + std::to_string(++index));
            Region region;
            region.name = f.text("name");
            const bool last = index == static_cast<int>(regions.size());
            if (!last)
                region.inside = find(f, "inside");
            else if (f.has("inside"))
                f.fail("inside",
                       "the last region is everything else: leave this out, or add a region after it");
            region.edge = f.number_or("edge", 0.3, 50, edge);
            region.deviation = f.number_or("deviation", 0.01, 10, deviation);
            f.finish();
            organ.regions.push_back(region);
        }
        top.finish();
        organ.shapes = shapes_;
        organ.uses = uses_;
        solid_cost_ = cost_;
        organ.sha256 = meshio::sha256(text);
        return organ;
    }

  private:
    ShapePtr find(Fields& f, std::string_view key) { return named(f, key, f.text(key)); }

    ShapePtr named(const Fields& f, std::string_view key, const std::string& id) {
        const auto at = shapes_.find(id);
        if (at == shapes_.end())
            f.fail(key, "no shape '" + id + "' above: define it first, or correct the name");
        cost_ += costs_.at(id);
        return at->second;
    }

    /// A shape of another description in the same folder, its solid unless 'shape' names one.
    ShapePtr from_organ(Fields& f) {
        const std::string name = f.text("file");
        if (name.empty() || name.find_first_of("/\\") != std::string::npos)
            f.fail("file", "name a description in the same folder, without a path");
        if (depth_ >= deepest_use)
            f.fail("file", "descriptions use each other in a circle or too deeply: break the chain");
        auto at = others_.find(name);
        if (at == others_.end()) {
            const auto path = std::filesystem::path(file_).parent_path() / name;
            auto reader = std::make_shared<Reader>(path.string(), facts_, depth_ + 1);
            Organ organ = reader->run(read_text(path));
            uses_.insert(organ.uses.begin(), organ.uses.end());
            uses_.emplace(name, organ.sha256);
            at = others_.emplace(name, Other{std::move(organ), std::move(reader)}).first;
        }
        const Other& other = at->second;
        if (!f.has("shape")) {
            cost_ += other.reader->solid_cost_;
            return other.organ.solid;
        }
        const std::string id = f.text("shape");
        const auto shape = other.organ.shapes.find(id);
        if (shape == other.organ.shapes.end())
            f.fail("shape", "no shape '" + id + "' in " + name + ": name one of its shapes");
        cost_ += other.reader->costs_.at(id);
        return shape->second;
    }

    SweepPtr sweep(Fields& f, std::string_view key) {
        auto found = std::dynamic_pointer_cast<const Sweep>(find(f, key));
        if (!found) f.fail(key, "that shape is no sweep: name a shape of kind \"sweep\"");
        return found;
    }

    std::vector<ShapePtr> several(Fields& f, std::size_t least) {
        std::vector<ShapePtr> out;
        for (const auto& id : f.texts("of"))
            out.push_back(named(f, "of", id));
        if (out.size() < least) f.fail("of", "name " + std::to_string(least) + " shapes or more");
        return out;
    }

    void check_source(Fields& f) const {
        for (const auto& source : f.texts("source")) {
            if (source.rfind("E: ", 0) == 0 && source.size() > 6) continue;
            if (std::find(facts_.begin(), facts_.end(), source) != facts_.end()) continue;
            f.fail("source",
                   "'" + source + "' is no quantity of facts.tsv: cite one, or write \"E: why this value\"");
        }
    }

    static std::uint32_t seed(Fields& f) {
        return static_cast<std::uint32_t>(f.integer("seed", 0, 1'000'000));
    }

    ShapePtr read_sweep(Fields& f) {
        std::vector<Knot> knots;
        for (const auto& row : f.rows("knots", 2000)) {
            const std::string entry = "entry " + std::to_string(knots.size() + 1);
            if (row.size() < 4 || row.size() > 8 || row.size() == 6)
                f.fail("knots",
                       entry + " has " + std::to_string(row.size()) +
                           " numbers: write [x, y, z, radius], [x, y, z, ru, rv] or "
                           "[x, y, z, +u, -u, +v, -v], the last with a roll in degrees after them if needed");
            Knot k{.at = {row[0], row[1], row[2]}};
            const bool four = row.size() >= 7;
            k.plus_u = row[3], k.minus_u = four ? row[4] : row[3];
            k.plus_v = four ? row[5] : row.size() > 4 ? row[4] : row[3];
            k.minus_v = four ? row[6] : k.plus_v;
            k.roll = row.size() == 8 ? row[7] * M_PI / 180 : 0;
            for (const double r : {k.plus_u, k.minus_u, k.plus_v, k.minus_v})
                if (!(r >= smallest && r <= largest))
                    f.fail("knots", entry + " has a radius outside 0.05 to 1000 mm");
            if (norm(k.at) > far) f.fail("knots", entry + " lies more than 2 m from the origin");
            if (!knots.empty() && norm(k.at - knots.back().at) < 0.1)
                f.fail("knots", entry + " lies within 0.1 mm of the one before: remove it");
            knots.push_back(k);
        }
        if (knots.size() < 2) f.fail("knots", "a sweep needs two knots or more");
        const bool has_up = f.has("up");
        const Vec up = f.vec_or("up", -1, 1, {});
        if (has_up && norm(up) < 0.01) f.fail("up", "has no direction: give one, such as [0, 0, 1]");
        Cap caps[2] = {Cap::round, Cap::round};
        if (const auto list = f.has("caps") ? f.texts("caps") : std::vector<std::string>{"round", "round"};
            list.size() == 2) {
            for (int i = 0; i < 2; ++i) {
                if (list[i] != "round" && list[i] != "flat") f.fail("caps", "each is \"round\" or \"flat\"");
                caps[i] = list[i] == "flat" ? Cap::flat : Cap::round;
            }
        } else {
            f.fail("caps", "give two, for the first and the last knot");
        }
        if (has_up) f.vec("up", -1, 1);
        auto made = std::make_shared<Sweep>(knots, has_up, up, caps[0], caps[1]);
        if (!made->frame_ok())
            f.fail("up",
                   "the centreline runs within 10 degrees of it: choose another direction, or leave it out");
        return made;
    }

    Pattern read_pattern(Fields& f) {
        const std::string kind = f.text("pattern");
        if (kind == "rugae")
            return pattern::Rugae{sweep(f, "along"), f.number("count", 2, 200), f.number("length", 1, 500),
                                  f.number("groove", 0.05, 3), seed(f)};
        if (kind == "folds")
            return pattern::Folds{sweep(f, "along"), static_cast<double>(f.integer("count", 2, 100)),
                                  f.number("length", 1, 500), seed(f)};
        if (kind == "haustra")
            return pattern::Haustra{sweep(f, "along"),
                                    f.number("spacing", 2, 200),
                                    f.number("band", 1, 90),
                                    f.number("crease", 0.5, 50),
                                    f.number_or("first_band", -360, 360, 0),
                                    seed(f)};
        if (kind == "semilunar")
            return pattern::Semilunar{sweep(f, "along"), f.number("spacing", 2, 200),
                                      f.number("width", 0.2, 50), f.number_or("first_band", -360, 360, 0),
                                      seed(f)};
        if (kind == "rings")
            return pattern::Rings{sweep(f, "along"),
                                  f.number("spacing", 0.5, 200),
                                  f.number("width", 0.1, 50),
                                  f.number_or("arc", 0.05, 1, 1),
                                  static_cast<double>(f.integer_or("pitch", -4, 4, 0)),
                                  seed(f)};
        if (kind == "lobules") return pattern::Lobules{f.vec_or_number("size", 1, 200), seed(f)};
        if (kind == "noise")
            return pattern::Noise{f.vec_or_number("wavelength", 1, 500),
                                  static_cast<int>(f.integer_or("octaves", 1, 6, 1)), seed(f)};
        if (kind == "wave") {
            const Vec direction = f.vec("direction", -1, 1);
            if (norm(direction) < 0.01) f.fail("direction", "has no length: give one, such as [1, 0, 0]");
            return pattern::Wave{normalised(direction), f.number("wavelength", 1, 1000),
                                 f.number_or("phase", -360, 360, 0)};
        }
        f.fail("pattern", "unknown: use rugae, folds, haustra, semilunar, rings, lobules, noise or wave");
    }

    ShapePtr read_displaced(Fields& f) {
        ShapePtr of = find(f, "of");
        Pattern made = read_pattern(f);
        const double height = f.number("height", -100, 100);
        Mask mask;
        if (f.has("only")) mask.only = find(f, "only");
        if (f.has("except")) mask.except = find(f, "except");
        if (mask.only || mask.except) mask.fade = f.number("fade", 0.1, 200);
        return make_displaced(of, std::move(made), height, mask);
    }

    void read_shape(const toml::table& table) {
        Fields f(table, file_, "shape");
        const std::string id = f.text("id");
        if (shapes_.contains(id)) f.fail("id", "'" + id + "' is there already: choose another");
        f.rename("shape '" + id + "'");
        cost_ = 1;
        const std::string kind = f.text("kind");
        check_source(f);
        ShapePtr made;
        const auto of = [&] { return find(f, "of"); };
        if (kind == "sweep")
            made = read_sweep(f);
        else if (kind == "ellipsoid")
            made = make_ellipsoid(f.vec("centre", -far, far), f.vec_or_number("radii", smallest, largest),
                                  f.vec_or("rotate", -360, 360, {}), f.number_or("exponent", 1.2, 10, 2));
        else if (kind == "capsule") {
            const Vec from = f.vec("from", -far, far), to = f.vec("to", -far, far);
            if (norm(to - from) < 0.01) f.fail("to", "equals 'from': use an ellipsoid");
            const double radius = f.number("radius", smallest, largest);
            made = make_capsule(from, to, radius, f.number_or("radius_to", smallest, largest, radius));
        } else if (kind == "box") {
            const Vec size = f.vec("size", smallest, 2 * largest);
            made = make_box(f.vec("centre", -far, far), size,
                            f.number_or("round", 0, 0.5 * std::min({size.x, size.y, size.z}), 0),
                            f.vec_or("rotate", -360, 360, {}));
        } else if (kind == "half-space") {
            const Vec normal = f.vec("normal", -1, 1);
            if (norm(normal) < 0.01) f.fail("normal", "has no length: give one, such as [0, 0, 1]");
            made = make_half_space(f.vec("point", -far, far), normal);
        } else if (kind == "union")
            made = make_union(several(f, 1), f.number_or("blend", 0, 200, 0));
        else if (kind == "intersection")
            made = make_intersection(several(f, 2), f.number_or("blend", 0, 200, 0));
        else if (kind == "difference")
            made = make_difference(several(f, 2), f.number_or("blend", 0, 200, 0));
        else if (kind == "shell") {
            const double in = f.number_or("inwards", 0, 100, 0), out = f.number_or("outwards", 0, 100, 0);
            if (in + out < smallest) f.fail("", "no thickness: give 'inwards' or 'outwards' in mm");
            made = make_shell(of(), in, out);
        } else if (kind == "offset")
            made = make_offset(of(), f.number("by", -100, 100));
        else if (kind == "place")
            made = make_placed(of(), f.vec_or("move", -far, far, {}), f.vec_or("rotate", -360, 360, {}),
                               f.vec_or("about", -far, far, {}), f.number_or("scale", 0.05, 20, 1));
        else if (kind == "organ")
            made = from_organ(f);
        else if (kind == "displace")
            made = read_displaced(f);
        else if (kind == "warp")
            made = make_warped(of(), f.vec_or_number("amplitude", 0, 100), f.number("wavelength", 2, 1000),
                               static_cast<int>(f.integer_or("octaves", 1, 6, 1)), seed(f));
        else
            f.fail(
                "kind",
                "unknown: use sweep, ellipsoid, capsule, box, half-space, union, intersection, difference, "
                "shell, offset, place, displace, warp or organ");
        f.finish();
        // A shape used twice by each of thirty others would be evaluated a thousand million times.
        if (cost_ > most_cost)
            f.fail("", "is built from too many parts (" + std::to_string(cost_) + "): simplify it");
        costs_.emplace(id, cost_);
        shapes_.emplace(id, std::move(made));
    }

    struct Other {
        Organ organ;
        std::shared_ptr<Reader> reader;
    };

    std::string file_;
    const std::vector<std::string>& facts_;
    std::map<std::string, ShapePtr> shapes_;
    std::map<std::string, std::size_t> costs_; ///< fields evaluated for one value of a shape
    std::size_t cost_ = 0;                     ///< of the shape being read
    std::size_t solid_cost_ = 0;
    int depth_; ///< how many descriptions were read to come to this one
    std::map<std::string, Other> others_;
    std::map<std::string, std::string> uses_;
};

} // namespace

std::vector<std::string> read_fact_keys(const std::filesystem::path& file) {
    std::istringstream lines(read_text(file));
    std::vector<std::string> keys;
    for (std::string line; std::getline(lines, line);)
        if (const auto tab = line.find('\t'); tab != std::string::npos && tab > 0)
            keys.push_back(line.substr(0, tab));
    if (keys.empty())
        throw DescriptionError(file.string() + ": holds no quantities: it must be tab-separated");
    return keys;
}

Organ read_organ(const std::filesystem::path& file, const std::vector<std::string>& fact_keys) {
    return Reader(file.string(), fact_keys).run(read_text(file));
}

} // namespace calot::mesher
