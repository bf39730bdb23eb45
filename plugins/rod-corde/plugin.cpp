// The model as a plugin.
#include "corde_rod.hpp"

namespace calot::rod_corde {

namespace {

constexpr Parameter parameter_table[] = {
    {"stretch-modulus", "Stretching modulus E_s; 0: the highest that is stable", "Pa", 0, 1e12, 0, false},
    {"parallel-penalty", "Stiffness that ties frames to edges; 0: the highest that is stable", "N", 0, 1e9, 0,
     false},
    {"internal-friction", "Damping time of stretch and of the parallel constraint", "s", 0, 1e-2, 2e-5,
     false},
    {"recovery-speed", "Fastest speed at which overlap is taken back", "m/s", 0.001, 2.0, 0.2, false},
};

} // namespace

class CordeRodPlugin final : public ModelledRod<CordeRod> {
  public:
    std::span<const Parameter> parameters() const override { return parameter_table; }
};

} // namespace calot::rod_corde

CALOT_PLUGIN(calot::export_rod<calot::rod_corde::CordeRodPlugin>("org.calot.rod-corde",
                                                                 "Cosserat rod (CoRdE, stretchable)",
                                                                 "0.1.0"))
