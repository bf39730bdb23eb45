// What steers the future, as one flat row of scalars.
#include "cosserat_rod.hpp"

#include <cmath>

namespace calot::rod_cosserat {

namespace {

constexpr std::size_t node_values = 13, segment_values = 8, contact_values = 5, single_values = 14;
constexpr double two_32 = 4294967296.0;

} // namespace

std::size_t CosseratRod::state_size() const {
    const auto n = static_cast<std::size_t>(n_);
    return single_values + node_values * n + segment_values * (n - 1) + contact_values * rows_.size();
}

// One list for both directions: `f` sees every scalar in the order of the state.
template<class Rod, class F>
void CosseratRod::visit_state(Rod& rod, F f) {
    for (auto* a : {&rod.x_, &rod.y_, &rod.z_, &rod.vx_, &rod.vy_, &rod.vz_, &rod.out_vx_, &rod.out_vy_,
                    &rod.out_vz_, &rod.last_u1_, &rod.last_u2_, &rod.rate1_, &rod.rate2_, &rod.qw_, &rod.qx_,
                    &rod.qy_, &rod.qz_, &rod.spin_, &rod.rest_darboux_})
        for (auto& v : *a)
            f(v);
    for (auto* q : {&rod.base_clamp_, &rod.tip_clamp_})
        f(q->w), f(q->x), f(q->y), f(q->z);
    f(rod.advance_), f(rod.roll_), f(rod.half_kick_), f(rod.tension_stiffness_), f(rod.last_substep_);
}

void CosseratRod::save(std::span<double> state) const {
    std::size_t at = 0;
    visit_state(*this, [&](const double& v) { state[at++] = v; });
    state[at++] = static_cast<double>(memory_count_);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const ContactMemory m = k < memory_count_ ? memory_[k] : ContactMemory{};
        const double high = static_cast<double>(m.id >> 32), low = static_cast<double>(m.id & 0xffffffffu);
        for (double v : {high, low, m.stick.x, m.stick.y, m.stick.z})
            state[at++] = v;
    }
}

bool CosseratRod::load(std::span<const double> state) {
    if (state.size() != state_size()) return false;
    for (double v : state)
        if (!(std::fabs(v) < 1e300)) return false;
    const std::size_t contacts = state.size() - contact_values * rows_.size();
    const double count = state[contacts - 1];
    if (!(count >= 0.0 && count <= static_cast<double>(rows_.size())) || count != std::floor(count))
        return false;
    for (std::size_t k = 0; k < rows_.size(); ++k)
        for (std::size_t i : {std::size_t{0}, std::size_t{1}}) {
            const double half = state[contacts + contact_values * k + i];
            if (!(half >= 0.0 && half < two_32) || half != std::floor(half)) return false;
        }
    std::size_t at = 0;
    visit_state(*this, [&](double& v) { v = state[at++]; });
    memory_count_ = static_cast<std::size_t>(count);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const double* s = state.data() + contacts + contact_values * k;
        const auto id = (static_cast<std::uint64_t>(s[0]) << 32) | static_cast<std::uint64_t>(s[1]);
        memory_[k] = {id, {s[2], s[3], s[4]}};
    }
    update_joints();
    directions();
    return true;
}

} // namespace calot::rod_cosserat
