#include "simulation/tick_contacts.hpp"

#include <algorithm>

namespace calot::simulation {

TickContacts::TickContacts(std::size_t most) : contact_(most), owner_(most), impulse_(3 * most) {}

void TickContacts::begin_tick() {
    count_ = left_out_ = parts_ = 0;
    deepest_ = seconds_ = self_seconds_ = 0;
}

void TickContacts::add(const ContactList& list, std::span<const double> impulse) {
    deepest_ = std::max(deepest_, list.deepest);
    seconds_ += list.seconds, self_seconds_ += list.self_seconds;
    left_out_ += list.left_out;
    const std::size_t known = parts_++ == 0 ? 0 : count_;
    for (std::size_t i = 0; i < list.count; ++i) {
        const auto end = contact_.begin() + static_cast<std::ptrdiff_t>(known);
        const auto same = std::find_if(contact_.begin(), end, [&](const calot_contact& c) {
            return c.id == list.contact[i].id && c.flags == list.contact[i].flags;
        });
        std::size_t at = static_cast<std::size_t>(same - contact_.begin());
        if (same == end) {
            if (count_ == contact_.size()) {
                ++left_out_;
                continue;
            }
            at = count_++;
            std::fill_n(&impulse_[3 * at], 3, 0.0);
        }
        contact_[at] = list.contact[i];
        owner_[at] = list.owner[i];
        for (std::size_t k = 0; k < 3; ++k)
            impulse_[3 * at + k] += impulse[3 * i + k];
    }
}

void TickContacts::write(double tick_seconds, std::span<calot_contact_report> to) const {
    for (std::size_t i = 0; i < std::min(count_, to.size()); ++i) {
        const calot_contact& c = contact_[i];
        calot_contact_report& r = to[i];
        r = {};
        r.id = c.id;
        r.organ = owner_[i].organ;
        r.region = owner_[i].region;
        r.segment = c.segment;
        std::copy_n(c.point, 3, r.point);
        std::copy_n(c.normal, 3, r.normal);
        for (std::size_t k = 0; k < 3; ++k)
            r.force[k] = -impulse_[3 * i + k] / tick_seconds;
        r.gap = c.gap;
    }
}

} // namespace calot::simulation
