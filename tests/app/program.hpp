// Runs the program `calot` as a user does, against small plugins and a small anatomy.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <sys/types.h>
#include <vector>

namespace calot_test {

struct Result {
    int exit_code = -1; ///< 128 + n: signal n
    std::string out;
    std::string err;

    /// The lines of `err` that are neither progress nor empty.
    std::vector<std::string> messages() const;
};

/// A running program; ended with its handle.
class Process {
  public:
    Process(const std::vector<std::string>& arguments, const std::map<std::string, std::string>& environment,
            const std::filesystem::path& scratch);
    ~Process();
    Process(const Process&) = delete;
    Process& operator=(const Process&) = delete;

    pid_t pid() const { return pid_; }
    /// The only child of it, waited for up to 10 s; -1 if there is none.
    pid_t child() const;
    Result wait();

  private:
    pid_t pid_ = -1;
    std::filesystem::path out_, err_;
};

/// A scratch folder with `assets` (an anatomy of one small tetrahedron, the shipped endoscopes) in it.
class ProgramTest : public testing::Test {
  protected:
    std::filesystem::path scratch;
    std::map<std::string, std::string> environment;

    void SetUp() override;
    void TearDown() override;

    Result calot(const std::vector<std::string>& arguments);
    /// run org.calot.test.procedure with the test device and rod, headless, into scratch/case, and more.
    std::vector<std::string> run_test_case(const std::vector<std::string>& more = {}) const;
    /// Puts `to` for the first match of `from` in a file.
    static void rewrite(const std::filesystem::path& file, const std::string& from, const std::string& to);
    /// A copy of a test plugin's folder below scratch/plugins, which CALOT_PLUGIN_PATH then names alone.
    std::filesystem::path copy_plugin(const std::string& folder);
    /// Waits up to 20 s for scratch/case/case.calot.
    bool record_exists() const;

    static std::filesystem::path plugins(const std::string& group);
};

std::string read_text(const std::filesystem::path& file);

} // namespace calot_test
