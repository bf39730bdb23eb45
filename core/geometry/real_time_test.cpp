// What real-time code relies on: no allocation in the queries, and the same bits on however many threads.
#include "geometry/chain_contacts.hpp"
#include "geometry/self_contacts.hpp"
#include "geometry/test_shapes.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>
#include <numbers>
#include <thread>

namespace {

std::atomic<std::size_t> allocations{0};

} // namespace

// Not inlined: seeing both sides, the compiler takes free() for a mistake.
#define CALOT_COUNTED __attribute__((noinline))
CALOT_COUNTED void* operator new(std::size_t size) {
    ++allocations;
    if (void* memory = std::malloc(size)) return memory;
    throw std::bad_alloc();
}
CALOT_COUNTED void* operator new(std::size_t size, std::align_val_t alignment) {
    ++allocations;
    const std::size_t a = static_cast<std::size_t>(alignment);
    if (void* memory = std::aligned_alloc(a, (size + a - 1) / a * a)) return memory;
    throw std::bad_alloc();
}
CALOT_COUNTED void operator delete(void* memory) noexcept {
    std::free(memory);
}
CALOT_COUNTED void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}
CALOT_COUNTED void operator delete(void* memory, std::align_val_t) noexcept {
    std::free(memory);
}
CALOT_COUNTED void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
    std::free(memory);
}

namespace {

using namespace calot::geometry;
using namespace calot::geometry::test;

constexpr double radius = 6.3e-3, margin = 2e-3;

// A chain coiled on the inside of a tube, in `block`, moved a little with each tick.
void place(std::vector<double>& block, int tick) {
    const std::size_t n = block.size() / 3;
    for (std::size_t i = 0; i < n; ++i) {
        const double angle = 0.45 * static_cast<double>(i) + 0.002 * tick, r = 0.0238 + 1e-6 * tick;
        block[i] = r * std::cos(angle);
        block[n + i] = r * std::sin(angle);
        block[2 * n + i] = 0.03 + 2 * radius * angle / (2 * std::numbers::pi) + 2e-4 * tick;
    }
}

TEST(RealTime, queries_do_not_allocate) {
    const Shape shape = tube_wall(0.03, 0.034, 0.3, 60, 80);
    TriangleScene scene = shape.scene();
    std::vector<double> block(300);
    const std::vector<double> radii(99, radius);
    ChainContacts query(100);
    SelfContacts self(100);
    std::size_t contacts = 0, self_contacts = 0;
    const std::size_t before = allocations;
    for (int tick = 0; tick < 300; ++tick) {
        place(block, tick);
        contacts += query.find(scene, Chain::of_block(block, radii), margin).size();
        self_contacts += self.find(Chain::of_block(block, radii), margin).size();
        (void)organ_containing(scene, {block[0], block[100], block[200]});
        (void)nearest_point(scene, {block[0], block[100], block[200]}, 1.0);
        if (tick >= 200) {
            ASSERT_TRUE(scene.move_vertices(shape.vertices));
        }
    }
    EXPECT_EQ(allocations - before, 0u);
    EXPECT_GT(contacts, 10000u);
    EXPECT_GT(self_contacts, 10000u);
}

TEST(RealTime, several_threads_on_one_scene_find_the_same_bits) {
    const TriangleScene scene = tube_wall(0.03, 0.034, 0.3, 60, 80).scene();
    const auto run = [&](std::vector<Contact>& found) {
        std::vector<double> block(300);
        const std::vector<double> radii(99, radius);
        ChainContacts query(100);
        for (int tick = 0; tick < 200; ++tick) {
            place(block, tick);
            const auto contacts = query.find(scene, Chain::of_block(block, radii), margin);
            found.insert(found.end(), contacts.begin(), contacts.end());
        }
    };
    std::vector<Contact> found[4];
    run(found[0]);
    std::vector<std::thread> threads;
    for (int i = 1; i < 4; ++i)
        threads.emplace_back(run, std::ref(found[i]));
    for (std::thread& thread : threads)
        thread.join();
    ASSERT_GT(found[0].size(), 10000u);
    for (int i = 1; i < 4; ++i) {
        ASSERT_EQ(found[i].size(), found[0].size());
        for (std::size_t c = 0; c < found[0].size(); ++c) {
            const Contact &a = found[i][c], &b = found[0][c];
            ASSERT_TRUE(a.id == b.id && a.triangle == b.triangle && a.segment == b.segment && a.t == b.t &&
                        a.point == b.point && a.normal == b.normal && a.gap == b.gap)
                << "thread " << i << ", contact " << c;
        }
    }
}

} // namespace
