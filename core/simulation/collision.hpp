// Contacts of the shaft, found beside the next step on a thread of their own, or in turn on the caller's: the
// same data either way.
#pragma once

#include "geometry/chain_contacts.hpp"
#include "geometry/triangle_scene.hpp"

#include <calot/abi/contact.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace calot::simulation {

/// What a query found, as the rod takes it, and whose surface each contact is on.
struct ContactList {
    struct Owner {
        std::uint32_t organ, region;
    };
    std::vector<calot_contact> contact; // capacity; `count` are valid
    std::vector<Owner> owner;
    std::size_t count = 0;
    double deepest = 0;  // m, of penetration
    bool is_cut = false; // more were found than fit; the deepest were kept
    double seconds = 0;  // that the query took
    std::span<const calot_contact> all() const { return {contact.data(), count}; }
};

class Collision {
  public:
    /// `radius` N-1, m. With `on_thread` queries run on a worker.
    Collision(const geometry::TriangleScene& scene, std::span<const double> radius, std::size_t most_contacts,
              bool on_thread);
    ~Collision();

    /// Asks for real-time scheduling of the worker, if there is one.
    void schedule_first();

    /// Begins the query of these nodes (3N interleaved, m and m/s; copied). `first_segment`: those before it
    /// lie in the guide. After the result of the one before was fetched with finish().
    void begin(std::span<const double> position, std::span<const double> velocity, std::size_t first_segment);
    /// Waits for it. Valid until the begin() after the next.
    const ContactList& finish();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace calot::simulation
