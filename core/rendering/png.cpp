#include "rendering/png.hpp"

#include <cerrno>
#include <cstring>
#include <png.h>
#include <stdexcept>

namespace calot::rendering {

void write_png(const std::filesystem::path& file, const Image& image) {
    if (image.width <= 0 || image.height <= 0 ||
        image.rgba.size() !=
            static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4)
        throw std::runtime_error(file.string() + ": the picture is empty");
    png_image description{};
    description.version = PNG_IMAGE_VERSION;
    description.width = static_cast<png_uint_32>(image.width);
    description.height = static_cast<png_uint_32>(image.height);
    description.format = PNG_FORMAT_RGBA;
    errno = 0;
    if (!png_image_write_to_file(&description, file.c_str(), 0, image.rgba.data(), 0, nullptr))
        throw std::runtime_error(
            file.string() + ": cannot be written: " + (errno ? std::strerror(errno) : description.message));
}

} // namespace calot::rendering
