#include "plot/whole_file.hpp"

#include "host/error.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <unistd.h>

namespace calot::plot {

void write_whole(const std::filesystem::path& file, std::string_view bytes) {
    const std::string part = file.string() + ".part-" + std::to_string(::getpid());
    const auto refuse = [&](int error) {
        std::remove(part.c_str());
        throw host::UserError(file.string(), "",
                              std::string("cannot be written: ") + std::strerror(error) +
                                  "; choose another place");
    };
    std::FILE* to = std::fopen(part.c_str(), "wb");
    if (to == nullptr) refuse(errno);
    const bool is_written = std::fwrite(bytes.data(), 1, bytes.size(), to) == bytes.size() &&
                            std::fflush(to) == 0 && ::fsync(::fileno(to)) == 0;
    const int error = errno;
    std::fclose(to);
    if (!is_written) refuse(error);
    if (std::rename(part.c_str(), file.c_str()) != 0) refuse(errno);
}

} // namespace calot::plot
