// What the contacts of one tick came to, over the parts that the rod took it in.
#pragma once

#include "simulation/collision.hpp"

#include <calot/abi/procedure.h>

#include <cstddef>
#include <span>
#include <vector>

namespace calot::simulation {

class TickContacts {
  public:
    /// Room for `most` contacts. Nothing below allocates.
    explicit TickContacts(std::size_t most);

    void begin_tick();
    /// The contacts of a part and the impulses on the rod, N s, that they came to; 3 for each. A contact of
    /// an earlier part with the same id goes on: its impulses add up, its geometry is the later one.
    void add(const ContactList& list, std::span<const double> impulse);

    /// Forces are means over a tick of `tick_seconds`, on the organ.
    void write(double tick_seconds, std::span<calot_contact_report> to) const;

    std::size_t count() const { return count_; }
    std::size_t left_out() const { return left_out_; }
    double deepest() const { return deepest_; }           ///< m, of penetration into organs
    double seconds() const { return seconds_; }           ///< that the queries took
    double self_seconds() const { return self_seconds_; } ///< of that, for contacts with itself

  private:
    std::vector<calot_contact> contact_;
    std::vector<ContactOwner> owner_;
    std::vector<double> impulse_; // 3 for each
    std::size_t count_ = 0, left_out_ = 0, parts_ = 0;
    double deepest_ = 0, seconds_ = 0, self_seconds_ = 0;
};

} // namespace calot::simulation
