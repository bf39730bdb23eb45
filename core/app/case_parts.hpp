#pragma once

#include "app/case_process.hpp"
#include "cases/journal.hpp"
#include "cases/metrics.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"
#include "simulation/simulation.hpp"
#include "simulation/world.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace calot::app {

/// What a case is made of: plugins, world, and the header that names them. Outlives the simulation.
class CaseParts {
  public:
    /// Throws host::UserError and host::PluginError. A replay takes everything from its header.
    CaseParts(const CaseOptions& options, const cases::Journal* replay);

    simulation::Setup setup(const CaseOptions& options, simulation::ControlSource* controls);
    std::vector<cases::MetricDefinition> metrics() const;

    host::Services services;
    host::Plugins plugins;
    host::Instance procedure, rod, device;
    std::string title; ///< of the procedure
    std::shared_ptr<const simulation::World> world;
    std::vector<simulation::InstrumentDatasheet> instruments; ///< by channel; an empty id: none
    cases::CaseHeader header;

  private:
    void choose(const CaseOptions& options, bool is_replay);
    void read_instruments(const CaseOptions& options);
    void describe(const CaseOptions& options, const cases::Journal* replay);
};

} // namespace calot::app
