// The contacts of the tick before: gives contacts identities that last, and is all of a query's state.
#pragma once

#include "geometry/vec3.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace calot::geometry {

// A list of at most N, in place.
template<class T, std::size_t N>
struct Few {
    std::array<T, N> items;
    std::size_t size = 0;

    void push(const T& item) { items[size++] = item; }
    void erase(std::size_t i) {
        for (; i + 1 < size; ++i)
            items[i] = items[i + 1];
        --size;
    }
    T* begin() { return items.data(); }
    T* end() { return items.data() + size; }
    const T* begin() const { return items.data(); }
    const T* end() const { return items.data() + size; }
};

// What is remembered of one contact.
struct RememberedContact {
    std::uint64_t id;
    Vec3 point, normal;
    std::uint32_t organ;
    std::uint32_t unused; // no padding: saved as bytes
};

class ContactMemory {
  public:
    static constexpr std::size_t most_per_slot = 6;
    // From tick to tick a contact keeps its identity if its direction turns less than 60 degrees...
    static constexpr double same_cosine = 0.5;
    // ...and its point moves less than this many radii.
    static constexpr double same_move = 0.5;

    using Slot = Few<RememberedContact, most_per_slot>;

    // Slots run along the chain: 2 i for node i, 2 i + 1 for segment i. Identities have the bits of `mark`
    // set.
    ContactMemory(std::size_t slots, std::uint64_t mark) : before_(slots), now_(slots), mark_(mark) {}

    const Slot& before(std::size_t slot) const { return before_[slot]; }

    // One tick: start, add each contact in the order of slots, identify (which gives the identities in the
    // order of adding), finish. `radius(slot)` is the chain's there.
    void start() {
        for (Slot& slot : now_)
            slot.size = 0;
    }
    void add(std::size_t slot, Vec3 point, Vec3 normal, std::uint32_t organ) {
        now_[slot].push({0, point, normal, organ, 0});
    }
    template<class Radius, class Take>
    void identify(std::size_t first, std::size_t last, Radius&& radius, Take&& take);
    void finish() { before_.swap(now_); }

    void reset();
    std::size_t state_size() const;
    void save(std::span<std::byte> state) const;
    // Refuses, and changes nothing, unless the bytes can be what save() wrote for as many slots.
    bool load(std::span<const std::byte> state);

  private:
    void match(std::size_t slot, std::size_t with, double radius);

    std::vector<Slot> before_, now_;
    std::uint64_t mark_, next_ = 1;
};

// Hands the identities of the tick before on: first within each slot, then to neighbours along the chain,
// since a rim stays where it is while the shaft slides past; the nearest pairs first. What is left is new.
template<class Radius, class Take>
void ContactMemory::identify(std::size_t first, std::size_t last, Radius&& radius, Take&& take) {
    for (std::size_t slot = first; slot < last; ++slot)
        if (now_[slot].size > 0) match(slot, slot, radius(slot));
    for (std::size_t slot = first; slot < last; ++slot) {
        bool any_new = false;
        for (const RememberedContact& contact : now_[slot])
            any_new |= contact.id == 0;
        for (std::size_t step = 1; step <= 2 && any_new; ++step) {
            if (slot >= step) match(slot, slot - step, radius(slot));
            if (slot + step < before_.size()) match(slot, slot + step, radius(slot));
        }
    }
    for (std::size_t slot = first; slot < last; ++slot)
        for (RememberedContact& contact : now_[slot]) {
            if (contact.id == 0) contact.id = next_++ | mark_;
            take(contact.id);
        }
}

} // namespace calot::geometry
