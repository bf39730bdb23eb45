// The immutable state at a tick, and its publication to readers on other threads without locks.
#pragma once

#include <calot/abi/plugin.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace calot::simulation {

/// A short text in place, so that snapshots and commands never allocate. Longer ones are cut at a character.
template<std::size_t N>
class Text {
  public:
    Text() = default;
    Text(std::string_view text) { *this = text; }
    Text& operator=(std::string_view text) {
        size_ = text.size() < N ? text.size() : N;
        while (size_ < text.size() && size_ > 0 && (static_cast<unsigned char>(text[size_]) & 0xc0) == 0x80)
            --size_; // not inside a UTF-8 sequence
        for (std::size_t i = 0; i < size_; ++i)
            bytes_[i] = text[i];
        return *this;
    }
    std::string_view view() const { return {bytes_.data(), size_}; }
    operator std::string_view() const { return view(); }
    bool empty() const { return size_ == 0; }

  private:
    std::array<char, N> bytes_{};
    std::size_t size_ = 0;
};

/// A marker as the procedure set it (calot_marker with its strings and points copied).
struct Marker {
    static constexpr std::size_t most_points = 512;
    Text<64> id;
    std::uint32_t kind = 0; // CALOT_MARKER_...
    bool is_done = false;
    std::array<double, 3> position{}, normal{};
    double radius = 0; // m
    std::array<double, 4> colour{};
    std::vector<double> points; // 3 each, m; capacity reserved at construction

    Marker() { points.reserve(3 * most_points); }
};

struct MarkerSet {
    static constexpr std::size_t most = 32;
    std::uint64_t generation = 0; // grows with every change
    std::size_t count = 0;
    std::array<Marker, most> marker;
    std::span<const Marker> all() const { return {marker.data(), count}; }
};

/// Where the time of the last tick went, s; zero unless Setup::measure.
struct TickCost {
    double rod = 0, constraints = 0, collision = 0, procedure = 0, device = 0, total = 0;
    double self_contact = 0; // of the collision query
};

/// How long and how deep the shaft sank into organs (not into itself): a measure of the simulation's health,
/// not of the operator.
struct Penetration {
    double now = 0;                  // m, the deepest at this tick
    double deepest = 0;              // m, so far
    std::int64_t ticks_over_1mm = 0; // so far
};

struct LateTicks {
    bool is_first = false;     // real-time scheduling was allowed
    std::int64_t late = 0;     // ended more than 1 ms after they were due
    std::int64_t slipped = 0;  // ticks by which simulated time fell behind for good
    std::int64_t worst_us = 0; // microseconds late, at worst
};

/// Everything that renderer, recorder and procedure may see of a tick. SI units, world frame LPS; arrays are
/// interleaved (x y z, x y z, ...), quaternions (w, x, y, z).
struct Snapshot {
    std::int64_t tick = 0; // 1 ms each

    // The shaft, base to tip.
    std::vector<double> position;         // 3N
    std::vector<double> velocity;         // 3N, m/s
    std::vector<double> frame;            // 4(N-1), material to world, +z along the shaft
    std::vector<double> angular_velocity; // 3(N-1), rad/s
    double insertion = 0;                 // m: of the shaft beyond the guide's exit
    double rotation = 0;                  // rad: the base's turn about the guide
    double bending[2] = {};               // rad: the bending section, up (+) and left (+)
    double bending_energy = 0, twist_energy = 0, kinetic_energy = 0; // J

    calot_pose camera{}; // at the tip: +z looks forward, +y up, +x left on the screen
    calot_twist camera_twist{};
    calot_pose retractor{};

    calot_controls controls{};  // latched for the step that led here
    calot_feedback feedback{};  // what the hands feel
    double hose_offset[2] = {}; // m, rad that were re-set without effect

    std::vector<calot_contact_report> contact; // contact_count are valid
    std::size_t contact_count = 0;
    std::size_t contacts_left_out = 0; // found, but beyond Setup::max_contacts: never the deepest
    double tissue_force = 0;           // N: sum of the magnitudes of the forces on organs, mean over the tick
    double self_force = 0;             // N: likewise, of the shaft on itself

    MarkerSet markers;
    Text<64> task;     // id of the task at hand
    Text<256> message; // to the operator; empty when its time is over
    double fade = 0;   // 0 clear .. 1 black
    std::array<double, 3> gravity{0, 9.81, 0};
    bool is_paused = false, is_finished = false;

    Penetration penetration;
    LateTicks late;
    TickCost cost;

    double seconds() const { return static_cast<double>(tick) / 1000; }
    std::span<const calot_contact_report> contacts() const { return {contact.data(), contact_count}; }
};

/// A fixed ring of snapshots: one writer, any number of readers, no locks, no allocation. A reader pins the
/// newest; the writer never touches a pinned slot or the newest. While readers pin all others the writer
/// publishes nothing (begin() is null).
class SnapshotRing {
  public:
    static constexpr std::size_t slots = 8;

    /// Pins a snapshot while it lives. Cheap to move; not to be kept for longer than a frame takes.
    class View {
      public:
        View() = default;
        View(View&& other) noexcept : slot_(std::exchange(other.slot_, nullptr)) {}
        View& operator=(View&& other) noexcept {
            std::swap(slot_, other.slot_);
            return *this;
        }
        ~View() {
            if (slot_) slot_->pins.fetch_sub(1);
        }
        explicit operator bool() const { return slot_ != nullptr; }
        const Snapshot& operator*() const { return slot_->snapshot; }
        const Snapshot* operator->() const { return &slot_->snapshot; }

      private:
        friend class SnapshotRing;
        struct Slot {
            Snapshot snapshot;
            std::atomic<int> pins{0};
        };
        explicit View(Slot* slot) : slot_(slot) {}
        Slot* slot_ = nullptr;
    };

    SnapshotRing(std::size_t nodes, std::size_t most_contacts);

    /// The newest snapshot. Wait-free unless the writer laps the reader in between. Any thread.
    View latest() const;

    /// The writer's: a slot to fill, or null when readers pin every other one; then what it published.
    Snapshot* begin();
    void publish();

  private:
    mutable std::array<View::Slot, slots> slot_;
    std::atomic<std::size_t> latest_{0};
    std::size_t writing_ = slots;
};

} // namespace calot::simulation
