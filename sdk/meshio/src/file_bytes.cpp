#include "file_bytes.hpp"

#include <calot/meshio/mesh.hpp>

#include <fstream>

namespace calot::meshio {

std::string read_file_bytes(const std::filesystem::path& file, std::uintmax_t limit) {
    std::error_code error;
    const auto status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status)) throw MeshError(file.string() + ": no such file: check the path");
    if (!std::filesystem::is_regular_file(status))
        throw MeshError(file.string() + ": not a regular file: name a file");
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (error) throw MeshError(file.string() + ": cannot be read: " + error.message());
    if (size > limit)
        throw MeshError(file.string() + ": " + std::to_string(size) + " bytes, more than the limit of " +
                        std::to_string(limit) + ": simplify it first");
    std::string bytes(size, '\0');
    std::ifstream in(file, std::ios::binary);
    if (!in) throw MeshError(file.string() + ": cannot be opened: check its permissions");
    in.read(bytes.data(), static_cast<std::streamsize>(size));
    if (static_cast<std::uintmax_t>(in.gcount()) != size)
        throw MeshError(file.string() + ": became shorter while it was read: try again");
    return bytes;
}

} // namespace calot::meshio
