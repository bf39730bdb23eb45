#include "simulation/collision.hpp"

#include "simulation/pacer.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

namespace calot::simulation {

namespace {

// How far ahead contacts are known. 1 mm is 3 ticks at the fastest insertion of 0.3 m/s, and in the
// oesophagus, which is hardly wider than the shaft, a quarter of the cost of 3 mm. A bent tip that snaps
// through a narrow place goes at 1 to 2 m/s: then it pays to look farther.
constexpr double margin = 0.001, far_margin = 0.004; // m
constexpr double fast = 0.4;                         // m/s

} // namespace

struct Collision::Impl {
    const geometry::TriangleScene& scene;
    std::vector<double> radius;
    std::vector<double> block; // x, then y, then z
    std::size_t first_segment = 0;
    double reach = margin;
    geometry::ChainContacts finder;
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
          finder(radii.size() + 1) {
        for (ContactList& list : lists) {
            list.contact.resize(most);
            list.owner.resize(most);
        }
        order.reserve(radii.size() * 16);
    }

    void query() {
        const auto start = std::chrono::steady_clock::now();
        ContactList& list = lists[current];
        const auto chain = geometry::Chain::of_block(block, radius, first_segment);
        const auto found = finder.find(scene, chain, reach);
        list.is_cut = found.size() > list.contact.size();
        list.count = std::min(found.size(), list.contact.size());
        list.deepest = 0;
        order.clear();
        for (std::size_t i = 0; i < found.size() && i < order.capacity(); ++i) {
            order.push_back(static_cast<std::uint32_t>(i));
            list.deepest = std::max(list.deepest, -found[i].gap);
        }
        if (list.is_cut) {
            // The deepest stay, in their order along the shaft.
            std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
                return found[a].gap != found[b].gap ? found[a].gap < found[b].gap : a < b;
            });
            order.resize(list.count);
            std::sort(order.begin(), order.end());
        }
        for (std::size_t i = 0; i < list.count; ++i) {
            const geometry::Contact& c = found[order[i]];
            const geometry::Vec3 a = chain.node(c.segment), b = chain.node(c.segment + 1);
            const geometry::Vec3 axis = (1 - c.t) * a + c.t * b;
            calot_contact& out = list.contact[i];
            out = {};
            out.id = c.id;
            out.segment = c.segment;
            out.t = c.t;
            for (int k = 0; k < 3; ++k) {
                out.axis_point[k] = axis[k];
                out.point[k] = out.free_position[k] = c.point[k]; // organs are static
                out.normal[k] = c.normal[k];
            }
            out.gap = c.gap;
            out.friction = c.friction;
            list.owner[i] = {c.organ, c.region};
        }
        list.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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

void Collision::begin(std::span<const double> position, std::span<const double> velocity,
                      std::size_t first_segment) {
    const std::size_t n = position.size() / 3;
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < 3; ++k)
            impl_->block[k * n + i] = position[3 * i + k];
    impl_->first_segment = first_segment;
    double fastest2 = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const double* v = &velocity[3 * i];
        fastest2 = std::max(fastest2, v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    }
    impl_->reach = fastest2 > fast * fast ? far_margin : margin;
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

} // namespace calot::simulation
