#include "simulation/world.hpp"

#include "simulation/snapshot.hpp"
#include "simulation/toml_reader.hpp"

#include <calot/math.hpp>
#include <calot/meshio/check.hpp>
#include <calot/meshio/read.hpp>
#include <calot/meshio/sha256.hpp>

#include <algorithm>
#include <cmath>

namespace calot::simulation {

namespace {

constexpr std::size_t most_organs = 64, most_landmarks = 256, most_points = Marker::most_points,
                      most_regions = 256;
constexpr double reach = 10; // m: no patient is larger

// +z along `z`, y as near to the patient's anterior (-y) as it can be.
calot_pose pose_along(Vec3 position, Vec3 z) {
    const Vec3 anterior = std::fabs(z.y) > 0.99 ? Vec3{0, 0, 1} : Vec3{0, -1, 0};
    const Vec3 x = normalized(cross(anterior, z));
    const Vec3 y = cross(z, x);
    // The quaternion of the matrix with columns x, y, z (Shepperd 1978): from the largest of its squares.
    const double squares[4] = {1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z,
                               1 - x.x - y.y + z.z};
    const auto largest = std::max_element(squares, squares + 4) - squares;
    Quat q;
    switch (largest) {
    case 0:
        q = {squares[0], y.z - z.y, z.x - x.z, x.y - y.x};
        break;
    case 1:
        q = {y.z - z.y, squares[1], x.y + y.x, z.x + x.z};
        break;
    case 2:
        q = {z.x - x.z, x.y + y.x, squares[2], y.z + z.y};
        break;
    default:
        q = {x.y - y.x, z.x + x.z, y.z + z.y, squares[3]};
        break;
    }
    return pose(position, normalized(q));
}

Landmark read_landmark(const std::string& file, const std::string& id, const toml::table& table) {
    TomlReader reader(file, "landmark." + id + ".", table);
    Landmark landmark;
    landmark.id = id;
    if (reader.has("position")) {
        const auto position = reader.numbers("position", 3, -reach, reach);
        const char* key = reader.has("normal") ? "normal" : "direction";
        Vec3 along{0, 0, 1};
        if (reader.has(key)) {
            along = vec3(reader.numbers(key, 3, -1.01, 1.01).data());
            if (std::fabs(norm(along) - 1) > 0.01) reader.refuse(key, "must have length 1");
        }
        landmark.pose = pose_along(vec3(position.data()), normalized(along));
    }
    if (reader.has("ring_diameter")) landmark.radius = 0.5 * reader.number("ring_diameter", 1e-4, 1);
    for (const char* key : {"points", "centreline"})
        if (reader.has(key)) {
            const auto points = reader.points(key, most_points, -reach, reach);
            for (std::size_t i = 0; i < points.size(); i += 3)
                landmark.points.push_back({points[i], points[i + 1], points[i + 2]});
        }
    if (!landmark.pose && landmark.points.empty())
        reader.refuse("", "has neither position nor points; add one of them");
    reader.finish();
    return landmark;
}

void read_appearance(TomlReader& reader, Organ& organ) {
    const toml::node* node = reader.find("appearance");
    if (node == nullptr) return;
    if (node->is_string()) {
        organ.appearance = node->as_string()->get();
    } else if (node->is_table() && node->as_table()->size() <= 256) {
        for (auto&& [key, value] : *node->as_table()) {
            if (!value.is_string())
                reader.refuse("appearance." + std::string(key.str()), "must be a text in quotes");
            organ.region_appearance[std::string(key.str())] = value.as_string()->get();
        }
    } else {
        reader.refuse("appearance", "must be a text, or a table of region = text with at most 256 entries");
    }
}

void read_region_friction(const std::string& file, TomlReader& reader, Organ& organ) {
    const toml::table* table = reader.find_table("region_friction");
    if (table == nullptr) return;
    if (table->size() > most_regions)
        reader.refuse("region_friction", "must hold at most " + std::to_string(most_regions) + " regions");
    TomlReader regions(file, reader.prefix() + "region_friction.", *table);
    for (auto&& [key, value] : *table) {
        const std::string region(key.str());
        organ.region_friction[region] = regions.number(region, 0, 10);
    }
}

Organ read_organ(const std::string& file, const std::filesystem::path& folder, int index,
                 const toml::table& table) {
    TomlReader reader(file, "organ[" + std::to_string(index) + "].", table);
    Organ organ;
    organ.id = reader.word("id");
    organ.title = reader.text("title");
    const std::string mesh = reader.text("mesh");
    if (mesh.find('/') != std::string::npos || mesh == "..")
        reader.refuse("mesh", "must be the name of a file beside the anatomy");
    organ.mesh_file = folder / mesh;
    organ.friction = reader.number("friction", 0, 10);
    read_region_friction(file, reader, organ);
    read_appearance(reader, organ);
    reader.finish();
    return organ;
}

// The line of a mesh error names the file itself, so that only its shape is left to do here.
void read_surface(Organ& organ) {
    try {
        organ.mesh = meshio::read_mesh(organ.mesh_file);
        organ.mesh_hash = meshio::sha256_file(organ.mesh_file);
    } catch (const meshio::MeshError& error) {
        throw host::UserError(error.what());
    }
    const std::string problem = meshio::check(organ.mesh).problem();
    if (!problem.empty())
        throw host::UserError(organ.mesh_file.string(), "",
                              problem + "; an organ must be closed and face outwards: mesh it again");
}

// Of what friction is given for.
void require_regions(const std::string& file, const Organ& organ) {
    const std::vector<std::string>& names = organ.mesh.region_names;
    for (const auto& [region, friction] : organ.region_friction) {
        if (std::find(names.begin(), names.end(), region) != names.end()) continue;
        std::string there;
        for (const std::string& name : names)
            there += (there.empty() ? "" : ", ") + name;
        throw host::UserError(file, "organ " + organ.id + ": region_friction." + region,
                              "is no region of " + organ.mesh_file.filename().string() +
                                  "; remove it or name one of: " + (there.empty() ? "none" : there));
    }
}

} // namespace

std::vector<double> friction_by_region(const Organ& organ) {
    std::vector<double> all(std::max<std::size_t>(1, organ.mesh.region_names.size()), organ.friction);
    for (std::size_t r = 0; r < organ.mesh.region_names.size(); ++r) {
        const auto own = organ.region_friction.find(organ.mesh.region_names[r]);
        if (own != organ.region_friction.end()) all[r] = own->second;
    }
    return all;
}

const Landmark* Anatomy::find(std::string_view id) const {
    for (const Landmark& landmark : landmarks)
        if (landmark.id == id) return &landmark;
    return nullptr;
}

Anatomy load_anatomy(const std::filesystem::path& path, const std::vector<std::string>& organs,
                     const MeshFiles& meshes) {
    const std::string file = path.string();
    const toml::table root = parse_toml(read_text(path), file);
    TomlReader reader(file, "", root);
    reader.whole("format", 1, 1);
    Anatomy anatomy;
    anatomy.folder = path.parent_path();
    anatomy.name = reader.word("name");
    anatomy.title = reader.text("title");
    std::vector<Organ> all;
    for (const toml::table* table : reader.tables("organ", most_organs)) {
        all.push_back(read_organ(file, anatomy.folder, static_cast<int>(all.size()), *table));
        for (std::size_t i = 0; i + 1 < all.size(); ++i)
            if (all[i].id == all.back().id)
                reader.refuse("organ", "\"" + all[i].id + "\" stands twice; remove one");
    }
    if (const toml::table* landmarks = reader.find_table("landmark")) {
        if (landmarks->size() > most_landmarks)
            reader.refuse("landmark", "must hold at most " + std::to_string(most_landmarks) + " entries");
        for (auto&& [key, value] : *landmarks) {
            if (!value.is_table()) reader.refuse("landmark." + std::string(key.str()), "must be a table");
            anatomy.landmarks.push_back(read_landmark(file, std::string(key.str()), *value.as_table()));
        }
    }
    reader.finish();
    if (organs.empty()) {
        anatomy.organs = std::move(all);
    } else {
        for (const std::string& id : organs) {
            const auto found =
                std::find_if(all.begin(), all.end(), [&](const Organ& o) { return o.id == id; });
            if (found == all.end())
                reader.refuse("organ", "\"" + id + "\", which the scene needs, is missing");
            anatomy.organs.push_back(*found);
        }
    }
    if (anatomy.organs.empty()) reader.refuse("organ", "is missing; an anatomy needs one at least");
    for (const auto& replaced : meshes) {
        const auto organ = std::find_if(anatomy.organs.begin(), anatomy.organs.end(),
                                        [&](const Organ& o) { return o.id == replaced.first; });
        if (organ == anatomy.organs.end())
            throw host::UserError("--anatomy", replaced.first,
                                  "is no organ of " + file + "; name one of its [[organ]] ids");
        organ->mesh_file = replaced.second;
    }
    for (Organ& organ : anatomy.organs) {
        read_surface(organ);
        // A mesh put in an organ's place may have fewer regions.
        if (!meshes.contains(organ.id)) require_regions(file, organ);
    }
    return anatomy;
}

std::shared_ptr<const World> load_world(const SceneDescription& scene, const WorldOptions& options) {
    auto world = std::make_shared<World>();
    world->scene = scene;
    world->scene_hash = meshio::sha256(scene.text);
    const std::string name = options.anatomy.empty() ? scene.anatomy : options.anatomy;
    world->endoscope =
        read_endoscope(options.endoscope.empty() ? options.assets / "endoscopes" / (scene.endoscope + ".toml")
                                                 : options.endoscope);
    world->anatomy =
        load_anatomy(options.assets / "anatomy" / name / "anatomy.toml", scene.organs, options.meshes);

    const auto need = [&](const std::string& field, const std::string& id, bool is_path) {
        const Landmark* landmark = world->anatomy.find(id);
        if (landmark == nullptr)
            throw host::UserError(scene.file, field,
                                  "\"" + id + "\" is no landmark of the anatomy \"" + name +
                                      "\"; add it there");
        if (is_path ? landmark->points.empty() : !landmark->pose)
            throw host::UserError(scene.file, field,
                                  "the landmark \"" + id + "\" has no " + (is_path ? "points" : "position") +
                                      "; choose another");
    };
    need("guide", scene.guide, false);
    for (const StartPose& start : scene.starts)
        need("start." + start.name + ".path", start.path, true);
    for (const SceneMarker& marker : scene.markers)
        need("marker." + marker.id + ".landmark", marker.landmark,
             marker.kind == CALOT_MARKER_PATH || marker.kind == CALOT_MARKER_LINE);

    std::vector<geometry::OrganSurface> surfaces;
    std::vector<std::vector<std::uint32_t>> regions;
    std::vector<std::vector<double>> friction;
    for (Organ& organ : world->anatomy.organs) {
        if (options.friction) organ.friction = *options.friction, organ.region_friction.clear();
        friction.push_back(friction_by_region(organ));
        regions.emplace_back(organ.mesh.region.begin(), organ.mesh.region.end());
        surfaces.push_back(
            {.name = organ.id,
             .vertices = {organ.mesh.vertices.data()->data(), 3 * organ.mesh.vertices.size()},
             .triangles = {organ.mesh.triangles.data()->data(), 3 * organ.mesh.triangles.size()},
             .regions = regions.back(),
             .friction = friction.back()});
    }
    try {
        world->surfaces = geometry::TriangleScene(surfaces);
    } catch (const std::invalid_argument& error) {
        throw host::UserError(world->anatomy.folder.string(), "", error.what());
    }
    return world;
}

} // namespace calot::simulation
