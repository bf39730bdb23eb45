// What the simulation is given of plugins.
#pragma once

#include <calot/abi/common.h>

#include <string>

namespace calot::simulation {

/// An instance after create and init: {instance.id(), instance.abi()} of a host::Instance. The simulation
/// configures, activates and deactivates it, and never destroys it; it must outlive the simulation.
struct Plugin {
    std::string id; // reverse DNS
    calot_instance* instance = nullptr;

    explicit operator bool() const { return instance != nullptr; }
};

} // namespace calot::simulation
