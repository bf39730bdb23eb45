#include "app/case_folder.hpp"

#include <array>
#include <cstdlib>
#include <ctime>

namespace calot::app {

namespace fs = std::filesystem;

fs::path cases_folder() {
    const char* data = std::getenv("XDG_DATA_HOME");
    if (data != nullptr && *data != '\0') return fs::path(data) / "calot/cases";
    const char* home = std::getenv("HOME");
    return (home != nullptr ? fs::path(home) / ".local/share" : fs::current_path()) / "calot/cases";
}

fs::path new_case_folder(const std::string& procedure, std::uint64_t seed) {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    localtime_r(&now, &parts);
    std::array<char, 32> time;
    std::strftime(time.data(), time.size(), "%Y-%m-%d-%H%M%S", &parts);
    const std::string last = procedure.substr(procedure.rfind('.') + 1);
    const fs::path folder =
        cases_folder() / (std::string(time.data()) + "-" + last + "-" + std::to_string(seed));
    fs::path free = folder;
    for (int i = 2; fs::exists(free) && i < 1000; ++i)
        free = folder.string() + "-" + std::to_string(i);
    return free;
}

} // namespace calot::app
