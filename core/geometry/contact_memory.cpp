#include "geometry/contact_memory.hpp"

#include <cstring>
#include <type_traits>

namespace calot::geometry {
namespace {

struct Header {
    std::uint64_t magic, slots, mark, next;
};
constexpr std::uint64_t magic = 0x31304d4354434c43ull; // "CLCTCM01"

static_assert(std::is_trivially_copyable_v<RememberedContact> && sizeof(RememberedContact) == 64);

} // namespace

void ContactMemory::match(std::size_t slot, std::size_t with, double radius) {
    while (true) {
        RememberedContact* to = nullptr;
        RememberedContact* from = nullptr;
        double nearest = same_move * radius * same_move * radius;
        for (RememberedContact& now : now_[slot])
            for (RememberedContact& then : before_[with]) {
                if (now.id != 0 || then.id == 0 || now.organ != then.organ) continue;
                if (dot(now.normal, then.normal) <= same_cosine) continue;
                const double distance2 = norm2(now.point - then.point);
                if (distance2 < nearest) {
                    nearest = distance2;
                    to = &now;
                    from = &then;
                }
            }
        if (to == nullptr) return;
        to->id = from->id;
        from->id = 0; // handed on once
    }
}

void ContactMemory::reset() {
    for (Slot& slot : before_)
        slot.size = 0;
    next_ = 1;
}

std::size_t ContactMemory::state_size() const {
    return sizeof(Header) +
           before_.size() * (sizeof(std::uint64_t) + most_per_slot * sizeof(RememberedContact));
}

void ContactMemory::save(std::span<std::byte> state) const {
    if (state.size() < state_size()) return;
    std::byte* at = state.data();
    const auto put = [&](const auto& value) {
        std::memcpy(at, &value, sizeof value);
        at += sizeof value;
    };
    put(Header{magic, before_.size(), mark_, next_});
    for (const Slot& slot : before_) {
        put(static_cast<std::uint64_t>(slot.size));
        for (std::size_t i = 0; i < most_per_slot; ++i)
            put(i < slot.size ? slot.items[i] : RememberedContact{});
    }
}

bool ContactMemory::load(std::span<const std::byte> state) {
    if (state.size() != state_size()) return false;
    const std::byte* at = state.data();
    const auto take = [&](auto& value) {
        std::memcpy(&value, at, sizeof value);
        at += sizeof value;
    };
    Header header;
    take(header);
    if (header.magic != magic || header.slots != before_.size() || header.mark != mark_ || header.next == 0)
        return false;
    std::vector<Slot> loaded(before_.size());
    for (Slot& slot : loaded) {
        std::uint64_t size;
        take(size);
        if (size > most_per_slot) return false;
        slot.size = size;
        for (RememberedContact& contact : slot.items)
            take(contact);
        for (const RememberedContact& contact : slot)
            if ((contact.id & ~mark_) == 0 || (contact.id & ~mark_) >= header.next ||
                !is_finite(contact.point) || !is_finite(contact.normal))
                return false;
    }
    before_ = std::move(loaded);
    next_ = header.next;
    return true;
}

} // namespace calot::geometry
