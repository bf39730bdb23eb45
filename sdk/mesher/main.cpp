#include "description.hpp"
#include "organ_mesh.hpp"
#include "overlaps.hpp"
#include "surface.hpp"

#include <calot/meshio/read.hpp>
#include <calot/meshio/sha256.hpp>
#include <calot/meshio/write.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>

namespace {

namespace fs = std::filesystem;
using namespace calot;

/// Part of every file's identity: raise it when the same description gives other bits.
constexpr const char* mesher_version = "calot-mesher 2";

constexpr const char* teaching = R"(
A description says what an organ is made of: shapes with an id, a kind, dimensions in millimetres and their source,
in a frame of x left, y cranial, z anterior. A small one:

  format = 1
  name = "gallbladder"
  title = "Gallbladder"
  triangles = 4000          # budget
  edge = 3.0                # mm
  deviation = 0.2           # mm between triangles and surface
  solid = "body"            # the shape that is the organ

  [[shape]]
  id = "body"
  kind = "sweep"
  knots = [[-84, -11, 109, 12], [-75, -4, 85, 19], [-63, 4, 55, 11], [-58, 7, 44, 4]]   # x, y, z, radius
  source = ["gallbladder.length", "gallbladder.width"]

  [[region]]
  name = "gallbladder"

sdk/mesher/README.md has all kinds and patterns. Each mesh is checked: closed, manifold, facing outwards, free of
self-intersections, within its budget. The same description gives the same bytes.)";

void print(const std::string& name, const mesher::OrganMesh& made, std::size_t budget) {
    const auto& r = made.report;
    const double mm = 1000;
    std::printf("%s: %zu triangles%s, %zu part%s, %s, %s, %s, %zu self-intersections, %.1f mL, %.1f cm2, "
                "%.0f x %.0f x %.0f mm: %s\n",
                name.c_str(), r.triangles, budget ? (" of " + std::to_string(budget)).c_str() : "",
                r.components, r.components == 1 ? "" : "s", r.closed() ? "closed" : "open",
                r.manifold() ? "manifold" : "not manifold", r.inverted_components ? "inverted" : "outward",
                made.self_intersections, 1e6 * r.volume, 1e4 * r.area, mm * (r.maximum[0] - r.minimum[0]),
                mm * (r.maximum[1] - r.minimum[1]), mm * (r.maximum[2] - r.minimum[2]),
                made.problem.empty() ? "good" : made.problem.c_str());
    std::fflush(stdout);
}

/// facts.tsv: where it was said to be, or beside the description, or up to two folders above.
std::vector<std::string> facts_for(const fs::path& description, const std::string& given) {
    if (!given.empty()) return mesher::read_fact_keys(given);
    fs::path folder = fs::absolute(description).parent_path();
    for (int i = 0; i < 3; ++i, folder = folder.parent_path())
        if (fs::exists(folder / "facts.tsv")) return mesher::read_fact_keys(folder / "facts.tsv");
    throw mesher::DescriptionError(description.string() +
                                   ": no facts.tsv beside it or above: name it with --facts");
}

bool mesh_one(const fs::path& description, const fs::path& out, const std::string& facts, bool draft) {
    const mesher::Organ organ = mesher::read_organ(description, facts_for(description, facts));
    mesher::OrganMesh made;
    try {
        made = mesher::mesh_organ(organ);
    } catch (const mesher::SurfaceError& error) {
        throw mesher::DescriptionError(description.string() + ": " + error.what());
    }
    print(organ.name, made, organ.triangles);
    if (!made.problem.empty() && !draft) return false;
    meshio::GlbOptions options;
    options.generator = mesher_version;
    options.extras = {
        {"title", organ.title}, {"description_sha256", organ.sha256}, {"mesher", mesher_version}};
    for (const auto& [file, sha256] : organ.uses)
        options.extras.emplace_back("uses_sha256:" + file, sha256);
    meshio::write_glb(out, made.mesh, options);
    return made.problem.empty();
}

std::vector<fs::path> descriptions_in(const fs::path& folder) {
    std::vector<fs::path> found;
    if (!fs::is_directory(folder))
        throw mesher::DescriptionError(folder.string() +
                                       ": no such folder: name one with descriptions in it");
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".toml" && entry.path().filename() != "anatomy.toml")
            found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    if (found.empty()) throw mesher::DescriptionError(folder.string() + ": holds no descriptions (*.toml)");
    return found;
}

/// Whether no organ reaches more than 2 mm into another: soft organs that lie on each other press that much.
bool compare_organs(const fs::path& folder, const std::string& facts, double step) {
    constexpr double most_depth = 2;
    std::vector<mesher::Organ> organs;
    for (const auto& each : descriptions_in(folder))
        organs.push_back(mesher::read_organ(each, facts_for(each, facts)));
    bool good = true;
    for (const mesher::Overlap& o : mesher::find_overlaps(organs, step)) {
        std::printf("%s and %s: %.2f mL, %.1f mm deep at (%.0f, %.0f, %.0f)%s\n", o.first.c_str(),
                    o.second.c_str(), o.volume, o.depth, o.deepest.x, o.deepest.y, o.deepest.z,
                    o.depth > most_depth ? ": too deep" : "");
        good = good && o.depth <= most_depth;
    }
    std::printf("%zu organs: %s\n", organs.size(), good ? "good" : "some pierce each other");
    return good;
}

int perform(int argc, char** argv) {
    CLI::App app{"calot-mesher: organ descriptions in, clean surface meshes (GLB) out."};
    app.footer(teaching);
    std::string description, all, out, facts, overlaps;
    std::vector<std::string> check;
    double scale = 1, step = 2;
    bool draft = false;
    app.add_option("description", description, "An organ's description (.toml)");
    app.add_option("--all", all, "Mesh every description in this folder (anatomy.toml, the list, is none)");
    app.add_option("-o,--output", out, "The mesh to write (.glb); with --all, the folder for ORGAN.glb");
    app.add_option("--check", check, "Only check these meshes (.glb, .gltf, .obj, .stl, .ply)")
        ->expected(1, -1);
    app.add_option("--scale", scale, "With --check: metres for each unit of the files")
        ->capture_default_str();
    app.add_option("--overlaps", overlaps,
                   "Only say where the organs described in this folder reach into each other; more than 2 mm "
                   "is not good");
    app.add_option("--step", step, "With --overlaps: mm between the points looked at")
        ->capture_default_str()
        ->check(CLI::Range(0.5, 20.0));
    app.add_flag("--draft", draft, "Write a mesh that fails its checks too, to look at");
    app.add_option("--facts", facts, "The table of sources; found beside the description unless given");
    app.set_version_flag("--version", mesher_version);
    CLI11_PARSE(app, argc, argv);

    bool good = true;
    if (!check.empty()) {
        meshio::ReadOptions options;
        options.scale = scale;
        for (const auto& file : check) {
            const auto made = mesher::examine(meshio::read_mesh(file, options), 0);
            print(file, made, 0);
            good = good && made.problem.empty();
        }
    } else if (!overlaps.empty()) {
        good = compare_organs(overlaps, facts, step);
    } else if (!all.empty()) {
        fs::create_directories(out.empty() ? "." : out);
        for (const auto& each : descriptions_in(all)) {
            try {
                good = mesh_one(each, fs::path(out) / (each.stem().string() + ".glb"), facts, draft) && good;
            } catch (const std::runtime_error& error) {
                std::cerr << "calot-mesher: " << error.what() << std::endl;
                good = false;
            }
        }
    } else if (!description.empty() && !out.empty()) {
        good = mesh_one(description, out, facts, draft);
    } else {
        std::cerr << "calot-mesher: nothing to do: give DESCRIPTION.toml -o MESH.glb, --all FOLDER -o "
                     "FOLDER, --overlaps FOLDER, or --check MESH; --help explains"
                  << std::endl;
        return 2;
    }
    return good ? 0 : 1;
}

} // namespace

int main(int argc, char** argv) {
    try {
        return perform(argc, argv);
    } catch (const std::exception& error) {
        std::cerr << "calot-mesher: " << error.what() << std::endl;
        return 2;
    }
}
