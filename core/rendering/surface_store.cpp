#include "rendering/surface_store.hpp"

#include "rendering/linear.hpp"
#include "rendering/tissue_look.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace calot::rendering {
namespace {

using PackedNormal = std::array<std::int16_t, 4>; // the fourth number fills a word

PackedNormal pack(const std::array<float, 3>& n) {
    const auto to = [](float v) {
        return static_cast<std::int16_t>(std::lround(std::clamp(v, -1.0f, 1.0f) * 32767));
    };
    return {to(n[0]), to(n[1]), to(n[2]), 0};
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
    glVertexAttribPointer(1, 3, GL_SHORT, GL_TRUE, sizeof(PackedNormal), nullptr);
    glBindBuffer(GL_ARRAY_BUFFER, *e.look);
    const auto look = [](GLuint index, std::size_t offset) {
        glVertexAttribPointer(index, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(LookVertex),
                              reinterpret_cast<const void*>(offset));
    };
    look(2, offsetof(LookVertex, outer));
    look(3, offsetof(LookVertex, inner));
    look(4, offsetof(LookVertex, gloss));
    look(5, offsetof(LookVertex, open));
    glBindBuffer(GL_ARRAY_BUFFER, *e.rest);
    glVertexAttribPointer(6, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    for (GLuint i = 0; i < 7; ++i)
        glEnableVertexAttribArray(i);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, *stream_);
    glBindVertexArray(0);
}

SurfaceId SurfaceStore::add(const Surface& s) {
    check(s);
    Entry e;
    e.name = s.name;
    e.mesh = cluster(s);
    e.vertices = s.vertices;
    const auto normals = s.normals.empty() ? vertex_normals(s) : s.normals;
    e.look = upload(tissue_look(s, concavity(s, normals), appearances_), GL_STATIC_DRAW);
    std::vector<PackedNormal> packed(normals.size());
    std::transform(normals.begin(), normals.end(), packed.begin(), pack);
    e.rest = upload(s.vertices, GL_STATIC_DRAW);
    e.normals = upload(packed, GL_STATIC_DRAW);
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
        std::transform(normals.begin(), normals.end(), packed.begin(), pack);
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
    const SurfaceState as_it_is;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
        const Entry& e = entries_[i];
        const SurfaceState& state = state_of[i] ? *state_of[i] : as_it_is;
        if (state.style == Style::Hidden || (state.style == Style::EndoscopeOnly && !endoscope)) continue;
        const Eigen::Matrix3d rotation = to_matrix(state.pose.rotation);
        const Eigen::Vector3d origin = to_eigen(state.pose.position);
        // The cone in the object's frame.
        const Eigen::Vector3f eye = (rotation.transpose() * (cone.eye - origin)).cast<float>();
        const Eigen::Vector3f axis = (rotation.transpose() * cone.axis).cast<float>();
        const auto half_angle = static_cast<float>(cone.half_angle), reach = static_cast<float>(cone.reach);
        const auto split_angle = static_cast<float>(cone.split_angle);
        whole_.clear();
        split_.clear();
        for (std::size_t c = 0; c < e.mesh.clusters.size(); ++c) {
            const Cluster& k = e.mesh.clusters[c];
            const Eigen::Vector3f to = Eigen::Vector3f(k.centre[0], k.centre[1], k.centre[2]) - eye;
            const float distance = to.norm();
            const float clearance = std::max(distance - k.radius, 0.0f);
            if (clearance > reach) continue;
            if (distance > k.radius) {
                const float angle = std::acos(std::clamp(to.dot(axis) / distance, -1.0f, 1.0f));
                if (angle - std::asin(k.radius / distance) > half_angle) continue;
            }
            const bool near = split_angle > 0 && k.longest_edge > split_angle * clearance;
            (near ? split_ : whole_).emplace_back(clearance, static_cast<std::uint32_t>(c));
        }
        for (auto* chosen : {&whole_, &split_}) {
            if (chosen->empty()) continue;
            std::sort(chosen->begin(), chosen->end());
            DrawItem item;
            item.surface = i;
            item.first = indices_.size();
            item.split = chosen == &split_;
            item.style = state.style;
            item.rotation = rotation.cast<float>();
            item.origin = origin.cast<float>();
            for (const auto& [distance, c] : *chosen) {
                const Cluster& k = e.mesh.clusters[c];
                const std::uint32_t* begin = e.mesh.triangles[k.first].data();
                indices_.insert(indices_.end(), begin, begin + 3 * k.count);
            }
            item.count = indices_.size() - item.first;
            items.emplace_back(chosen->front().first, item);
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
