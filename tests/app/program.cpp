#include "program.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace calot_test {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
    std::stringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

std::vector<std::string> Result::messages() const {
    std::vector<std::string> lines;
    std::stringstream all(err);
    for (std::string line; std::getline(all, line);)
        if (!line.empty() && line.find("times real time") == std::string::npos) lines.push_back(line);
    return lines;
}

Process::Process(const std::vector<std::string>& arguments,
                 const std::map<std::string, std::string>& environment, const fs::path& scratch)
    : out_(scratch / "stdout"), err_(scratch / "stderr") {
    pid_ = fork();
    if (pid_ != 0) return;
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    for (const auto& [name, value] : environment)
        setenv(name.c_str(), value.c_str(), 1);
    dup2(open(out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 1);
    dup2(open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 2);
    const std::string program = CALOT_BINARY_DIR "/bin/calot";
    std::vector<char*> words{const_cast<char*>(program.c_str())};
    for (const std::string& word : arguments)
        words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    execv(program.c_str(), words.data());
    _exit(127);
}

Process::~Process() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
}

pid_t Process::child() const {
    const std::string list = "/proc/" + std::to_string(pid_) + "/task/" + std::to_string(pid_) + "/children";
    for (int i = 0; i < 1000; ++i) {
        pid_t found = -1;
        if (std::ifstream(list) >> found) return found;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return -1;
}

Result Process::wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    Result result;
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = read_text(out_);
    result.err = read_text(err_);
    return result;
}

void ProgramTest::SetUp() {
    scratch = fs::temp_directory_path() / ("calot-app-" + std::to_string(getpid()));
    fs::remove_all(scratch);
    fs::create_directories(scratch / "assets/anatomy/reference");
    for (const char* folder : {"endoscopes", "instruments", "shaders"})
        fs::create_directory_symlink(fs::path(CALOT_SOURCE_DIR) / "assets" / folder,
                                     scratch / "assets" / folder);
    std::ofstream(scratch / "assets/anatomy/reference/stone.obj")
        << "v 0.5 0 0\nv 0.52 0 0\nv 0.5 0.02 0\nv 0.5 0 0.02\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::ofstream(scratch / "assets/anatomy/reference/anatomy.toml") << R"(format = 1
name = "reference"
title = "A stone beside a straight way"
[[organ]]
id = "stone"
title = "Stone"
mesh = "stone.obj"
friction = 0.1
appearance = "serosa"
[landmark.guide]
position = [0.0, 0.0, 0.3]
direction = [0.0, 0.0, -1.0]
[landmark.path]
points = [[0.0, 0.0, 0.3], [0.0, 0.0, 0.2], [0.0, 0.0, 0.1], [0.0, 0.0, 0.0]]
)";
    environment["CALOT_ASSETS"] = (scratch / "assets").string();
    environment["CALOT_PLUGIN_PATH"] = plugins("good").string() + ":" + plugins("failing").string();
    environment["XDG_DATA_HOME"] = (scratch / "data").string();
}

void ProgramTest::TearDown() {
    fs::remove_all(scratch);
}

fs::path ProgramTest::plugins(const std::string& group) {
    return fs::path(CALOT_BINARY_DIR) / "lib/calot/test-plugins" / group;
}

Result ProgramTest::calot(const std::vector<std::string>& arguments) {
    return Process(arguments, environment, scratch).wait();
}

std::vector<std::string> ProgramTest::run_test_case(const std::vector<std::string>& more) const {
    std::vector<std::string> words{"run", "org.calot.test.procedure", "--headless", "--out",
                                   (scratch / "case").string()};
    const auto add = [&](const char* option, const char* value) {
        if (std::find(more.begin(), more.end(), option) == more.end())
            words.insert(words.end(), {option, value});
    };
    add("--device", "org.calot.test.device");
    add("--rod", "org.calot.test.rod");
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

void ProgramTest::rewrite(const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = read_text(file);
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::logic_error(file.string() + " lacks " + from);
    std::ofstream(file, std::ios::binary) << text.replace(at, from.size(), to);
}

fs::path ProgramTest::copy_plugin(const std::string& folder) {
    const fs::path from = plugins(folder);
    const fs::path to = scratch / "plugins" / from.filename();
    fs::create_directories(to.parent_path());
    fs::copy(from, to, fs::copy_options::recursive);
    environment["CALOT_PLUGIN_PATH"] = (scratch / "plugins").string();
    return to;
}

bool ProgramTest::record_exists() const {
    for (int i = 0; i < 2000 && !fs::exists(scratch / "case/case.calot"); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return fs::exists(scratch / "case/case.calot");
}

} // namespace calot_test
