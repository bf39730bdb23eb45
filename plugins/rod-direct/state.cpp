// What steers the future, as one flat row of scalars.
#include "direct_rod.hpp"

#include <cmath>

namespace calot::rod_direct {

namespace {

constexpr std::size_t contact_values = 9, single_values = 8;
constexpr double two_32 = 4294967296.0;

} // namespace

std::size_t DirectRod::state_size() const {
    // Nodes: position, velocity; frames with the two cross-sections; segments: spin, force, rest curvature.
    return 6 * at(n_) + 4 * at(n_ + 1) + 9 * at(m_) + single_values + contact_values * rows_.size();
}

// One list for both directions: `f` sees every scalar in the order of the state.
template<class Rod, class F>
void DirectRod::visit_state(Rod& rod, F f) {
    for (auto* group : {rod.x_, rod.v_, rod.spin_, rod.force_})
        for (int i = 0; i < 3; ++i)
            for (auto& v : group[i])
                f(v);
    for (auto& q : rod.q_)
        for (auto& v : q)
            f(v);
    for (auto& v : rod.rest_darboux_)
        f(v);
    f(rod.advance_), f(rod.roll_), f(rod.axial_cap_), f(rod.roll_cap_);
}

void DirectRod::save(std::span<double> state) const {
    std::size_t to = 0;
    visit_state(*this, [&](const double& v) { state[to++] = v; });
    state[to++] = base_was_clamped_ ? 1.0 : 0.0;
    state[to++] = tip_was_clamped_ ? 1.0 : 0.0;
    state[to++] = is_calm_ ? 1.0 : 0.0;
    state[to++] = static_cast<double>(memory_count_);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const ContactMemory m = k < memory_count_ ? memory_[k] : ContactMemory{};
        const double high = static_cast<double>(m.id >> 32), low = static_cast<double>(m.id & 0xffffffffu);
        for (double v : {high, low, m.anchor.x, m.anchor.y, m.anchor.z, m.f.x, m.f.y, m.f.z, m.most_normal})
            state[to++] = v;
    }
}

bool DirectRod::load(std::span<const double> state) {
    if (state.size() != state_size()) return false;
    for (double v : state)
        if (!(std::fabs(v) < 1e300)) return false;
    const std::size_t contacts = state.size() - contact_values * rows_.size();
    const double count = state[contacts - 1];
    if (!(count >= 0.0 && count <= static_cast<double>(rows_.size())) || count != std::floor(count))
        return false;
    for (std::size_t k = 0; k < rows_.size(); ++k)
        for (std::size_t i : {0, 1}) {
            const double half = state[contacts + contact_values * k + i];
            if (!(half >= 0.0 && half < two_32) || half != std::floor(half)) return false;
        }
    std::size_t from = 0;
    visit_state(*this, [&](double& v) { v = state[from++]; });
    base_was_clamped_ = state[from++] != 0.0;
    tip_was_clamped_ = state[from++] != 0.0;
    is_calm_ = state[from++] != 0.0;
    memory_count_ = static_cast<std::size_t>(count);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const double* s = state.data() + contacts + contact_values * k;
        const auto id = (static_cast<std::uint64_t>(s[0]) << 32) | static_cast<std::uint64_t>(s[1]);
        memory_[k] = {id, {s[2], s[3], s[4]}, {s[5], s[6], s[7]}, s[8]};
    }
    update_joints();
    return true;
}

} // namespace calot::rod_direct
