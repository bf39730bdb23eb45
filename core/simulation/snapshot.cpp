#include "simulation/snapshot.hpp"

namespace calot::simulation {

SnapshotRing::SnapshotRing(std::size_t nodes, std::size_t most_contacts) {
    for (auto& slot : slot_) {
        Snapshot& s = slot.snapshot;
        s.position.resize(3 * nodes);
        s.velocity.resize(3 * nodes);
        s.frame.resize(4 * (nodes - 1));
        s.angular_velocity.resize(3 * (nodes - 1));
        s.contact.resize(most_contacts);
    }
}

SnapshotRing::View SnapshotRing::latest() const {
    for (;;) {
        const std::size_t at = latest_.load();
        slot_[at].pins.fetch_add(1);
        // Either this sees that the slot is no longer the newest, or the writer sees the pin: both are
        // sequentially consistent, and each side writes before it reads.
        if (latest_.load() == at) return View(&slot_[at]);
        slot_[at].pins.fetch_sub(1);
    }
}

Snapshot* SnapshotRing::begin() {
    const std::size_t newest = latest_.load();
    for (std::size_t i = 1; i < slots; ++i) {
        const std::size_t at = (newest + i) % slots;
        if (slot_[at].pins.load() == 0) {
            writing_ = at;
            return &slot_[at].snapshot;
        }
    }
    writing_ = slots;
    return nullptr;
}

void SnapshotRing::publish() {
    if (writing_ == slots) return;
    latest_.store(writing_);
    writing_ = slots;
}

} // namespace calot::simulation
