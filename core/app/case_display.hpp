#pragma once

#include "simulation/simulation.hpp"
#include "simulation/world.hpp"

#include <memory>
#include <string>

namespace calot::app {

/// What shows a running case. show() takes as long as a picture stands, and passes on what the user asks for.
class CaseDisplay {
  public:
    virtual ~CaseDisplay() = default;
    virtual void show() = 0;
};

/// The window with both views. Throws host::UserError without a display.
std::unique_ptr<CaseDisplay> make_window(simulation::Simulation& simulation, const simulation::World& world,
                                         const std::string& title);

/// A line on standard error that tells how far it is, where that is a terminal; otherwise a line each 10 s.
std::unique_ptr<CaseDisplay> make_progress_line(simulation::Simulation& simulation);

/// SIGTERM: the case is to end in order.
struct StopSignal {
    static void install();
    static bool is_set();
};

} // namespace calot::app
