// The model as a plugin.
#include "cosserat_rod.hpp"

namespace calot::rod_cosserat {

namespace {

constexpr Parameter parameter_table[] = {
    {"iterations", "Rounds of lengths and contacts in a substep", "", 1, 50,
     CosseratRod::default_parameters[0], true},
    {"recovery-speed", "Fastest speed at which overlap is taken back", "m/s", 0.001, 2.0,
     CosseratRod::default_parameters[1], false},
};

} // namespace

class CosseratRodPlugin final : public CostedRod<CosseratRod> {
  public:
    std::span<const Parameter> parameters() const override { return parameter_table; }
};

} // namespace calot::rod_cosserat

CALOT_PLUGIN(calot::export_rod<calot::rod_cosserat::CosseratRodPlugin>("org.calot.rod-cosserat",
                                                                       "Cosserat rod (CoRdE, inextensible)",
                                                                       "0.1.0"))
