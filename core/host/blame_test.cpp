#include "host/blame.hpp"

#include <gtest/gtest.h>

#include <cstring>

using namespace calot::host;

TEST(Blame, names_the_innermost_call_and_nothing_outside) {
    EXPECT_EQ(culprit_of(blame(), present_call()).plugin, "");
    {
        const Call outer("org.a", "step");
        EXPECT_EQ(culprit_of(blame(), present_call()).plugin, "org.a");
        {
            const Call inner("org.b", "poll");
            EXPECT_EQ(culprit_of(blame(), present_call()).plugin, "org.b");
            EXPECT_EQ(culprit_of(blame(), present_call()).function, "poll");
        }
        EXPECT_EQ(culprit_of(blame(), present_call()).plugin, "org.a");
    }
    EXPECT_EQ(culprit_of(blame(), present_call()).plugin, "");
}

TEST(Blame, a_new_call_of_the_same_function_can_be_told_from_one_that_hangs) {
    std::uint64_t first = 0;
    {
        const Call call("org.a", "step");
        first = present_call();
        EXPECT_EQ(first, present_call());
    }
    const Call call("org.a", "step");
    EXPECT_NE(first, present_call());
}

TEST(Blame, rubbish_in_shared_memory_names_nobody) {
    Blame broken;
    EXPECT_EQ(culprit_of(broken, 0xffffffffffffffff).plugin, "");
    std::memset(broken.names[3].plugin, 'x', sizeof broken.names[3].plugin);
    EXPECT_EQ(culprit_of(broken, 4).plugin.size(), sizeof broken.names[3].plugin);
}

TEST(Blame, steps_and_polls_are_real_time_whatever_stands_before_them) {
    for (const char* name : {"step", "rod.step", "device.poll", "procedure.update"})
        EXPECT_TRUE(is_realtime(name)) << name;
    for (const char* name : {"", "init", "rod.configure", "stepping", "load"})
        EXPECT_FALSE(is_realtime(name)) << name;
}
