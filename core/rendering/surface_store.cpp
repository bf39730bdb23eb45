#include "rendering/surface_store.hpp"

#include "rendering/linear.hpp"
#include "rendering/noise_volume.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace calot::rendering {
namespace {

using PackedNormal = std::array<std::int16_t, 4>;

PackedNormal pack(const std::array<float, 3>& n, float concave) {
    const auto to = [](float v) {
        return static_cast<std::int16_t>(std::lround(std::clamp(v, -1.0f, 1.0f) * 32767));
    };
    return {to(n[0]), to(n[1]), to(n[2]), to(concave)};
}

template<class T>
Buffer upload(const std::vector<T>& data, GLenum usage) {
    Buffer buffer = make_buffer();
    glBindBuffer(GL_ARRAY_BUFFER, *buffer);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(data.size() * sizeof(T)), data.data(), usage);
    return buffer;
}

} // namespace

SurfaceStore::SurfaceStore(std::vector<Appearance> appearances)
    : appearances_(std::move(appearances)), stream_(make_buffer()) {}

void SurfaceStore::bind_attributes(Entry& e) {
    glBindVertexArray(*e.array);
    glBindBuffer(GL_ARRAY_BUFFER, e.moved ? *e.moved : *e.rest);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glBindBuffer(GL_ARRAY_BUFFER, *e.normals);
    glVertexAttribPointer(1, 4, GL_SHORT, GL_TRUE, 0, nullptr);
    glBindBuffer(GL_ARRAY_BUFFER, *e.colours);
    glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, 0, nullptr);
    glBindBuffer(GL_ARRAY_BUFFER, *e.rest);
    glVertexAttribPointer(3, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    for (GLuint i = 0; i < 4; ++i)
        glEnableVertexAttribArray(i);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, *stream_);
    glBindVertexArray(0);
}

SurfaceId SurfaceStore::add(const Surface& s) {
    check(s);
    Entry e;
    e.name = s.name;
    e.mesh = cluster(s);
    for (const auto& group : e.mesh.groups)
        e.outer.push_back(find_appearance(appearances_, group.appearance));
    e.inner =
        s.inner_appearance.empty() ? appearances_.size() : find_appearance(appearances_, s.inner_appearance);
    e.vertices = s.vertices;
    const auto normals = s.normals.empty() ? vertex_normals(s) : s.normals;
    e.concave = concavity(s, normals);
    std::vector<PackedNormal> packed(normals.size());
    for (std::size_t i = 0; i < packed.size(); ++i)
        packed[i] = pack(normals[i], e.concave[i]);
    e.rest = upload(s.vertices, GL_STATIC_DRAW);
    e.normals = upload(packed, GL_STATIC_DRAW);
    e.colours = upload(s.colours.empty()
                           ? std::vector<std::array<std::uint8_t, 4>>(s.vertices.size(), {255, 255, 255, 255})
                           : s.colours,
                       GL_STATIC_DRAW);
    const Appearance& pattern = appearances_[e.inner < appearances_.size() ? e.inner : e.outer.front()];
    std::vector<std::array<std::uint8_t, 4>> patches(s.vertices.size());
    for (std::size_t i = 0; i < patches.size(); ++i) {
        const auto noise = patch_noise(s.vertices[i], pattern.patch, pattern.mesh);
        for (std::size_t k = 0; k < 3; ++k) patches[i][k] = static_cast<std::uint8_t>(std::lround(noise[k] * 255));
    }
    e.patches = upload(patches, GL_STATIC_DRAW);
    e.array = make_vertex_array();
    bind_attributes(e);
    entries_.push_back(std::move(e));
    return SurfaceId{static_cast<std::uint32_t>(entries_.size() - 1)};
}

void SurfaceStore::update_vertices(SurfaceId id, std::size_t first,
                                   std::span<const std::array<float, 3>> vertices,
                                   std::span<const std::array<float, 3>> normals) {
    const auto index = static_cast<std::size_t>(id);
    if (index >= entries_.size()) throw std::out_of_range("update_vertices: no surface with this id");
    Entry& e = entries_[index];
    if (first > e.vertices.size() || vertices.size() > e.vertices.size() - first ||
        (!normals.empty() && normals.size() != vertices.size()))
        throw std::out_of_range("update_vertices: surface \"" + e.name +
                                "\": range past the last vertex, or normals of another count");
    std::copy(vertices.begin(), vertices.end(), e.vertices.begin() + static_cast<std::ptrdiff_t>(first));
    if (!e.moved) {
        e.moved = upload(e.vertices, GL_DYNAMIC_DRAW);
        bind_attributes(e);
    } else {
        glBindBuffer(GL_ARRAY_BUFFER, *e.moved);
        glBufferSubData(GL_ARRAY_BUFFER, static_cast<GLintptr>(first * sizeof(vertices[0])),
                        static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data());
    }
    if (!normals.empty()) {
        std::vector<PackedNormal> packed(normals.size());
        for (std::size_t i = 0; i < packed.size(); ++i)
            packed[i] = pack(normals[i], e.concave[first + i]);
        glBindBuffer(GL_ARRAY_BUFFER, *e.normals);
        glBufferSubData(GL_ARRAY_BUFFER, static_cast<GLintptr>(first * sizeof(PackedNormal)),
                        static_cast<GLsizeiptr>(packed.size() * sizeof(PackedNormal)), packed.data());
    }
    for (Cluster& c : e.mesh.clusters)
        update_bounds(c, e.mesh.triangles, e.vertices);
}

std::vector<DrawItem> SurfaceStore::select(const ViewCone& cone, const std::vector<SurfaceState>& states,
                                           bool endoscope) {
    std::vector<const SurfaceState*> state_of(entries_.size(), nullptr);
    for (const SurfaceState& s : states)
        if (static_cast<std::size_t>(s.id) < entries_.size()) state_of[static_cast<std::size_t>(s.id)] = &s;

    std::vector<std::pair<float, DrawItem>> items;
    indices_.clear();
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        const Entry& e = entries_[i];
        const SurfaceState fallback;
        const SurfaceState& state = state_of[i] ? *state_of[i] : fallback;
        if (state.style == Style::Hidden || (state.style == Style::EndoscopeOnly && !endoscope)) continue;
        const Eigen::Matrix3d rotation = to_matrix(state.pose.rotation);
        const Eigen::Vector3d origin = to_eigen(state.pose.position);
        // The cone in the object's frame.
        const Eigen::Vector3f eye = (rotation.transpose() * (cone.eye - origin)).cast<float>();
        const Eigen::Vector3f axis = (rotation.transpose() * cone.axis).cast<float>();
        for (std::size_t g = 0; g < e.mesh.groups.size(); ++g) {
            const auto& group = e.mesh.groups[g];
            for (const bool split : {false, true}) {
                if (split && cone.split_angle <= 0) continue;
                order_.clear();
                for (std::size_t c = group.first_cluster; c < group.first_cluster + group.cluster_count;
                     ++c) {
                    const Cluster& k = e.mesh.clusters[c];
                    const Eigen::Vector3f to(k.centre[0] - eye.x(), k.centre[1] - eye.y(),
                                             k.centre[2] - eye.z());
                    const float distance = to.norm();
                    if (distance - k.radius > cone.reach) continue;
                    if (distance > k.radius) {
                        const float angle = std::acos(std::clamp(to.dot(axis) / distance, -1.0f, 1.0f));
                        if (angle - std::asin(k.radius / distance) > cone.half_angle) continue;
                    }
                    const float clearance = std::max(distance - k.radius, 0.0f);
                    const bool near = cone.split_angle > 0 && k.longest_edge > cone.split_angle * clearance;
                    if (near == split)
                        order_.emplace_back(distance - k.radius, static_cast<std::uint32_t>(c));
                }
                if (order_.empty()) continue;
                std::sort(order_.begin(), order_.end());
                DrawItem item;
                item.surface = i;
                item.outer = e.outer[g];
                item.inner = e.inner < appearances_.size() ? e.inner : e.outer[g];
                item.first = indices_.size();
                item.split = split;
                item.style = state.style;
                item.rotation = rotation.cast<float>();
                item.origin = origin.cast<float>();
                for (const auto& [distance, c] : order_) {
                    const Cluster& k = e.mesh.clusters[c];
                    const std::uint32_t* begin = e.mesh.triangles[k.first].data();
                    indices_.insert(indices_.end(), begin, begin + 3 * k.count);
                }
                item.count = indices_.size() - item.first;
                items.emplace_back(order_.front().first, item);
            }
        }
    }
    std::stable_sort(items.begin(), items.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    glBindVertexArray(0);
    glBindBuffer(GL_ARRAY_BUFFER, *stream_);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices_.size() * sizeof(std::uint32_t)),
                 indices_.data(), GL_STREAM_DRAW);
    std::vector<DrawItem> out;
    out.reserve(items.size());
    for (auto& [distance, item] : items)
        out.push_back(item);
    return out;
}

void SurfaceStore::bind(const DrawItem& item) const {
    glBindVertexArray(*entries_[item.surface].array);
}

std::size_t SurfaceStore::triangle_count() const {
    std::size_t sum = 0;
    for (const Entry& e : entries_)
        sum += e.mesh.triangles.size();
    return sum;
}

} // namespace calot::rendering
