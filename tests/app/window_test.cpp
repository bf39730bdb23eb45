// A person at a window, played by synthetic key presses under Xvfb: pushes, pauses, ends.
#include "program.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace fs = std::filesystem;
using calot_test::Process;
using calot_test::Result;

class Window : public calot_test::ProgramTest {
  protected:
    pid_t server = -1;

    void SetUp() override {
        ProgramTest::SetUp();
        for (const char* needed : {"/usr/bin/Xvfb", "/usr/bin/xdotool"})
            if (!fs::exists(needed)) GTEST_SKIP() << needed << " is not installed (packages xvfb, xdotool)";
        int ends[2];
        ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
        server = fork();
        if (server == 0) {
            const int null = open("/dev/null", O_RDWR);
            dup2(null, 1), dup2(null, 2);
            dup2(ends[1], 9);
            execl("/usr/bin/Xvfb", "Xvfb", "-displayfd", "9", "-screen", "0", "1440x900x24", "-nolisten",
                  "tcp", nullptr);
            _exit(127);
        }
        close(ends[1]);
        std::string number;
        for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';)
            number += c;
        ASSERT_FALSE(number.empty()) << "Xvfb did not start";
        close(ends[0]);
        environment["DISPLAY"] = ":" + number;
    }
    void TearDown() override {
        if (server > 0) {
            kill(server, SIGTERM);
            waitpid(server, nullptr, 0);
        }
        ProgramTest::TearDown();
    }

    std::vector<std::string> case_in_window() const {
        return {"run",   "org.calot.test.procedure", "--device", "org.calot.keyboard",
                "--rod", "org.calot.test.rod",       "--out",    (scratch / "case").string()};
    }
    void press(const std::string& xdotool) const {
        const std::string command =
            "DISPLAY=" + environment.at("DISPLAY") + " timeout 60 xdotool " + xdotool + " >/dev/null 2>&1";
        EXPECT_EQ(std::system(command.c_str()), 0) << command;
    }
    /// Waits for the window and gives it the keyboard; there is no window manager to do it.
    void focus() const {
        ASSERT_TRUE(record_exists());
        press("search --sync --onlyvisible --name Calot windowfocus --sync");
    }
};

TEST_F(Window, keys_push_the_endoscope_in) {
    Process process(case_in_window(), environment, scratch);
    focus();
    press("keydown w");
    const Result result = process.wait(); // the procedure is over when 10 mm are pushed in
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_NE(result.out.find("Push in: completed"), std::string::npos) << result.out;
}

TEST_F(Window, escape_pauses_and_the_case_that_is_then_ended_writes_its_metrics) {
    Process process(case_in_window(), environment, scratch);
    focus();
    press("key Escape");
    std::this_thread::sleep_for(std::chrono::seconds(2)); // a picture may take half a second without a GPU
    press("keydown w");
    std::this_thread::sleep_for(std::chrono::seconds(2)); // enough to complete it, were it not paused
    press("keyup w");
    kill(process.pid(), SIGTERM);
    const Result result = process.wait();
    EXPECT_EQ(result.exit_code, 1) << "the key was heard in the pause: " << result.out << result.err;
    EXPECT_TRUE(fs::exists(scratch / "case/metrics.csv"));
}
