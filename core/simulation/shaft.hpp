// The endoscope's shaft in its organs: a rod plugin, its contacts one tick behind or, where it is fast, found
// anew within the tick, the virtual coupling at its base.
#pragma once

#include "simulation/collision.hpp"
#include "simulation/digest.hpp"
#include "simulation/endoscope.hpp"
#include "simulation/plugin.hpp"
#include "simulation/snapshot.hpp"
#include "simulation/tick_contacts.hpp"
#include "simulation/world.hpp"

#include <calot/abi/plugin.h>

#include <array>
#include <cstdint>
#include <vector>

namespace calot::simulation {

/// Spring and damper between the operator's hand and the shaft's base, for each of its axes.
struct CouplingGains {
    std::array<double, 2> stiffness; // N/m, N m/rad
    std::array<double, 2> damping;   // N s/m, N m s/rad
    std::array<double, 2> limit;     // N, N m
};

class Shaft {
  public:
    struct Start {
        std::string path;
        double insertion = 0, rotation = 0;
        std::array<double, 2> wheels{};
        std::vector<InstrumentDatasheet> instruments; // by channel, up to the tip; an empty id: none
    };

    /// Configures and activates the rod along the path, and lets it settle, wheels held. `plugin` and `world`
    /// must outlive it. Throws host::PluginError, host::UserError.
    Shaft(const Plugin& plugin, const World& world, std::uint32_t nodes, std::uint32_t most_contacts,
          bool threaded, bool measure, std::uint64_t seed, const Start& start, const CouplingGains& gains);
    ~Shaft();

    /// One tick: steers, steps the rod with the contacts found on the state before the last, begins the query
    /// on the present one. Contacts hold as long as no node has gone farther than a millimetre since they
    /// were found: a rod that can end a step early takes a tick in which one would in parts, contacts found
    /// anew for each. `hand`: m and rad of the hand since the start, at the step's end. Writes the shaft, its
    /// contacts and the felt forces into `snapshot`, whose gravity it reads.
    void step(std::int64_t tick, const std::array<double, 2>& hand, const double wheel[2],
              const std::uint32_t brake[2], Snapshot& snapshot);

    /// What lies in a working channel from now on; the rod knows within 50 ms. Real-time.
    void set_channel(std::size_t channel, const ChannelContent& content) {
        endoscope_.set_channel(channel, content);
    }

    /// How far the hand has slid over the shaft since the last call, because the coupling was at its limit.
    std::array<double, 2> take_slip();

    /// Asks for real-time scheduling of what runs beside the steps.
    void schedule_first() { collision_.schedule_first(); }

    /// The present state into a snapshot, without a step.
    void show(Snapshot& snapshot) const;
    const Endoscope& endoscope() const { return endoscope_; }
    /// Bits of the shaft, for digests.
    std::uint64_t contact_hash() const { return contact_hash_.value(); }

  private:
    void configure(const Start& start, std::uint64_t seed, std::uint32_t most_contacts);
    void advance(std::int64_t tick, const std::array<double, 2>& target,
                 const std::array<double, 3>& gravity);
    /// Hands the rod a part of a tick; s that it took. `left`: of the tick.
    double step_rod(std::int64_t tick, const std::array<double, 2>& target,
                    const std::array<double, 3>& gravity, const ContactList& contacts, double left,
                    double farthest);
    void look_up();
    double reach() const;
    void report(Snapshot& snapshot) const;
    std::size_t first_segment() const;

    const Plugin& plugin_;
    const calot_rod& rod_;
    const World& world_;
    Endoscope endoscope_;
    CouplingGains gains_;
    calot_guide guide_{};
    Collision collision_;
    const calot_cost* cost_ = nullptr;

    std::vector<double> position_, velocity_, frame_, angular_velocity_, impulse_;
    calot_rod_output out_{};
    TickContacts contacts_;     // of the last tick
    bool ends_early_ = false;   // whether the rod can
    double coupling_force_ = 0; // N, N m, means over the tick
    double coupling_torque_ = 0;
    std::array<double, 2> origin_{}; // m, rad of the base at the start: insertion, roll since configure
    std::array<double, 2> target_{}; // of the coupling, at the step's begin
    std::array<double, 2> slip_{};
    double start_rotation_ = 0;
    double rod_seconds_ = 0, constraint_seconds_ = 0;
    Hash contact_hash_;
};

} // namespace calot::simulation
