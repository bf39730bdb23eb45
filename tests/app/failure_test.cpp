// What fails in the middle of a case ends it in order: the culprit is named, the record can be read, exit
// code 3.
#include "program.hpp"

#include <chrono>
#include <csignal>
#include <regex>
#include <unistd.h>

namespace fs = std::filesystem;
using calot_test::Process;
using calot_test::Result;

class Failure : public calot_test::ProgramTest {
  protected:
    void expect_named(const std::string& rod, const std::vector<std::string>& parts) {
        fs::remove_all(scratch / "case");
        const Result result = calot(run_test_case({"--rod", rod}));
        EXPECT_EQ(result.exit_code, 3) << result.out << result.err;
        EXPECT_NE(result.err.find(rod), std::string::npos) << result.err;
        EXPECT_NE(result.err.find("tick 500"), std::string::npos) << result.err;
        for (const std::string& part : parts)
            EXPECT_NE(result.err.find(part), std::string::npos) << "lacks \"" << part << "\": " << result.err;
    }
    static bool is_running(pid_t process) {
        const std::string stat = calot_test::read_text("/proc/" + std::to_string(process) + "/stat");
        const std::size_t name_end = stat.rfind(") ");
        return name_end != std::string::npos &&
               stat[name_end + 2] != 'Z'; // a zombie waits for its parent only
    }
    /// Ticks that a replay of the record verifies, -1 if one differs.
    int verified() {
        const Result result = calot({"replay", (scratch / "case").string(), "--verify"});
        std::smatch match;
        const bool is_same = std::regex_search(result.out, match, std::regex("verified: (\\d+) of"));
        return result.exit_code == 0 && is_same ? std::stoi(match[1]) : -1;
    }
};

TEST_F(Failure, a_crash_names_plugin_function_and_tick_and_where_the_record_is) {
    expect_named("org.calot.test.rod-crash",
                 {"crashed (Segmentation fault) in rod.step", (scratch / "case").string()});
    EXPECT_TRUE(fs::exists(scratch / "case/case.calot"));
}

TEST_F(Failure, an_overflow_of_the_stack_does_too) {
    expect_named("org.calot.test.rod-overflow", {"crashed (Segmentation fault) in rod.step"});
}

TEST_F(Failure, a_hang_is_ended_after_a_second) {
    const auto begin = std::chrono::steady_clock::now();
    expect_named("org.calot.test.rod-hang", {"hung and was ended in rod.step"});
    const auto took = std::chrono::steady_clock::now() - begin;
    EXPECT_GT(took, std::chrono::seconds(1));
    EXPECT_LT(took, std::chrono::seconds(20));
}

TEST_F(Failure, what_is_not_finite_or_an_error_ends_the_case_with_its_metrics) {
    expect_named("org.calot.test.rod-nan", {"step", "not finite"});
    EXPECT_TRUE(fs::exists(scratch / "case/metrics.csv"));
    expect_named("org.calot.test.rod-error", {"step: matrix: is singular"});
    EXPECT_TRUE(fs::exists(scratch / "case/metrics.csv"));
}

TEST_F(Failure, with_json_is_an_object_too) {
    const Result result = calot(run_test_case({"--rod", "org.calot.test.rod-crash", "--json"}));
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_NE(result.out.find(
                  "\"plugin\": \"org.calot.test.rod-crash\", \"function\": \"rod.step\", \"tick\": 500"),
              std::string::npos)
        << result.out;
}

TEST_F(Failure, a_killed_case_is_at_most_a_second_short) {
    Process process(run_test_case({"--speed", "realtime", "--device", "org.calot.test.c-device"}),
                    environment, scratch);
    const pid_t child = process.child();
    ASSERT_GT(child, 0);
    ASSERT_TRUE(record_exists());
    usleep(3300000);
    kill(child, SIGKILL);
    const Result result = process.wait();
    EXPECT_EQ(result.exit_code, 3) << result.err;
    std::smatch match;
    ASSERT_TRUE(std::regex_search(result.err, match, std::regex("crashed \\(Killed\\) at tick (\\d+)")))
        << result.err;
    const int reached = std::stoi(match[1]), kept = verified();
    EXPECT_GT(reached, 1000) << "the case did not run for long enough";
    EXPECT_GE(kept, reached - 1000) << "of " << reached << " ticks";
}

TEST_F(Failure, the_child_dies_with_its_supervisor) {
    Process process(run_test_case({"--speed", "realtime", "--device", "org.calot.test.c-device"}),
                    environment, scratch);
    const pid_t child = process.child();
    ASSERT_GT(child, 0);
    ASSERT_TRUE(record_exists());
    kill(process.pid(), SIGKILL);
    EXPECT_EQ(process.wait().exit_code, 128 + SIGKILL);
    int i = 0;
    while (kill(child, 0) == 0 && i < 500)
        usleep(10000), ++i;
    EXPECT_LT(i, 500) << "the child lived on for 5 s";
}
