#include "launcher/picture.hpp"

#include <png.h>
#include <vector>

namespace calot::launcher {

Picture load_picture(const std::filesystem::path& file) {
    Picture out;
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    if (file.empty() || !png_image_begin_read_from_file(&image, file.c_str())) return out;
    image.format = PNG_FORMAT_RGBA;
    if (image.width == 0 || image.height == 0 || image.width > 8192 || image.height > 8192 ||
        image.width * image.height > 16'000'000) {
        png_image_free(&image);
        return out;
    }
    std::vector<png_byte> pixels(PNG_IMAGE_SIZE(image));
    if (!png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr)) return out;
    out.texture = rendering::make_texture();
    out.width = static_cast<int>(image.width);
    out.height = static_cast<int>(image.height);
    glBindTexture(GL_TEXTURE_2D, *out.texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, out.width, out.height, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 pixels.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glGenerateMipmap(GL_TEXTURE_2D);
    return out;
}

} // namespace calot::launcher
