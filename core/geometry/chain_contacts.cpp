#include "geometry/chain_contacts.hpp"

#include "geometry/candidates.hpp"
#include "geometry/contact_memory.hpp"
#include "geometry/surface_minima.hpp"

#include <algorithm>
#include <array>
#include <tuple>
#include <vector>

namespace calot::geometry {
namespace {

// Directions closer than this push alike; widened stepwise when more than the allowed number remain.
constexpr double widening_cosines[] = {
    0.9659258262890683, 0.8660254037844386, 0.7071067811865476, 0.5, 0.2588190451025207, 0.0};
constexpr double alike_cosine = widening_cosines[0]; // 15 degrees
// Contacts on one segment closer than this many radii along it count as at one place.
constexpr double same_place = 0.5;
// What the ends of a segment imply up to this many radii is not said again.
constexpr double implied_tolerance = 0.005;
struct Found {
    Minimum minimum;
    double gap;
};

bool deeper(const Found& a, const Found& b) {
    return a.gap != b.gap ? a.gap < b.gap : a.minimum.part < b.minimum.part;
}

// The deepest minima of one node or segment; which ones remain does not depend on the order of arrival.
class FoundList {
  public:
    void clear() {
        size_ = 0;
        overflowed_ = false;
    }
    void add(const Found& found) {
        if (size_ == items_.size()) {
            std::sort(items_.begin(), items_.end(), deeper);
            size_ = kept;
            overflowed_ = true;
        }
        items_[size_++] = found;
    }
    void sort() {
        std::sort(items_.begin(), items_.begin() + size_, deeper);
        if (overflowed_ && size_ > kept) size_ = kept;
    }
    template<class Predicate>
    void drop_if(Predicate&& predicate) {
        size_ = std::remove_if(items_.begin(), items_.begin() + size_, predicate) - items_.begin();
    }
    const Found* begin() const { return items_.data(); }
    const Found* end() const { return items_.data() + size_; }
    std::size_t size() const { return size_; }

  private:
    static constexpr std::size_t kept = 128;
    std::array<Found, 2 * kept> items_;
    std::size_t size_ = 0;
    bool overflowed_ = false;
};

constexpr std::size_t most = std::max(ChainContacts::most_per_node, ChainContacts::most_per_segment);
static_assert(most <= ContactMemory::most_per_slot);
using FewFound = Few<Found, most>;
using FewEdges = Few<std::uint32_t, Candidates::most_edges>;

// Keeps, deepest first, what no deeper one at the same place resembles, widening "resembles" until it fits.
void thin(const FoundList& sorted, double length, double radius, std::size_t limit, FewFound& kept) {
    double place = same_place * radius;
    for (const double cosine : widening_cosines) {
        kept.size = 0;
        bool fits = true;
        for (const Found& found : sorted) {
            const bool covered = std::any_of(kept.begin(), kept.end(), [&](const Found& other) {
                return dot(found.minimum.normal, other.minimum.normal) > cosine &&
                       std::fabs(found.minimum.t - other.minimum.t) * length <= place;
            });
            if (covered) continue;
            if (kept.size == limit) {
                fits = false;
                break;
            }
            kept.push(found);
        }
        if (fits) return;
        place *= 1.5;
    }
    // Still more: the deepest.
}

} // namespace

struct ChainContacts::Impl {
    explicit Impl(std::size_t nodes)
        : most_nodes(nodes), nodes_found(nodes), segments_found(nodes), memory(2 * nodes, 0),
          candidates(nodes), last_nodes(nodes) {
        contacts.reserve(nodes * (most_per_node + most_per_segment));
    }

    std::size_t most_nodes;
    bool valid = true;
    FoundList list;
    std::vector<FewFound> nodes_found, segments_found;
    ContactMemory memory;
    std::vector<Contact> contacts;
    // Never part of a result: they only save questions to the tree.
    std::vector<Candidates> candidates;
    std::vector<Vec3> last_nodes;
    std::size_t last_count = 0; // of nodes that last_nodes tells of
    std::array<FewEdges, 2>
        crossed_edges; // of an even and an odd segment, between its node's turn and its own

    bool remembers(const TriangleScene& scene, std::size_t slot) const {
        return candidates[slot].are_screens_of(scene) && candidates[slot].complete();
    }
    void refresh(const TriangleScene& scene, const Chain& chain, double margin);
    void find_at_node(const TriangleScene& scene, const Chain& chain, double margin, std::size_t node);
    void find_on_segment(const TriangleScene& scene, const Chain& chain, double margin, std::size_t segment);
    template<class Visitors>
    void look_behind(const TriangleScene& scene, std::size_t slot, double radius, const Box& box,
                     Visitors&& visitors);
    void drop_implied(std::size_t segment, double radius);
    void drop_shared(const Chain& chain, std::size_t segment);
    void emit(const TriangleScene& scene, const Chain& chain, std::size_t slot);
};

bool Chain::acceptable(std::size_t most_nodes) const {
    const std::size_t n = node_count();
    if (n < 2 || n > most_nodes || y.size() != n || z.size() != n || radius.size() != n - 1) return false;
    for (std::size_t i = first_segment; i < n; ++i)
        if (!is_finite(node(i))) return false;
    return std::all_of(radius.begin(), radius.end(), [](double r) { return r > 0.0 && std::isfinite(r); });
}

// Sees to it that every slot's candidates hold. The tree is asked for a place ahead in the direction of
// motion.
void ChainContacts::Impl::refresh(const TriangleScene& scene, const Chain& chain, double margin) {
    const std::size_t n = chain.node_count();
    if (last_count != n) { // nothing is known of its motion
        for (std::size_t i = chain.first_segment; i < n; ++i)
            last_nodes[i] = chain.node(i);
        last_count = n;
    }
    // Candidates shall last about a dozen ticks; the place to ask for is as far ahead as their slack allows.
    const auto slack_at = [&](std::size_t i, std::size_t end) {
        const double motion2 =
            std::max(norm2(chain.node(i) - last_nodes[i]), norm2(chain.node(end) - last_nodes[end]));
        const double least = scene.has_screens() ? Candidates::least_slack : Candidates::least_moving_slack;
        return std::clamp(9.0 * std::sqrt(motion2), least, Candidates::most_slack);
    };
    const auto ahead = [&](std::size_t i, double slack) {
        constexpr double ticks = 9.0;
        const Vec3 p = chain.node(i), motion = ticks * (p - last_nodes[i]);
        const double length = norm(motion), farthest = 0.9 * slack;
        return length <= farthest ? p + motion : p + (farthest / length) * motion;
    };
    // A few go before they must, so that a chain that moves as one does not ask for all of its nodes in one
    // tick.
    std::size_t early = n / 16 + 1;
    for (std::size_t i = chain.first_segment; i < n; ++i) {
        const std::size_t end = i + 1 < n ? i + 1 : i;
        const double reach = chain.node_radius(i) + margin;
        const Vec3 p0 = chain.node(i), p1 = chain.node(end);
        Candidates& near = candidates[i];
        bool holds = scene.has_screens() ? near.hold(scene.version(), p0, p1, reach)
                                         : near.hold_moving(scene, p0, p1, reach);
        if (holds && early > 0 && near.aging(p0, last_nodes[i])) {
            --early;
            holds = false;
        }
        if (!holds) {
            const double slack = slack_at(i, end);
            const Vec3 q0 = ahead(i, slack), q1 = ahead(end, slack);
            if (scene.has_screens())
                near.gather(scene, q0, q1, reach, slack);
            else
                near.gather_moving(scene, q0, q1, reach, slack);
        }
        if (!near.are_screens_of(scene)) near.make_screens(scene);
    }
    for (std::size_t i = chain.first_segment; i < n; ++i)
        last_nodes[i] = chain.node(i);
}

void ChainContacts::Impl::find_at_node(const TriangleScene& scene, const Chain& chain, double margin,
                                       std::size_t node) {
    const double radius = chain.node_radius(node), reach = radius + margin;
    const Vec3 c = chain.node(node);
    list.clear();
    Minimum minimum;
    const auto keep = [&](bool found) {
        if (found && !minimum.behind) list.add({minimum, minimum.distance - radius});
    };
    const auto face = [&](std::uint32_t part) { keep(face_minimum(scene, part, c, reach, minimum)); };
    const auto edge = [&](std::uint32_t part) { keep(edge_minimum(scene, part, c, reach, false, minimum)); };
    const auto vertex = [&](std::uint32_t part) { keep(vertex_minimum(scene, part, c, reach, minimum)); };
    if (remembers(scene, node)) {
        const Candidates& near = candidates[node];
        FewEdges& crossed = crossed_edges[node % 2];
        crossed.size = 0;
        near.faces(c, reach, face);
        for (const std::uint32_t part : near.vertices())
            vertex(part);
        near.edges(c, chain.node(std::min(node + 1, chain.node_count() - 1)), reach, edge,
                   [&](std::uint32_t part) { crossed.push(part); });
    } else {
        visit_parts(scene, box_of(c, c, reach), face, edge, [&](std::uint32_t part) {
            if (!scene.has_screens() || scene.is_salient(part)) vertex(part);
        });
    }
    look_behind(scene, 2 * node, radius, box_of(c, c, radius), [&](auto&& add) {
        return std::tuple{[&, add](std::uint32_t part) {
                              if (face_minimum(scene, part, c, radius, minimum)) add(minimum);
                          },
                          [&, add](std::uint32_t part) {
                              if (edge_minimum(scene, part, c, radius, true, minimum)) add(minimum);
                          },
                          [&, add](std::uint32_t part) {
                              if (vertex_minimum(scene, part, c, radius, minimum)) add(minimum);
                          }};
    });
    list.sort();
    thin(list, 0.0, radius, most_per_node, nodes_found[node]);
}

void ChainContacts::Impl::find_on_segment(const TriangleScene& scene, const Chain& chain, double margin,
                                          std::size_t segment) {
    const double radius = chain.radius[segment], reach = radius + margin;
    const Vec3 p0 = chain.node(segment), p1 = chain.node(segment + 1);
    list.clear();
    Minimum minimum;
    const auto keep = [&](bool found) {
        if (found && !minimum.behind) list.add({minimum, minimum.distance - radius});
    };
    const auto face = [](std::uint32_t) {};
    const auto edge = [&](std::uint32_t part) {
        keep(edge_minimum_along(scene, part, p0, p1, reach, minimum));
    };
    const auto vertex = [&](std::uint32_t part) {
        keep(vertex_minimum_along(scene, part, p0, p1, reach, minimum));
    };
    if (remembers(scene, segment)) {
        for (const std::uint32_t part : crossed_edges[segment % 2])
            edge(part);
        for (const std::uint32_t part : candidates[segment].vertices())
            vertex(part);
    } else {
        visit_parts(scene, box_of(p0, p1, reach), face, edge, [&](std::uint32_t part) {
            if (!scene.has_screens() || scene.is_salient(part)) vertex(part);
        });
    }
    look_behind(scene, 2 * segment + 1, radius, box_of(p0, p1, radius), [&](auto&& add) {
        return std::tuple{face,
                          [&, add](std::uint32_t part) {
                              if (edge_minimum_along(scene, part, p0, p1, radius, minimum)) add(minimum);
                          },
                          [&, add](std::uint32_t part) {
                              if (vertex_minimum_along(scene, part, p0, p1, radius, minimum)) add(minimum);
                          }};
    });
    drop_implied(segment, radius);
    list.sort();
    thin(list, norm(p1 - p0), radius, most_per_segment, segments_found[segment]);
}

// A surface that was touched and is not seen from the front any more was left, or the centreline has sunk
// through it: then it is found from behind, where the memory of this slot expects it. `visitors(add)` gives
// the three visitors that add(minimum) whatever is within a radius.
template<class Visitors>
void ChainContacts::Impl::look_behind(const TriangleScene& scene, std::size_t slot, double radius,
                                      const Box& box, Visitors&& visitors) {
    const auto resembles = [&](const Minimum& minimum, const RememberedContact& before) {
        return scene.triangles()[minimum.position].organ == before.organ &&
               dot(minimum.normal, before.normal) > ContactMemory::same_cosine &&
               norm2(minimum.point - before.point) < radius * radius;
    };
    ContactMemory::Slot lost;
    for (const RememberedContact& before : memory.before(slot))
        if (std::none_of(list.begin(), list.end(),
                         [&](const Found& found) { return resembles(found.minimum, before); }))
            lost.push(before);
    if (lost.size == 0) return;
    const auto add = [&](const Minimum& minimum) {
        if (minimum.behind && std::any_of(lost.begin(), lost.end(),
                                          [&](const auto& before) { return resembles(minimum, before); }))
            list.add({minimum, -minimum.distance - radius});
    };
    const auto [face, edge, vertex] = visitors(add);
    visit_parts(scene, box, face, edge, vertex);
}

// The ends of a segment hold a flat or hollow wall; its inside adds a contact only where the wall bulges.
void ChainContacts::Impl::drop_implied(std::size_t segment, double radius) {
    const auto most_alike = [](const FewFound& end, Vec3 normal) {
        const Found* best = nullptr;
        double best_cosine = alike_cosine;
        for (const Found& found : end)
            if (dot(found.minimum.normal, normal) > best_cosine) {
                best_cosine = dot(found.minimum.normal, normal);
                best = &found;
            }
        return best;
    };
    list.drop_if([&](const Found& found) {
        const Found* first = most_alike(nodes_found[segment], found.minimum.normal);
        const Found* second = most_alike(nodes_found[segment + 1], found.minimum.normal);
        const double t = found.minimum.t;
        return first && second &&
               found.gap >= (1.0 - t) * first->gap + t * second->gap - implied_tolerance * radius;
    });
}

// A part that the inside of a segment touches is not also touched by its ends; and of two contacts in one
// place and direction, one at the end and one just inside, the deeper stays.
void ChainContacts::Impl::drop_shared(const Chain& chain, std::size_t segment) {
    const double length = norm(chain.node(segment + 1) - chain.node(segment));
    FewFound& inside = segments_found[segment];
    for (std::size_t s = inside.size; s-- > 0;) {
        bool keep = true;
        for (const std::size_t node : {segment, segment + 1}) {
            FewFound& ends = nodes_found[node];
            const double from_end =
                (node == segment ? inside.items[s].minimum.t : 1.0 - inside.items[s].minimum.t);
            const bool near = from_end * length < 0.1 * chain.radius[segment];
            for (std::size_t e = ends.size; keep && e-- > 0;) {
                const Found& a = inside.items[s];
                const Found& b = ends.items[e];
                const bool alike = dot(a.minimum.normal, b.minimum.normal) > alike_cosine;
                const bool same = a.minimum.part == b.minimum.part && a.minimum.behind == b.minimum.behind;
                if (same || (near && alike && a.gap < b.gap))
                    ends.erase(e);
                else if (near && alike)
                    keep = false;
            }
        }
        if (!keep) inside.erase(s);
    }
}

void ChainContacts::Impl::emit(const TriangleScene& scene, const Chain& chain, std::size_t slot) {
    const std::size_t index = slot / 2;
    const bool at_node = slot % 2 == 0;
    for (const Found& found : at_node ? nodes_found[index] : segments_found[index]) {
        const TriangleScene::Triangle& triangle = scene.triangles()[found.minimum.position];
        Contact contact{};
        contact.organ = triangle.organ;
        contact.region = triangle.region;
        contact.triangle = triangle.id;
        contact.segment = static_cast<std::uint32_t>(index);
        contact.t = found.minimum.t;
        if (at_node) {
            // At a step in radius the contact belongs to the thicker side; at the last node to the last
            // segment.
            const bool before =
                index == chain.radius.size() ||
                (index > chain.first_segment && chain.radius[index - 1] > chain.radius[index]);
            contact.segment -= before ? 1 : 0;
            contact.t = before ? 1.0 : 0.0;
        }
        contact.point = found.minimum.point;
        contact.normal = found.minimum.normal;
        contact.gap = found.gap;
        contact.friction = scene.friction(triangle);
        memory.add(slot, contact.point, contact.normal, contact.organ);
        contacts.push_back(contact);
    }
}

ChainContacts::ChainContacts(std::size_t most_nodes) : impl_(std::make_unique<Impl>(most_nodes)) {}
ChainContacts::~ChainContacts() = default;
ChainContacts::ChainContacts(ChainContacts&&) noexcept = default;
ChainContacts& ChainContacts::operator=(ChainContacts&&) noexcept = default;

std::span<const Contact> ChainContacts::find(const TriangleScene& scene, const Chain& chain, double margin) {
    Impl& state = *impl_;
    state.contacts.clear();
    state.valid = chain.acceptable(state.most_nodes) && margin >= 0.0 && std::isfinite(margin);
    if (!state.valid) return state.contacts;

    state.memory.start();
    if (chain.first_segment < chain.radius.size()) {
        const std::size_t n = chain.node_count();
        state.refresh(scene, chain, margin);
        for (std::size_t i = chain.first_segment; i < n; ++i) {
            state.find_at_node(scene, chain, margin, i);
            if (i > chain.first_segment) state.find_on_segment(scene, chain, margin, i - 1);
        }
        for (std::size_t i = chain.first_segment; i + 1 < n; ++i)
            state.drop_shared(chain, i);
        const std::size_t first = 2 * chain.first_segment, last = 2 * n - 1;
        for (std::size_t slot = first; slot < last; ++slot)
            state.emit(scene, chain, slot);
        const auto radius = [&](std::size_t slot) {
            return slot % 2 == 0 ? chain.node_radius(slot / 2) : chain.radius[slot / 2];
        };
        auto contact = state.contacts.begin();
        state.memory.identify(first, last, radius, [&](std::uint64_t id) { (contact++)->id = id; });
    }
    state.memory.finish();
    return state.contacts;
}

bool ChainContacts::valid() const {
    return impl_->valid;
}

void ChainContacts::reset() {
    impl_->memory.reset();
    impl_->valid = true;
    impl_->contacts.clear();
}

std::size_t ChainContacts::state_size() const {
    return impl_->memory.state_size();
}
void ChainContacts::save(std::span<std::byte> state) const {
    impl_->memory.save(state);
}

bool ChainContacts::load(std::span<const std::byte> state) {
    if (!impl_->memory.load(state)) return false;
    impl_->valid = true;
    impl_->contacts.clear();
    return true;
}

} // namespace calot::geometry
