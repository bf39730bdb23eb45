// What a picture is drawn on: SVG or PNG by the file's name, written whole or not at all.
#pragma once

#include <cairo.h>
#include <filesystem>
#include <memory>
#include <string>

namespace calot::plot {

class Canvas {
  public:
    /// White, `width` by `height` units (two pixels each in a PNG). Throws host::UserError for a name that is
    /// no picture's.
    Canvas(double width, double height, std::filesystem::path file);
    cairo_t* cairo() const { return cairo_.get(); }
    /// Throws host::UserError. Nothing can be drawn after it.
    void write();

  private:
    struct Destroy {
        void operator()(cairo_surface_t* s) const { cairo_surface_destroy(s); }
        void operator()(cairo_t* c) const { cairo_destroy(c); }
    };
    std::filesystem::path file_;
    std::string bytes_;
    std::unique_ptr<cairo_surface_t, Destroy> surface_;
    std::unique_ptr<cairo_t, Destroy> cairo_;
};

} // namespace calot::plot
