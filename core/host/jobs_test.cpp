#include "host/blame.hpp"
#include "host/jobs.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

using namespace calot::host;

namespace {

struct Work {
    std::vector<std::atomic<int>> done;
    JobPool* nested = nullptr;
    explicit Work(std::size_t n) : done(n) {}
    static void run(void* context, std::uint32_t index) {
        Work& work = *static_cast<Work*>(context);
        work.done[index].fetch_add(1);
    }
};

} // namespace

TEST(JobPool, runs_each_index_once_whatever_the_number_of_threads) {
    for (const unsigned threads : {1u, 2u, 4u}) {
        JobPool pool(threads);
        EXPECT_EQ(pool.threads(), threads);
        for (int round = 0; round < 2000; ++round) {
            const std::uint32_t count = static_cast<std::uint32_t>(round % 37);
            Work work(count);
            pool.run(count, &Work::run, &work);
            for (std::uint32_t i = 0; i < count; ++i)
                ASSERT_EQ(work.done[i].load(), 1)
                    << threads << " threads, round " << round << ", index " << i;
        }
    }
}

TEST(JobPool, runs_jobs_of_a_job_on_the_same_thread) {
    JobPool pool(3);
    struct Outer {
        JobPool* pool;
        std::array<std::atomic<int>, 8> sums{};
    } outer{&pool};
    pool.run(
        8,
        [](void* context, std::uint32_t index) {
            auto& o = *static_cast<Outer*>(context);
            struct Inner {
                std::atomic<int>* sum;
            } inner{&o.sums[index]};
            o.pool->run(
                10,
                [](void* c, std::uint32_t i) { static_cast<Inner*>(c)->sum->fetch_add(static_cast<int>(i)); },
                &inner);
        },
        &outer);
    for (const auto& sum : outer.sums)
        EXPECT_EQ(sum.load(), 45);
}

TEST(JobPool, workers_are_in_the_call_of_the_plugin_whose_job_they_run) {
    JobPool pool(2);
    const Call mark("org.calot.test.jobs", "step");
    std::array<std::string, 16> names;
    pool.run(
        16,
        [](void* context, std::uint32_t index) {
            (*static_cast<std::array<std::string, 16>*>(context))[index] =
                culprit_of(blame(), present_call()).plugin;
        },
        &names);
    for (const std::string& name : names)
        EXPECT_EQ(name, "org.calot.test.jobs");
}
