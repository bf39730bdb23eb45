// What steers the future, as one flat row of scalars.
#include "multibody_rod.hpp"

#include <algorithm>
#include <cmath>

namespace calot::rod_multibody {

namespace {

constexpr std::size_t memory_values = 8; // for each contact

} // namespace

template<class Rod, class F>
void MultibodyRod::visit_state(Rod& rod, F f) {
    for (auto& v : rod.rest_darboux_)
        f(v);
    for (auto* q : {&rod.base_clamp_, &rod.tip_clamp_})
        f(q->w), f(q->x), f(q->y), f(q->z);
    f(rod.roll_);
}

std::size_t MultibodyRod::state_size() const {
    std::size_t size = 0;
    visit_state(*this, [&](const double&) { ++size; });
    return static_cast<std::size_t>(chain_->coordinates() + chain_->motions()) + size + 1 +
           memory_values * rows_.size();
}

// Ids are 64 bits: two halves, each a whole number that a double holds.
void MultibodyRod::save(std::span<double> state) const {
    chain_->read(state.data());
    auto at = static_cast<std::size_t>(chain_->coordinates());
    std::copy(chain_->motion(), chain_->motion() + chain_->motions(),
              state.begin() + static_cast<std::ptrdiff_t>(at));
    at += static_cast<std::size_t>(chain_->motions());
    visit_state(*this, [&](const double& v) { state[at++] = v; });
    state[at++] = static_cast<double>(memory_count_);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const Memory m = k < memory_count_ ? memory_[k] : Memory{};
        for (const double v : {static_cast<double>(m.id >> 32), static_cast<double>(m.id & 0xffffffffu),
                               m.stick.x, m.stick.y, m.stick.z, m.offset, m.force, m.share})
            state[at++] = v;
    }
}

bool MultibodyRod::load(std::span<const double> state) {
    if (state.size() != state_size()) return false;
    const std::size_t contacts = state.size() - memory_values * rows_.size();
    const auto is_whole = [](double v, double most) { return v >= 0 && v <= most && v == std::floor(v); };
    if (!is_whole(state[contacts - 1], static_cast<double>(rows_.size()))) return false;
    for (std::size_t k = 0; k < memory_values * rows_.size(); k += memory_values)
        if (!is_whole(state[contacts + k], 4294967295.0) || !is_whole(state[contacts + k + 1], 4294967295.0))
            return false;
    auto at = static_cast<std::size_t>(chain_->coordinates());
    chain_->restore(state.data(), state.data() + at);
    at += static_cast<std::size_t>(chain_->motions());
    visit_state(*this, [&](double& v) { v = state[at++]; });
    memory_count_ = static_cast<std::size_t>(state[contacts - 1]);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const double* s = state.data() + contacts + memory_values * k;
        memory_[k] = {(static_cast<std::uint64_t>(s[0]) << 32) | static_cast<std::uint64_t>(s[1]),
                      {s[2], s[3], s[4]},
                      s[5],
                      s[6],
                      s[7]};
    }
    update_joints();
    return true;
}

} // namespace calot::rod_multibody
