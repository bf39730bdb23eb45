#include "file_bytes.hpp"
#include "vector.hpp"

#include <calot/meshio/write.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

static_assert(std::endian::native == std::endian::little,
              "glTF is little-endian; the buffers are copied as they are");

namespace calot::meshio {
namespace {

constexpr std::uint32_t glb_magic = 0x46546c67, chunk_json = 0x4e4f534a, chunk_bin = 0x004e4942;

void put(std::string& out, const void* data, std::size_t size) {
    out.append(static_cast<const char*>(data), size);
}
void put_u32(std::string& out, std::uint32_t value) {
    put(out, &value, 4);
}

std::string quoted(const std::string& text) {
    static constexpr char digits[] = "0123456789abcdef";
    std::string out = "\"";
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\')
            (out += '\\') += c;
        else if (byte < 0x20)
            ((out += "\\u00") += digits[byte >> 4]) += digits[byte & 15];
        else
            out += c;
    }
    return out + "\"";
}

std::string number(float value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
    return text;
}

std::string triple(const float* v) {
    return "[" + number(v[0]) + "," + number(v[1]) + "," + number(v[2]) + "]";
}

/// LPS to glTF: x left, y cranial, z anterior.
std::array<float, 3> to_gltf(const Vec3& p) {
    return {static_cast<float>(p[0]), static_cast<float>(p[2]), static_cast<float>(-p[1])};
}

void require_consistent(const TriangleMesh& m) {
    const auto fail = [&](const std::string& what) {
        throw MeshError(m.name + ": " + what + ": the mesh cannot be written");
    };
    if (m.triangles.empty()) fail("no triangles");
    if (!m.normals.empty() && m.normals.size() != m.vertices.size()) fail("not one normal for each vertex");
    if (!m.colours.empty() && m.colours.size() != m.vertices.size()) fail("not one colour for each vertex");
    if (!m.region.empty() && m.region.size() != m.triangles.size()) fail("not one region for each triangle");
    for (const auto r : m.region)
        if (r >= m.region_names.size()) fail("region index " + std::to_string(r) + " has no name");
    for (const auto& tri : m.triangles)
        for (const auto v : tri)
            if (v >= m.vertices.size()) fail("vertex index " + std::to_string(v) + " out of range");
    for (const auto& p : m.vertices)
        for (const double c : p)
            if (!std::isfinite(static_cast<float>(c))) fail("a coordinate that is not finite");
}

} // namespace

std::string to_glb(const TriangleMesh& mesh, const GlbOptions& options) {
    require_consistent(mesh);
    TriangleMesh smooth;
    const std::vector<Vec3>* normals = &mesh.normals;
    if (mesh.normals.empty()) {
        smooth = mesh;
        compute_normals(smooth);
        normals = &smooth.normals;
    }

    std::string bin;
    constexpr float inf = std::numeric_limits<float>::infinity();
    float low[3] = {inf, inf, inf}, high[3] = {-inf, -inf, -inf};
    for (const auto& p : mesh.vertices) {
        const auto q = to_gltf(p);
        for (int i = 0; i < 3; ++i)
            low[i] = std::min(low[i], q[i]), high[i] = std::max(high[i], q[i]);
        put(bin, q.data(), 12);
    }
    for (const auto& n : *normals)
        put(bin, to_gltf(n).data(), 12);
    for (const auto& c : mesh.colours)
        put(bin, c.data(), 4);
    const std::size_t count = mesh.vertices.size(), indices_at = bin.size();
    const std::size_t regions = std::max<std::size_t>(1, mesh.region_names.size());
    std::vector<std::vector<std::uint32_t>> indices(regions);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        auto& list = indices[mesh.region.empty() ? 0 : mesh.region[t]];
        list.insert(list.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
    }

    const std::string vertices_n = std::to_string(count);
    std::string views = "{\"buffer\":0,\"byteOffset\":0,\"byteLength\":" + std::to_string(12 * count) +
                        ",\"target\":34962},{\"buffer\":0,\"byteOffset\":" + std::to_string(12 * count) +
                        ",\"byteLength\":" + std::to_string(12 * count) + ",\"target\":34962}";
    std::string accessors = "{\"bufferView\":0,\"componentType\":5126,\"count\":" + vertices_n +
                            ",\"type\":\"VEC3\",\"min\":" + triple(low) + ",\"max\":" + triple(high) +
                            "},{\"bufferView\":1,\"componentType\":5126,\"count\":" + vertices_n +
                            ",\"type\":\"VEC3\"}";
    std::string attributes = "\"POSITION\":0,\"NORMAL\":1";
    int next = 2;
    if (!mesh.colours.empty()) {
        views += ",{\"buffer\":0,\"byteOffset\":" + std::to_string(24 * count) +
                 ",\"byteLength\":" + std::to_string(4 * count) + ",\"target\":34962}";
        accessors += ",{\"bufferView\":2,\"componentType\":5121,\"normalized\":true,\"count\":" + vertices_n +
                     ",\"type\":\"VEC4\"}";
        attributes += ",\"COLOR_0\":2";
        next = 3;
    }
    std::string primitives, materials;
    std::size_t at = indices_at;
    int material = 0;
    for (std::size_t r = 0; r < regions; ++r) {
        if (indices[r].empty()) continue;
        const std::size_t size = 4 * indices[r].size();
        put(bin, indices[r].data(), size);
        views += ",{\"buffer\":0,\"byteOffset\":" + std::to_string(at) +
                 ",\"byteLength\":" + std::to_string(size) + ",\"target\":34963}";
        accessors += ",{\"bufferView\":" + std::to_string(next) +
                     ",\"componentType\":5125,\"count\":" + std::to_string(indices[r].size()) +
                     ",\"type\":\"SCALAR\"}";
        if (material > 0) primitives += ",", materials += ",";
        primitives += "{\"attributes\":{" + attributes + "},\"indices\":" + std::to_string(next) +
                      ",\"material\":" + std::to_string(material) + "}";
        materials +=
            "{\"name\":" + quoted(mesh.region_names.empty() ? mesh.name : mesh.region_names[r]) + "}";
        at += size, ++next, ++material;
    }

    std::string json = "{\"asset\":{\"version\":\"2.0\",\"generator\":" + quoted(options.generator);
    if (!options.extras.empty()) {
        json += ",\"extras\":{";
        for (std::size_t i = 0; i < options.extras.size(); ++i)
            json += (i ? "," : "") + quoted(options.extras[i].first) + ":" + quoted(options.extras[i].second);
        json += "}";
    }
    json += "},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"name\":" + quoted(mesh.name) +
            ",\"mesh\":0}],\"meshes\":[{\"name\":" + quoted(mesh.name) + ",\"primitives\":[" + primitives +
            "]}],\"materials\":[" + materials + "],\"accessors\":[" + accessors + "],\"bufferViews\":[" +
            views + "],\"buffers\":[{\"byteLength\":" + std::to_string(bin.size()) + "}]}";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    bin.resize((bin.size() + 3) / 4 * 4, '\0');

    std::string out;
    out.reserve(28 + json.size() + bin.size());
    put_u32(out, glb_magic), put_u32(out, 2),
        put_u32(out, static_cast<std::uint32_t>(28 + json.size() + bin.size()));
    put_u32(out, static_cast<std::uint32_t>(json.size())), put_u32(out, chunk_json), out += json;
    put_u32(out, static_cast<std::uint32_t>(bin.size())), put_u32(out, chunk_bin), out += bin;
    return out;
}

void write_glb(const std::filesystem::path& file, const TriangleMesh& mesh, const GlbOptions& options) {
    const std::string bytes = to_glb(mesh, options);
    std::filesystem::path temporary = file;
    temporary += ".part";
    {
        std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
        out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        out.close();
        if (!out)
            throw MeshError(file.string() +
                            ": cannot be written: check the folder, its permissions and space");
    }
    std::error_code error;
    std::filesystem::rename(temporary, file, error);
    if (error) throw MeshError(file.string() + ": cannot be written: " + error.message());
}

std::vector<std::pair<std::string, std::string>> read_glb_extras(const std::filesystem::path& file) {
    const std::string bytes = read_file_bytes(file, 512u << 20);
    std::uint32_t head[5] = {};
    if (bytes.size() < sizeof head)
        throw MeshError(file.string() + ": too short for a binary glTF: fetch it again");
    std::memcpy(head, bytes.data(), sizeof head);
    if (head[0] != glb_magic || head[4] != chunk_json || head[3] > bytes.size() - sizeof head)
        throw MeshError(file.string() + ": not a whole binary glTF file: fetch it again");
    const std::string json = bytes.substr(sizeof head, head[3]);

    // Only what to_glb writes: {"asset":{...,"extras":{"key":"value",...}. Foreign files may keep theirs to
    // themselves.
    std::vector<std::pair<std::string, std::string>> found;
    const std::string opening = "\"extras\":{";
    std::size_t at = json.find(opening);
    if (json.rfind("{\"asset\":{\"version\":\"2.0\",\"generator\":", 0) != 0 || at == std::string::npos)
        return found;
    at += opening.size();
    const auto text = [&](std::string& out) {
        if (at >= json.size() || json[at] != '"') return false;
        for (++at; at < json.size() && json[at] != '"'; ++at) {
            if (json[at] == '\\') ++at;
            if (at < json.size()) out += json[at];
        }
        return at++ < json.size();
    };
    while (at < json.size() && json[at] != '}') {
        std::string key, value;
        if (!text(key) || at >= json.size() || json[at++] != ':' || !text(value)) return found;
        found.emplace_back(std::move(key), std::move(value));
        if (at < json.size() && json[at] == ',') ++at;
    }
    return found;
}

} // namespace calot::meshio
