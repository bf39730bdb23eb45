#include "simulation/endoscope_wires.hpp"

#include <algorithm>

namespace calot::simulation {

namespace {

double beyond(double value, double slack) {
    return value - std::clamp(value, -0.5 * slack, 0.5 * slack);
}

} // namespace

void WirePair::step(double command, double angle, double section_stiffness, double rate, double dt) {
    const double stretched = f_.stiffness * beyond(command - angle, f_.slack);
    pull_ = std::clamp(stretched, -f_.pull_limit, f_.pull_limit);
    // Play: the section's moment moves only when the wire's differs from it by more than the friction.
    const double asked = std::clamp(moment_, stretched - f_.friction, stretched + f_.friction);
    // With d(asked)/dt = -stiffness d(angle)/dt the pair's eigenvalue is (1 + stiffness/section) / time;
    // while the wires are slack it is 1 / time.
    const double loop = stretched != 0 ? 1 + f_.stiffness / section_stiffness : 1;
    const double share = rate * dt / loop;
    moment_ += std::min(share, 1.0) * (asked - moment_);
    const double most = f_.pull_limit - f_.friction;
    moment_ = std::clamp(moment_, -most, most);
}

void WirePair::balance(double command, double section_stiffness) {
    const double k = f_.stiffness * section_stiffness / (f_.stiffness + section_stiffness);
    const double most = f_.pull_limit - f_.friction;
    pull_ = moment_ = std::clamp(k * beyond(command, f_.slack), -most, most);
}

} // namespace calot::simulation
