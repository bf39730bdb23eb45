#include "simulation/collision.hpp"

#include "geometry/self_contacts.hpp"
#include "simulation/pacer.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numeric>
#include <thread>

namespace calot::simulation {

struct Collision::Impl {
    const geometry::TriangleScene& scene;
    std::vector<double> radius;
    std::vector<double> block; // x, then y, then z
    std::size_t first_segment = 0;
    double reach = 0;
    geometry::ChainContacts finder;
    geometry::SelfContacts self_finder;
    ContactList lists[2];
    std::vector<std::uint32_t> order; // scratch, when more are found than fit
    unsigned current = 0;
    bool is_begun = false;

    // Numbers of queries: the last asked for, the last that a thread has taken on, the last that is done.
    std::atomic<std::uint64_t> asked{0}, claimed{0}, answered{0};
    std::atomic<bool> is_over{false};
    std::thread worker;

    Impl(const geometry::TriangleScene& surfaces, std::span<const double> radii, std::size_t most)
        : scene(surfaces), radius(radii.begin(), radii.end()), block(3 * (radii.size() + 1)),
          finder(radii.size() + 1), self_finder(radii.size() + 1) {
        for (ContactList& list : lists) {
            list.contact.resize(most);
            list.owner.resize(most);
        }
        using geometry::ChainContacts, geometry::SelfContacts;
        order.reserve((radii.size() + 1) * (ChainContacts::most_per_node + ChainContacts::most_per_segment +
                                            2 * SelfContacts::most_per_slot));
    }

    void query() {
        const auto start = std::chrono::steady_clock::now();
        ContactList& list = lists[current];
        const auto chain = geometry::Chain::of_block(block, radius, first_segment);
        const auto found = finder.find(scene, chain, reach);
        const auto self_start = std::chrono::steady_clock::now();
        const auto found_self = self_finder.find(chain, 2 * reach); // both sides move
        const auto self_end = std::chrono::steady_clock::now();

        list.deepest = list.deepest_self = 0;
        for (const geometry::Contact& c : found)
            list.deepest = std::max(list.deepest, -c.gap);
        for (const geometry::SelfContact& c : found_self)
            list.deepest_self = std::max(list.deepest_self, -c.gap);
        const std::size_t all = found.size() + found_self.size();
        list.count = std::min(all, list.contact.size());
        list.left_out = all - list.count;
        order.resize(all); // within its capacity
        std::iota(order.begin(), order.end(), 0u);
        if (list.left_out > 0) {
            // The deepest stay, in their order.
            const auto gap = [&](std::uint32_t i) {
                return i < found.size() ? found[i].gap : found_self[i - found.size()].gap;
            };
            std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
                return gap(a) != gap(b) ? gap(a) < gap(b) : a < b;
            });
            order.resize(list.count);
            std::sort(order.begin(), order.end());
        }
        for (std::size_t i = 0; i < list.count; ++i) {
            if (order[i] < found.size())
                list.owner[i] = write(list.contact[i], found[order[i]], chain);
            else
                list.owner[i] = write(list.contact[i], found_self[order[i] - found.size()], chain);
        }
        const auto seconds = [](auto time) { return std::chrono::duration<double>(time).count(); };
        list.seconds = seconds(std::chrono::steady_clock::now() - start);
        list.self_seconds = seconds(self_end - self_start);
    }

    // What contacts of both kinds share. Organs are static, and the rod knows how it moves itself: where the
    // surface will be is where it is.
    template<class Found>
    static void write_common(calot_contact& out, const Found& c, const geometry::Chain& chain) {
        const geometry::Vec3 axis = (1 - c.t) * chain.node(c.segment) + c.t * chain.node(c.segment + 1);
        out = {};
        out.id = c.id;
        out.segment = c.segment;
        out.t = c.t;
        for (int k = 0; k < 3; ++k) {
            out.axis_point[k] = axis[k];
            out.point[k] = out.free_position[k] = c.point[k];
            out.normal[k] = c.normal[k];
        }
        out.gap = c.gap;
    }

    static ContactOwner write(calot_contact& out, const geometry::Contact& c, const geometry::Chain& chain) {
        write_common(out, c, chain);
        out.friction = c.friction;
        return {c.organ, c.region};
    }

    static ContactOwner write(calot_contact& out, const geometry::SelfContact& c,
                              const geometry::Chain& chain) {
        write_common(out, c, chain);
        out.friction = self_friction;
        out.flags = CALOT_CONTACT_SELF;
        out.other_segment = c.other_segment;
        out.other_t = c.other_t;
        return {ContactOwner::shaft, 0};
    }

    // Whoever claims a query runs it: the worker, or the caller when the worker has not come to it.
    bool claim(std::uint64_t number) {
        std::uint64_t before = number - 1;
        return claimed.compare_exchange_strong(before, number, std::memory_order_acq_rel);
    }

    void work() {
        std::uint64_t seen = 0;
        for (;;) {
            asked.wait(seen, std::memory_order_acquire);
            seen = asked.load(std::memory_order_acquire);
            if (is_over.load(std::memory_order_relaxed)) return;
            if (!claim(seen)) continue;
            query();
            answered.store(seen, std::memory_order_release);
            answered.notify_one();
        }
    }
};

Collision::Collision(const geometry::TriangleScene& scene, std::span<const double> radius,
                     std::size_t most_contacts, bool on_thread)
    : impl_(std::make_unique<Impl>(scene, radius, most_contacts)) {
    if (on_thread) impl_->worker = std::thread([this] { impl_->work(); });
}

Collision::~Collision() {
    if (!impl_->worker.joinable()) return;
    if (impl_->is_begun) finish();
    impl_->is_over.store(true, std::memory_order_relaxed);
    impl_->asked.fetch_add(1, std::memory_order_release);
    impl_->asked.notify_one();
    impl_->worker.join();
}

void Collision::schedule_first() {
    if (impl_->worker.joinable()) simulation::schedule_first(impl_->worker.native_handle());
}

void Collision::begin(std::span<const double> position, double reach, std::size_t first_segment) {
    const std::size_t n = position.size() / 3;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < 3; ++k)
            impl_->block[k * n + i] = position[3 * i + k];
    impl_->first_segment = first_segment;
    impl_->reach = reach;
    impl_->current ^= 1;
    impl_->is_begun = true;
    if (impl_->worker.joinable()) {
        impl_->asked.fetch_add(1, std::memory_order_release);
        impl_->asked.notify_one();
    } else {
        impl_->query();
    }
}

const ContactList& Collision::finish() {
    Impl& c = *impl_;
    if (c.worker.joinable() && c.is_begun) {
        const std::uint64_t wanted = c.asked.load(std::memory_order_relaxed);
        if (c.claim(wanted)) {
            c.query();
        } else {
            for (std::uint64_t done = c.answered.load(std::memory_order_acquire); done != wanted;
                 done = c.answered.load(std::memory_order_acquire))
                c.answered.wait(done, std::memory_order_acquire);
        }
    }
    c.is_begun = false;
    return c.lists[c.current];
}

double Collision::farthest_since(std::span<const double> position) const {
    const std::size_t n = position.size() / 3;
    const double *x = impl_->block.data(), *y = x + n, *z = y + n;
    double most = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const double dx = position[3 * i] - x[i], dy = position[3 * i + 1] - y[i],
                     dz = position[3 * i + 2] - z[i];
        most = std::max(most, dx * dx + dy * dy + dz * dz);
    }
    return std::sqrt(most);
}

} // namespace calot::simulation
