#include "geometry/self_contacts.hpp"

#include "geometry/bvh.hpp"
#include "geometry/contact_memory.hpp"
#include "geometry/distance.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <vector>

namespace calot::geometry {
namespace {

constexpr std::uint64_t self_mark = 1ull << 63;
// A node beside the chain makes a contact unless the chain comes nearer along its own segments by more than
// this sine (15 degrees): then a crossing or a neighbour says more.
constexpr double most_closing = 0.2588190451025207;
constexpr double alike_cosine = 0.9659258262890683; // 15 degrees
// A crossing is left out where the nodes around it imply it up to this many radii.
constexpr double implied_tolerance = 0.005;

// Contacts closer than this many radii along the chain count as at one place.
constexpr double same_place = 0.5;

struct Found {
    double t, other_t;
    std::uint32_t other;
    Vec3 axis_point; // on the other axis
    Vec3 normal;
    double gap;
};

bool deeper(const Found& a, const Found& b) {
    return a.gap != b.gap ? a.gap < b.gap : a.other < b.other;
}

using FewFound = Few<Found, SelfContacts::most_per_slot>;
static_assert(SelfContacts::most_per_slot <= ContactMemory::most_per_slot);

// Keeps the deepest, in order.
void keep(FewFound& list, const Found& found) {
    std::size_t at = list.size;
    while (at > 0 && deeper(found, list.items[at - 1]))
        --at;
    if (at == SelfContacts::most_per_slot) return;
    if (list.size < SelfContacts::most_per_slot) ++list.size;
    for (std::size_t i = list.size - 1; i > at; --i)
        list.items[i] = list.items[i - 1];
    list.items[at] = found;
}

// Boxes of eight consecutive segments, or of eight such groups, lane by lane.
struct alignas(32) BoxLanes {
    float lo[3][8], hi[3][8];

    BoxLanes() { clear(); }
    void clear() {
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < 8; ++i) {
                lo[k][i] = std::numeric_limits<float>::infinity();
                hi[k][i] = -lo[k][i];
            }
    }
    void merge(std::size_t lane, const Box& box) {
        for (int k = 0; k < 3; ++k) {
            lo[k][lane] = std::min(lo[k][lane], box.lo[k]);
            hi[k][lane] = std::max(hi[k][lane], box.hi[k]);
        }
    }
    unsigned overlap(const Box& box) const {
        using namespace detail;
        const auto along = [&](int k) {
            return (load8(lo[k]) <= splat8(box.hi[k])) & (load8(hi[k]) >= splat8(box.lo[k]));
        };
        return mask8(along(0) & along(1) & along(2));
    }
};

} // namespace

struct SelfContacts::Impl {
    explicit Impl(std::size_t nodes)
        : most_nodes(nodes), boxes((nodes + 7) / 8), groups((nodes + 63) / 64), arc(nodes), turn(nodes),
          reachable(nodes), at_nodes(nodes), crossings(nodes), memory(2 * nodes, self_mark) {
        contacts.reserve(2 * nodes * most_per_slot);
    }

    std::size_t most_nodes;
    bool valid = true;
    std::vector<BoxLanes> boxes, groups; // of segments; of groups of eight
    std::vector<double> arc;             // length from the base to each node
    std::vector<double> turn; // angle, rad, by which the chain has turned at most up to each segment
    std::vector<std::size_t> reachable; // each segment may touch only those before this one
    std::vector<FewFound> at_nodes, crossings;
    ContactMemory memory;
    std::vector<SelfContact> contacts;

    bool find_reachable(const Chain& chain, double margin);
    void fill_boxes(const Chain& chain, double margin);
    void find_pair(const Chain& chain, double margin, std::size_t segment, std::size_t other);
    void find_beside(const Chain& chain, double margin, std::size_t node, std::size_t other);
    void drop_implied(const Chain& chain, std::size_t segment);
    void drop_beside_crossings(const Chain& chain, std::size_t segment);
    void emit(const Chain& chain, std::size_t slot);
};

// Two places an arc L apart, between which the chain turns by T < pi in all, are at least L cos(T / 2) apart:
// seen along the direction in the middle of the turn no part goes back. So parts that are no neighbours touch
// only where the chain turns enough between them, and a shaft that is nearly straight costs next to nothing.
// False: no part can reach another.
bool SelfContacts::Impl::find_reachable(const Chain& chain, double margin) {
    const std::size_t first = chain.first_segment, segments = chain.radius.size();
    const double thinnest =
        *std::min_element(chain.radius.begin() + static_cast<std::ptrdiff_t>(first), chain.radius.end());
    const double nearest = (2.0 * thinnest + margin) / (neighbour_radii * thinnest);
    const double least_turn = nearest < 1.0 ? 2.0 * std::acos(nearest) - 1e-6 : 0.0;
    const auto direction = [&](std::size_t i) {
        const Vec3 along = chain.node(i + 1) - chain.node(i);
        return (1.0 / norm(along)) * along; // not a number for none
    };
    turn[first] = 0.0;
    reachable[first] = first;
    Vec3 before = direction(first);
    for (std::size_t i = first + 1; i < segments; ++i) {
        const Vec3 now = direction(i);
        const double d = norm(now - before); // twice the sine of half the angle
        turn[i] = turn[i - 1] + (d <= 1.0 ? d * (1.0 + 0.05 * d * d) : std::numbers::pi);
        before = now;
        std::size_t& last = reachable[i] = reachable[i - 1];
        while (last < i && turn[i] - turn[last] >= least_turn)
            ++last;
    }
    return reachable[segments - 1] > first;
}

void SelfContacts::Impl::fill_boxes(const Chain& chain, double margin) {
    const std::size_t segments = chain.radius.size();
    for (std::size_t g = 0; g < (segments + 7) / 8; ++g)
        boxes[g].clear();
    for (std::size_t g = 0; g < (segments + 63) / 64; ++g)
        groups[g].clear();
    arc[chain.first_segment] = 0.0;
    for (std::size_t i = chain.first_segment; i < segments; ++i) {
        const Box box = box_of(chain.node(i), chain.node(i + 1), chain.radius[i] + 0.5 * margin);
        boxes[i / 8].merge(i % 8, box);
        groups[i / 64].merge(i / 8 % 8, box);
        arc[i + 1] = arc[i] + norm(chain.node(i + 1) - chain.node(i));
    }
}

// The inside of a segment across the inside of another.
void SelfContacts::Impl::find_pair(const Chain& chain, double margin, std::size_t segment,
                                   std::size_t other) {
    const double radii = chain.radius[segment] + chain.radius[other], reach = radii + margin;
    const SegmentPair pair = closest_of_segments(chain.node(segment), chain.node(segment + 1),
                                                 chain.node(other), chain.node(other + 1));
    if (!(pair.distance2 <= reach * reach)) return;
    if (!(pair.s > 0.0 && pair.s < 1.0 && pair.t > 0.0 && pair.t < 1.0)) return;
    const double place = arc[segment] + pair.s * (arc[segment + 1] - arc[segment]);
    const double other_place = arc[other] + pair.t * (arc[other + 1] - arc[other]);
    if (place - other_place < neighbour_radii * std::max(chain.radius[segment], chain.radius[other])) return;
    const double distance = std::sqrt(pair.distance2);
    Vec3 normal = pair.on_first - pair.on_second;
    // Axes that meet have no direction between them: across both.
    if (distance < 1e-9)
        normal =
            cross(chain.node(segment + 1) - chain.node(segment), chain.node(other + 1) - chain.node(other));
    const double length = norm(normal);
    if (!(length > 0.0)) return;
    keep(crossings[segment], {pair.s, pair.t, static_cast<std::uint32_t>(other), pair.on_second,
                              (1.0 / length) * normal, distance - radii});
}

// A node beside a segment: `other` may lie on either side along the chain.
void SelfContacts::Impl::find_beside(const Chain& chain, double margin, std::size_t node, std::size_t other) {
    const double radius = chain.node_radius(node), radii = radius + chain.radius[other];
    const Vec3 c = chain.node(node), a = chain.node(other), along = chain.node(other + 1) - a;
    const double length2 = norm2(along);
    const double t = length2 > 0.0 ? std::clamp(dot(c - a, along) / length2, 0.0, 1.0) : 0.0;
    const Vec3 foot = a + t * along, d = c - foot;
    const double distance = norm(d);
    if (!(distance <= radii + margin) || distance < 1e-9) return;
    const double other_place = arc[other] + t * (arc[other + 1] - arc[other]);
    if (std::fabs(arc[node] - other_place) < neighbour_radii * std::max(radius, chain.radius[other])) return;
    // The end of a segment is for the next one to report, and counts only if the one before is no nearer.
    if (t >= 1.0 && other + 1 < chain.radius.size()) return;
    if (t <= 0.0 && other > chain.first_segment && dot(d, chain.node(other - 1) - a) > 0.0) return;
    const auto closing = [&](std::size_t neighbour) {
        const Vec3 step = chain.node(neighbour) - c;
        return -dot(d, step) > most_closing * distance * norm(step);
    };
    if (node + 1 < chain.node_count() && closing(node + 1)) return;
    if (node > chain.first_segment && closing(node - 1)) return;
    keep(at_nodes[node],
         {0.0, t, static_cast<std::uint32_t>(other), foot, (1.0 / distance) * d, distance - radii});
}

// A crossing that the contacts of both ends already hold, as when two parts lie side by side.
void SelfContacts::Impl::drop_implied(const Chain& chain, std::size_t segment) {
    const auto alike = [](const FewFound& list, const Found& found) {
        return std::find_if(list.begin(), list.end(), [&](const Found& end) {
            return dot(end.normal, found.normal) > alike_cosine && end.other + 1 >= found.other &&
                   end.other <= found.other + 1;
        });
    };
    FewFound& list = crossings[segment];
    for (std::size_t i = list.size; i-- > 0;) {
        const Found& found = list.items[i];
        const FewFound &first = at_nodes[segment], &second = at_nodes[segment + 1];
        const Found *a = alike(first, found), *b = alike(second, found);
        if (a != first.end() && b != second.end() &&
            found.gap >=
                (1.0 - found.t) * a->gap + found.t * b->gap - implied_tolerance * chain.radius[segment])
            list.erase(i);
    }
}

// Next to a crossing the four nodes around it say the same again, less deep.
void SelfContacts::Impl::drop_beside_crossings(const Chain& chain, std::size_t segment) {
    const auto drop = [&](std::size_t node, double from_node, std::size_t opposite, const Found& crossing,
                          Vec3 normal) {
        if (from_node > same_place * chain.node_radius(node)) return;
        FewFound& list = at_nodes[node];
        for (std::size_t i = list.size; i-- > 0;) {
            const Found& found = list.items[i];
            if (found.other + 1 >= opposite && found.other <= opposite + 1 && found.gap >= crossing.gap &&
                dot(found.normal, normal) > alike_cosine)
                list.erase(i);
        }
    };
    for (const Found& crossing : crossings[segment]) {
        const std::size_t other = crossing.other;
        const double length = arc[segment + 1] - arc[segment], other_length = arc[other + 1] - arc[other];
        drop(segment, crossing.t * length, other, crossing, crossing.normal);
        drop(segment + 1, (1.0 - crossing.t) * length, other, crossing, crossing.normal);
        drop(other, crossing.other_t * other_length, segment, crossing, -crossing.normal);
        drop(other + 1, (1.0 - crossing.other_t) * other_length, segment, crossing, -crossing.normal);
    }
}

void SelfContacts::Impl::emit(const Chain& chain, std::size_t slot) {
    const std::size_t index = slot / 2;
    const bool at_node = slot % 2 == 0, last = at_node && index == chain.radius.size();
    for (const Found& found : at_node ? at_nodes[index] : crossings[index]) {
        SelfContact contact{};
        contact.segment = static_cast<std::uint32_t>(last ? index - 1 : index);
        contact.t = last ? 1.0 : found.t;
        contact.other_segment = found.other;
        contact.other_t = found.other_t;
        contact.normal = found.normal;
        contact.point = found.axis_point + chain.radius[found.other] * found.normal;
        contact.gap = found.gap;
        memory.add(slot, contact.point, contact.normal, 0);
        contacts.push_back(contact);
    }
}

SelfContacts::SelfContacts(std::size_t most_nodes) : impl_(std::make_unique<Impl>(most_nodes)) {}
SelfContacts::~SelfContacts() = default;
SelfContacts::SelfContacts(SelfContacts&&) noexcept = default;
SelfContacts& SelfContacts::operator=(SelfContacts&&) noexcept = default;

std::span<const SelfContact> SelfContacts::find(const Chain& chain, double margin) {
    Impl& state = *impl_;
    state.contacts.clear();
    state.valid = chain.acceptable(state.most_nodes) && margin >= 0.0 && std::isfinite(margin);
    if (!state.valid) return state.contacts;

    state.memory.start();
    const std::size_t segments = chain.radius.size();
    if (chain.first_segment < segments && state.find_reachable(chain, margin)) {
        state.fill_boxes(chain, margin);
        for (std::size_t i = chain.first_segment; i <= segments; ++i)
            state.at_nodes[i].size = state.crossings[i].size = 0;
        for (std::size_t i = chain.first_segment; i < segments; ++i) {
            const std::size_t reachable = state.reachable[i];
            if (reachable == chain.first_segment) continue;
            const Box box = box_of(chain.node(i), chain.node(i + 1), chain.radius[i] + 0.5 * margin);
            // Each pair once; either one's nodes may lie beside the other.
            for (std::size_t upper = 0; upper <= (reachable - 1) / 64; ++upper)
                for (unsigned g = state.groups[upper].overlap(box); g != 0; g &= g - 1) {
                    const std::size_t group = 8 * upper + __builtin_ctz(g);
                    for (unsigned s = state.boxes[group].overlap(box); s != 0; s &= s - 1) {
                        const std::size_t other = 8 * group + __builtin_ctz(s);
                        if (other >= reachable) break;
                        // Nothing on these two can be far enough apart along the chain.
                        if (state.arc[i + 1] - state.arc[other] <
                            neighbour_radii * std::max(chain.radius[i], chain.radius[other]))
                            continue;
                        state.find_pair(chain, margin, i, other);
                        state.find_beside(chain, margin, i, other);
                        state.find_beside(chain, margin, other, i);
                        if (i + 1 == segments) state.find_beside(chain, margin, segments, other);
                    }
                }
        }
        for (std::size_t i = chain.first_segment; i < segments; ++i)
            state.drop_implied(chain, i);
        for (std::size_t i = chain.first_segment; i < segments; ++i)
            state.drop_beside_crossings(chain, i);
        const std::size_t first = 2 * chain.first_segment, last = 2 * segments + 1;
        for (std::size_t slot = first; slot < last; ++slot)
            state.emit(chain, slot);
        const auto radius = [&](std::size_t slot) {
            return slot % 2 == 0 ? chain.node_radius(slot / 2) : chain.radius[slot / 2];
        };
        auto contact = state.contacts.begin();
        state.memory.identify(first, last, radius, [&](std::uint64_t id) { (contact++)->id = id; });
    }
    state.memory.finish();
    return state.contacts;
}

bool SelfContacts::valid() const {
    return impl_->valid;
}

void SelfContacts::reset() {
    impl_->memory.reset();
    impl_->valid = true;
    impl_->contacts.clear();
}

std::size_t SelfContacts::state_size() const {
    return impl_->memory.state_size();
}
void SelfContacts::save(std::span<std::byte> state) const {
    impl_->memory.save(state);
}

bool SelfContacts::load(std::span<const std::byte> state) {
    if (!impl_->memory.load(state)) return false;
    impl_->valid = true;
    impl_->contacts.clear();
    return true;
}

} // namespace calot::geometry
