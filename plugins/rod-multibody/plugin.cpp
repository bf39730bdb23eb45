// The model as a plugin.
#include "multibody_rod.hpp"

namespace calot::rod_multibody {

namespace {

constexpr Parameter parameter_table[] = {
    {"substeps", "Implicit substeps of a step; 0: of 1 ms when free, of 0.2 ms in contact", "", 0, 100, 0,
     true},
    {"recovery-speed", "Fastest speed at which overlap is taken back", "m/s", 0.001, 2.0, 0.2, false},
};

} // namespace

class MultibodyRodPlugin final : public ModelledRod<MultibodyRod> {
  public:
    std::span<const Parameter> parameters() const override { return parameter_table; }
};

} // namespace calot::rod_multibody

CALOT_PLUGIN(calot::export_rod<calot::rod_multibody::MultibodyRodPlugin>("org.calot.rod-multibody",
                                                                         "Chain of rigid bodies (Simbody)",
                                                                         "0.1.0"))
