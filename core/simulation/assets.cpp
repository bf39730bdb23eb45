#include "simulation/assets.hpp"

#include "host/error.hpp"

#include <cstdlib>
#include <vector>

namespace calot::simulation {

namespace fs = std::filesystem;

fs::path find_assets() {
    std::vector<fs::path> places;
    if (const char* given = std::getenv("CALOT_ASSETS")) places.emplace_back(given);
    std::error_code problem;
    const fs::path program = fs::read_symlink("/proc/self/exe", problem);
    for (fs::path folder = program.parent_path(); !folder.empty() && folder != folder.root_path();
         folder = folder.parent_path()) {
        places.push_back(folder / "assets");
        places.push_back(folder / "share/calot");
    }
    for (const fs::path& place : places)
        if (fs::is_directory(place / "anatomy", problem) && fs::is_directory(place / "endoscopes", problem))
            return place;
    throw host::UserError("assets/anatomy", "",
                          "is in no folder above the program; set CALOT_ASSETS to the folder that holds "
                          "anatomy and endoscopes");
}

} // namespace calot::simulation
