#include "program.hpp"

#include <csignal>
#include <fstream>
#include <sys/stat.h>
#include <unistd.h>

namespace fs = std::filesystem;
using calot_test::Process;
using calot_test::Result;

class Run : public calot_test::ProgramTest {
  protected:
    static unsigned mode(const fs::path& path) {
        struct stat s {};
        return stat(path.c_str(), &s) == 0 ? s.st_mode & 0777 : 0;
    }
};

TEST_F(Run, completes_a_case_and_says_where_its_files_are) {
    const Result result = calot(run_test_case());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("Push in: completed"), std::string::npos) << result.out;
    for (const char* name : {"case.calot", "metrics.csv", "metrics-dictionary.csv"}) {
        const fs::path file = scratch / "case" / name;
        EXPECT_NE(result.out.find(file.string()), std::string::npos) << result.out;
        ASSERT_TRUE(fs::exists(file)) << file;
        EXPECT_GT(fs::file_size(file), 0u) << file;
        EXPECT_EQ(mode(file), 0600u) << file << " must be its operator's own";
    }
    EXPECT_EQ(mode(scratch / "case"), 0700u);
}

TEST_F(Run, prints_one_json_object) {
    const Result result = calot(run_test_case({"--json"}));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    ASSERT_FALSE(result.out.empty());
    EXPECT_EQ(result.out.front(), '{') << result.out;
    for (const char* key : {"\"tasks\"", "\"metrics\"", "\"files\"", "\"real_time_factor\""})
        EXPECT_NE(result.out.find(key), std::string::npos) << key << " is missing: " << result.out;
}

TEST_F(Run, that_its_time_limit_ends_is_not_completed) {
    const Result result = calot(run_test_case({"--time-limit", "0.5"}));
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_NE(result.out.find("Push in: not completed"), std::string::npos) << result.out;
    EXPECT_TRUE(fs::exists(scratch / "case/metrics.csv"));
}

TEST_F(Run, that_is_asked_to_end_ends_in_order) {
    Process process(run_test_case({"--speed", "realtime", "--device", "org.calot.test.c-device"}),
                    environment, scratch);
    ASSERT_TRUE(record_exists());
    usleep(300000);
    kill(process.pid(), SIGTERM);
    const Result result = process.wait();
    EXPECT_EQ(result.exit_code, 1) << result.err;
    ASSERT_TRUE(fs::exists(scratch / "case/metrics.csv"));
    EXPECT_NE(result.out.find("it was ended"), std::string::npos) << result.out;
}

TEST_F(Run, can_be_verified_by_its_replay) {
    EXPECT_EQ(calot(run_test_case({"--instrument", "2=needle"})).exit_code, 0);
    const Result result = calot({"replay", (scratch / "case").string(), "--verify"});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_NE(result.out.find("give the same bits"), std::string::npos) << result.out;
    EXPECT_EQ(result.messages().size(), 0u) << "nothing has changed since: " << result.err;
}

TEST_F(Run, writes_into_no_folder_that_exists) {
    fs::create_directory(scratch / "case");
    std::ofstream(scratch / "case/case.calot") << "mine";
    const Result result = calot(run_test_case());
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_EQ(calot_test::read_text(scratch / "case/case.calot"), "mine");
}
