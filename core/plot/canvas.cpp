#include "plot/canvas.hpp"

#include "host/error.hpp"
#include "plot/chart.hpp"
#include "plot/whole_file.hpp"

#include <cairo-svg.h>

namespace calot::plot {

namespace {

constexpr double png_scale = 2; // pixels for each unit

bool is_svg(const std::filesystem::path& file) {
    return file.extension() == ".svg";
}

cairo_status_t append(void* to, const unsigned char* data, unsigned int size) {
    static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(data), size);
    return CAIRO_STATUS_SUCCESS;
}

} // namespace

void require_picture_name(const std::filesystem::path& file, const std::string& option) {
    if (file.extension() != ".png" && !is_svg(file))
        throw host::UserError(option, file.string(), "is no picture's name; let it end in .png or .svg");
    if (const auto folder = file.parent_path(); !folder.empty() && !std::filesystem::is_directory(folder))
        throw host::UserError(option, "", folder.string() + " is no folder; make it first");
}

Canvas::Canvas(double width, double height, std::filesystem::path file) : file_(std::move(file)) {
    require_picture_name(file_, "picture");
    surface_.reset(is_svg(file_)
                       ? cairo_svg_surface_create_for_stream(&append, &bytes_, width, height)
                       : cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(width * png_scale),
                                                    static_cast<int>(height * png_scale)));
    cairo_.reset(cairo_create(surface_.get()));
    if (!is_svg(file_)) cairo_scale(cairo_.get(), png_scale, png_scale);
    cairo_set_source_rgb(cairo_.get(), 1, 1, 1);
    cairo_paint(cairo_.get());
}

void Canvas::write() {
    cairo_.reset();
    if (is_svg(file_))
        cairo_surface_finish(surface_.get());
    else
        cairo_surface_write_to_png_stream(surface_.get(), &append, &bytes_);
    const cairo_status_t status = cairo_surface_status(surface_.get());
    if (status != CAIRO_STATUS_SUCCESS || bytes_.empty())
        throw host::UserError(file_.string(), "",
                              std::string("cannot be drawn: ") + cairo_status_to_string(status));
    write_whole(file_, bytes_);
}

} // namespace calot::plot
