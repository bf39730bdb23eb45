#include "file_bytes.hpp"
#include "ply.hpp"
#include "vector.hpp"

#include <calot/meshio/read.hpp>

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace calot::meshio {
namespace {

/// Finds truncation before assimp sees the file: its own words for that are no help to a user.
void require_whole_glb(const std::string& bytes, const std::string& file) {
    const auto fail = [&](const std::string& what) {
        throw MeshError(file + ": " + what + ": fetch or write the file again");
    };
    std::uint32_t head[3] = {};
    if (bytes.size() < 20)
        fail("truncated: " + std::to_string(bytes.size()) + " bytes are no binary glTF file");
    std::memcpy(head, bytes.data(), sizeof head);
    if (head[0] != 0x46546c67) fail("not a binary glTF file (it does not start with 'glTF')");
    if (head[1] != 2) fail("binary glTF version " + std::to_string(head[1]) + " where 2 is read");
    if (head[2] != bytes.size())
        fail("truncated or padded: the header says " + std::to_string(head[2]) + " bytes, the file has " +
             std::to_string(bytes.size()));
    for (std::size_t at = 12; at < bytes.size();) {
        std::uint32_t length = 0;
        if (bytes.size() - at < 8) fail("a chunk's header is cut off");
        std::memcpy(&length, bytes.data() + at, 4);
        if (length > bytes.size() - at - 8) fail("a chunk is longer than the file");
        at += 8 + std::size_t(length);
    }
}

class SceneReader {
  public:
    SceneReader(const aiScene& scene, const std::string& file, const ReadOptions& options)
        : scene_(scene), file_(file), options_(options) {}

    TriangleMesh run() {
        with_normals_ = with_colours_ = true;
        for (unsigned i = 0; i < scene_.mNumMeshes; ++i) {
            with_normals_ &= scene_.mMeshes[i]->HasNormals();
            with_colours_ &= scene_.mMeshes[i]->HasVertexColors(0);
        }
        visit(*scene_.mRootNode, aiMatrix4x4(), 0);
        return std::move(mesh_);
    }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw MeshError(file_ + ": " + what + ": repair the file or export it again");
    }

    std::uint16_t region(const aiMesh& part) {
        std::string name;
        aiString text;
        if (part.mMaterialIndex < scene_.mNumMaterials &&
            scene_.mMaterials[part.mMaterialIndex]->Get(AI_MATKEY_NAME, text) == AI_SUCCESS)
            name = text.C_Str();
        if (name.empty() || name == AI_DEFAULT_MATERIAL_NAME) name = part.mName.C_Str();
        if (name.empty()) name = "surface";
        const auto known = std::find(mesh_.region_names.begin(), mesh_.region_names.end(), name);
        if (known != mesh_.region_names.end())
            return static_cast<std::uint16_t>(known - mesh_.region_names.begin());
        if (mesh_.region_names.size() == 1000) fail("more than 1000 materials");
        mesh_.region_names.push_back(name);
        return static_cast<std::uint16_t>(mesh_.region_names.size() - 1);
    }

    void visit(const aiNode& node, const aiMatrix4x4& parent, int depth) {
        if (depth > 64 || ++nodes_ > 100'000) fail("the node tree is too deep or too large");
        const aiMatrix4x4 place = parent * node.mTransformation;
        for (unsigned i = 0; i < node.mNumMeshes; ++i)
            if (node.mMeshes[i] < scene_.mNumMeshes) add(*scene_.mMeshes[node.mMeshes[i]], place);
        for (unsigned i = 0; i < node.mNumChildren; ++i)
            visit(*node.mChildren[i], place, depth + 1);
    }

    void add(const aiMesh& part, const aiMatrix4x4& place) {
        if (!part.HasFaces() || !part.HasPositions()) return;
        const std::uint16_t region_index = region(part);
        const std::size_t base = mesh_.vertices.size();
        if (base + part.mNumVertices > options_.max_vertices)
            fail("more than " + std::to_string(options_.max_vertices) + " vertices");
        const bool mirrored = aiMatrix3x3(place).Determinant() < 0;
        aiMatrix3x3 turn(place);
        turn.Inverse().Transpose();
        for (unsigned i = 0; i < part.mNumVertices; ++i) {
            const aiVector3D p = place * part.mVertices[i];
            mesh_.vertices.push_back({double(p.x), double(p.y), double(p.z)});
            if (with_normals_) {
                const aiVector3D n = turn * part.mNormals[i];
                mesh_.normals.push_back(normalised({double(n.x), double(n.y), double(n.z)}));
            }
            if (with_colours_) {
                const aiColor4D& c = part.mColors[0][i];
                const auto byte = [](float v) {
                    return static_cast<std::uint8_t>(
                        std::lround(255 * std::clamp(v == v ? v : 0.0f, 0.0f, 1.0f)));
                };
                mesh_.colours.push_back({byte(c.r), byte(c.g), byte(c.b), byte(c.a)});
            }
        }
        for (unsigned i = 0; i < part.mNumFaces; ++i) {
            const aiFace& face = part.mFaces[i];
            if (face.mNumIndices != 3) continue; // points and lines: no surface
            Triangle tri{};
            for (int k = 0; k < 3; ++k) {
                if (face.mIndices[k] >= part.mNumVertices) fail("a face uses a vertex that does not exist");
                tri[k] = static_cast<std::uint32_t>(base + face.mIndices[k]);
            }
            if (mirrored) std::swap(tri[1], tri[2]);
            mesh_.triangles.push_back(tri);
            mesh_.region.push_back(region_index);
        }
        if (mesh_.triangles.size() > options_.max_triangles)
            fail("more than " + std::to_string(options_.max_triangles) + " triangles");
    }

    const aiScene& scene_;
    const std::string& file_;
    const ReadOptions& options_;
    TriangleMesh mesh_;
    bool with_normals_ = false, with_colours_ = false;
    std::size_t nodes_ = 0;
};

TriangleMesh read_with_assimp(const std::string& bytes, const std::string& file, const std::string& format,
                              const ReadOptions& options) {
    Assimp::Importer importer;
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = nullptr;
    try {
        // A .gltf names its buffers in files beside it, so it is read by path.
        const unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType;
        scene = format == "gltf"
                    ? importer.ReadFile(file, steps)
                    : importer.ReadFileFromMemory(bytes.data(), bytes.size(), steps, format.c_str());
    } catch (const std::exception& error) {
        throw MeshError(file + ": cannot be read: " + error.what());
    }
    if (!scene || !scene->mRootNode) {
        std::string why = importer.GetErrorString();
        std::replace(why.begin(), why.end(), '\n', ' ');
        throw MeshError(file + ": cannot be read: " + (why.empty() ? "no scene in it" : why.substr(0, 300)));
    }
    return SceneReader(*scene, file, options).run();
}

} // namespace

TriangleMesh read_mesh(const std::filesystem::path& path, const ReadOptions& options) {
    const std::string file = path.string();
    std::string format = path.extension().string();
    std::transform(format.begin(), format.end(), format.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (!format.empty()) format.erase(0, 1);
    if (format != "glb" && format != "gltf" && format != "obj" && format != "stl" && format != "ply")
        throw MeshError(file + ": unknown kind of mesh file '." + format +
                        "': use .glb, .gltf, .obj, .stl or .ply");
    if (!(options.scale > 0) || !std::isfinite(options.scale))
        throw MeshError(file + ": the scale is not positive: give metres for each unit of the file");

    const std::string bytes = read_file_bytes(path, options.max_bytes);
    if (format == "glb") require_whole_glb(bytes, file);
    TriangleMesh mesh =
        format == "ply" ? parse_ply(bytes, file, options) : read_with_assimp(bytes, file, format, options);
    mesh.name = path.stem().string();
    if (mesh.triangles.empty()) throw MeshError(file + ": holds no triangles: export a surface");

    const Axes axes = options.axes.value_or(format == "glb" || format == "gltf" ? Axes::gltf : Axes::lps);
    const auto turned = [&](const Vec3& p) { return axes == Axes::gltf ? Vec3{p[0], -p[2], p[1]} : p; };
    for (auto& p : mesh.vertices) {
        p = turned(options.scale * p);
        for (const double c : p)
            if (!(std::abs(c) < 1e6))
                throw MeshError(
                    file + ": a coordinate is not finite or beyond 1000 km: repair it or check the scale");
    }
    for (auto& n : mesh.normals) {
        n = turned(n);
        if (!std::isfinite(n[0] + n[1] + n[2])) n = Vec3{};
    }
    weld(mesh);
    if (mesh.triangles.empty()) throw MeshError(file + ": all its triangles are degenerate: repair the file");
    const bool usable =
        std::all_of(mesh.normals.begin(), mesh.normals.end(), [](const Vec3& n) { return norm(n) > 0; });
    if (mesh.normals.empty() || !usable) compute_normals(mesh);
    return mesh;
}

} // namespace calot::meshio
