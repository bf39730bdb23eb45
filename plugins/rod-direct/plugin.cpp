// The model as a plugin.
#include "direct_rod.hpp"

namespace calot::rod_direct {

namespace {

constexpr Parameter parameter_table[] = {
    {"recovery-speed", "Fastest speed at which overlap is taken back", "m/s", 0.001, 2.0,
     DirectRod::default_parameters[0], false},
};

} // namespace

class DirectRodPlugin final : public CostedRod<DirectRod> {
  public:
    std::span<const Parameter> parameters() const override { return parameter_table; }
};

} // namespace calot::rod_direct

CALOT_PLUGIN(calot::export_rod<calot::rod_direct::DirectRodPlugin>("org.calot.rod-direct",
                                                                   "Direct implicit rod", "0.1.0"))
