// The launcher with a stand-in for `calot` that writes a case's files.
#include "launcher/child.hpp"
#include "launcher/launcher.hpp"
#include "launcher/results.hpp"
#include "rendering/png.hpp"

#include <SDL2/SDL.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>
#include <unistd.h>

namespace calot::launcher {
namespace {

namespace fs = std::filesystem;

class LauncherTest : public testing::Test {
  protected:
    LauncherTest()
        : folder_(fs::temp_directory_path() / ("calot-launcher-test-" + std::to_string(getpid()))) {
        fs::create_directories(folder_);
    }
    ~LauncherTest() override { fs::remove_all(folder_); }

    fs::path script(const std::string& name, const std::string& body) const {
        fs::path file = folder_ / name;
        std::ofstream(file) << "#!/bin/sh\n" << body;
        fs::permissions(file, fs::perms::owner_all);
        return file;
    }

    LauncherSettings settings() const {
        LauncherSettings s;
        s.procedures = {{"org.calot.transgastric-cholecystectomy",
                         "Trans-gastric cholecystectomy",
                         "Surgery",
                         "intermediate",
                         20,
                         "Through the mouth into the stomach, through its wall, and to the gallbladder. Find "
                         "the red ring and pass through it.",
                         {},
                         "org.calot.virtual-operator",
                         1},
                        {"org.example.colonoscopy",
                         "Colonoscopy",
                         "Gastroenterology",
                         "basic",
                         15,
                         "To the caecum and back.",
                         {},
                         {},
                         1}};
        s.devices = {{"org.calot.keyboard-mouse", "Keyboard and mouse"},
                     {"org.calot.virtual-operator", "Virtual operator"}};
        s.cases_folder = folder_ / "cases";
        return s;
    }

    void step_until(Launcher& launcher, LauncherPage page) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
        while (launcher.page() != page && std::chrono::steady_clock::now() < end)
            ASSERT_TRUE(launcher.step());
        ASSERT_EQ(launcher.page(), page);
        for (int i = 0; i < 3; ++i)
            ASSERT_TRUE(launcher.step());
    }

    static std::unique_ptr<Launcher> open(LauncherSettings s, std::string& reason) {
        if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY"))
            setenv("SDL_VIDEODRIVER", "offscreen", 0);
        try {
            return std::make_unique<Launcher>(std::move(s));
        } catch (const std::exception& error) {
            reason = error.what();
            return nullptr;
        }
    }

    static rendering::Image picture(Launcher& launcher, const char* name) {
        rendering::Image image;
        launcher.read(image);
        if (const char* folder = std::getenv("CALOT_TEST_PICTURES"))
            rendering::write_png(std::string(folder) + "/" + name + ".png", image);
        return image;
    }

    fs::path folder_;
};

TEST_F(LauncherTest, a_case_is_started_as_a_child_and_its_metrics_are_shown) {
    LauncherSettings s = settings();
    s.program = script("calot", R"(echo "$@" > )" + (folder_ / "arguments").string() + R"(
while [ $# -gt 1 ]; do [ "$1" = --out ] && out="$2"; shift; done
printf 'case_id,navigation_time,navigation_path_length\r\n7,41.25,\r\n' > "$out/metrics.csv"
printf 'name,unit,definition,task,title\r\nnavigation_time,s,"From first motion, to the goal",Navigation,Time\r\nnavigation_path_length,m,Length,Navigation,Path length of the tip\r\n' > "$out/metrics-dictionary.csv"
)");
    std::string reason;
    const auto launcher = open(s, reason);
    if (!launcher) GTEST_SKIP() << reason;
    for (int i = 0; i < 3; ++i)
        ASSERT_TRUE(launcher->step());
    const rendering::Image chosen = picture(*launcher, "launcher-choice");
    std::size_t bright = 0;
    for (std::size_t i = 0; i < chosen.rgba.size(); i += 4)
        bright += chosen.rgba[i + 1] > 180;
    EXPECT_GT(bright, 2000u) << "no text on the launcher's first page";
    launcher->start();
    ASSERT_EQ(launcher->page(), LauncherPage::Running);
    step_until(*launcher, LauncherPage::Results);
    picture(*launcher, "launcher-results");
    std::ifstream in(folder_ / "arguments");
    std::string arguments;
    std::getline(in, arguments);
    EXPECT_TRUE(arguments.starts_with(
        "run org.calot.transgastric-cholecystectomy --device org.calot.keyboard-mouse --seed 1 --out "))
        << arguments;
    ASSERT_FALSE(fs::is_empty(folder_ / "cases"));
    const auto results = read_results(fs::directory_iterator(folder_ / "cases")->path());
    ASSERT_EQ(results.size(), 3u);
    EXPECT_EQ(results[1].title, "Time");
    EXPECT_EQ(results[1].value, "41.25");
    EXPECT_EQ(results[1].definition, "From first motion, to the goal");
    EXPECT_EQ(results[2].value, "");
    EXPECT_EQ(results[0].title, "Case id")
        << "a column that the dictionary does not know keeps its name, made readable";
}

TEST_F(LauncherTest, a_case_that_cannot_start_is_explained) {
    LauncherSettings s = settings();
    s.program = script("calot", "echo 'scene.toml: endoscope: is missing; add it' >&2\nexit 2\n");
    std::string reason;
    const auto launcher = open(s, reason);
    if (!launcher) GTEST_SKIP() << reason;
    launcher->start();
    step_until(*launcher, LauncherPage::Results);
    picture(*launcher, "launcher-refused");
}

TEST_F(LauncherTest, closing_the_window_ends_the_launcher) {
    std::string reason;
    const auto launcher = open(settings(), reason);
    if (!launcher) GTEST_SKIP() << reason;
    ASSERT_TRUE(launcher->step());
    SDL_Event e{};
    e.type = SDL_QUIT;
    SDL_PushEvent(&e);
    EXPECT_FALSE(launcher->step());
}

TEST_F(LauncherTest, a_child_s_exit_code_signal_and_last_words_are_kept) {
    const auto finish = [](Child& child) {
        for (int i = 0; i < 1000 && child.poll(); ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
    };
    Child sound({script("a", "echo one >&2; echo two >&2; exit 3\n").string()});
    finish(sound);
    EXPECT_EQ(sound.exit_code(), 3);
    EXPECT_EQ(sound.words(), "one\ntwo\n");
    Child killed({script("b", "kill -SEGV $$\n").string()});
    finish(killed);
    EXPECT_EQ(killed.exit_code(), 128 + SIGSEGV);
    Child asked({script("c", "exec sleep 30\n").string()});
    EXPECT_TRUE(asked.poll());
    asked.ask_to_end();
    finish(asked);
    EXPECT_EQ(asked.exit_code(), 128 + SIGTERM);
    EXPECT_THROW(Child({(folder_ / "nothing").string()}), std::runtime_error);
}

TEST(Csv, quotes_commas_and_line_ends_are_read_as_rfc_4180_says) {
    const auto rows = parse_csv("a,\"b,\"\"c\"\"\",\"two\r\nlines\"\r\n,\r\n\nx\n");
    ASSERT_EQ(rows.size(), 3u);
    EXPECT_EQ(rows[0], (std::vector<std::string>{"a", "b,\"c\"", "two\r\nlines"}));
    EXPECT_EQ(rows[1], (std::vector<std::string>{"", ""}));
    EXPECT_EQ(rows[2], (std::vector<std::string>{"x"}));
    EXPECT_THROW(parse_csv("a,\"b"), std::runtime_error);
    EXPECT_THROW(parse_csv(std::string(1'000'001, ',')), std::runtime_error);
}

} // namespace
} // namespace calot::launcher
