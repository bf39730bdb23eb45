#include "plot/chart.hpp"

#include "plot/canvas.hpp"
#include "plot/ticks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace calot::plot {

namespace {

// Okabe and Ito's palette (2008): told apart with any colour vision. Their yellow is too pale for lines.
constexpr std::array<std::array<double, 3>, 8> palette{{{0.00, 0.45, 0.70},
                                                        {0.84, 0.37, 0.00},
                                                        {0.00, 0.62, 0.45},
                                                        {0.80, 0.47, 0.65},
                                                        {0.34, 0.71, 0.91},
                                                        {0.90, 0.62, 0.00},
                                                        {0.20, 0.20, 0.20},
                                                        {0.55, 0.55, 0.55}}};

constexpr double panel_width = 460, panel_height = 380, left = 66, right = 16, top = 34, bottom = 50;
constexpr double small_text = 11, title_text = 13;
constexpr std::size_t most_in_row = 3;
constexpr int pieces = 10; // of a line between two points, when the legend looks for its place

std::optional<double> place(double value, bool is_log) {
    if (!std::isfinite(value) || (is_log && value <= 0)) return {};
    return is_log ? std::log10(value) : value;
}

Axis axis_of(const Panel& panel, bool is_x, int count) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const bool is_log = is_x ? panel.is_log_x : panel.is_log_y;
    for (const Series& s : panel.series)
        for (std::size_t i = 0; i < s.x.size(); ++i) {
            const auto x = place(s.x[i], panel.is_log_x), y = place(s.y[i], panel.is_log_y);
            if (!x || !y) continue;
            const double value = is_x ? *x : *y;
            low = std::min(low, value), high = std::max(high, value);
        }
    if (!(low <= high)) low = 0, high = 1;
    return make_axis(low, high, is_log, count);
}

// Widens the axis that has more room, so that a unit is as long on both.
void to_scale(Axis& x, Axis& y, double width, double height) {
    const double unit = std::max((x.high - x.low) / width, (y.high - y.low) / height);
    const auto widen = [&](Axis& axis, double size, int count) {
        const double middle = 0.5 * (axis.low + axis.high), half = 0.5 * unit * size / 1.08;
        axis = make_axis(middle - half, middle + half, false, count);
    };
    widen(x, width, 6), widen(y, height, 6);
}

class PanelPainter {
  public:
    PanelPainter(cairo_t* c, const Panel& panel, double x0, double y0)
        : c_(c), panel_(panel), x0_(x0 + left), y0_(y0 + top), width_(panel_width - left - right),
          height_(panel_height - top - bottom), x_(axis_of(panel, true, 6)), y_(axis_of(panel, false, 6)) {
        if (panel.is_to_scale) to_scale(x_, y_, width_, height_);
        size_legend();
        place_legend();
        // Nowhere free: more room above the curves.
        for (int k = 0; k < 3 && legend_.covered > 0; ++k) {
            y_ = make_axis(y_.low, y_.high + 0.2 * (y_.high - y_.low), y_.is_log, 6);
            if (panel.is_to_scale) to_scale(x_, y_, width_, height_);
            place_legend();
        }
    }

    void paint() {
        frame();
        cairo_save(c_);
        cairo_rectangle(c_, x0_, y0_, width_, height_);
        cairo_clip(c_);
        std::size_t next = 0;
        std::vector<std::size_t> colours;
        for (const Series& s : panel_.series) {
            colours.push_back((s.colour >= 0 ? static_cast<std::size_t>(s.colour) : next++) % palette.size());
            curve(s, colours.back());
        }
        cairo_restore(c_);
        legend(colours);
    }

  private:
    double px(double x) const { return x0_ + (x - x_.low) / (x_.high - x_.low) * width_; }
    double py(double y) const { return y0_ + height_ - (y - y_.low) / (y_.high - y_.low) * height_; }

    // along, down: -1 to the left of / above the point, 0 in its middle, 1 to the right / below.
    void write(const std::string& text, double x, double y, double size, double along, double down) {
        cairo_set_font_size(c_, size);
        cairo_text_extents_t e;
        cairo_text_extents(c_, text.c_str(), &e);
        cairo_move_to(c_, x - 0.5 * (1 - along) * e.x_advance, y + 0.36 * size * (1 + down));
        cairo_show_text(c_, text.c_str());
    }

    void frame() {
        cairo_set_source_rgb(c_, 0.15, 0.15, 0.15);
        cairo_select_font_face(c_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
        write(panel_.title, x0_ + 0.5 * width_, y0_ - 14, title_text, 0, 0);
        cairo_select_font_face(c_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
        cairo_set_line_width(c_, 0.6);
        for (std::size_t i = 0; i < x_.ticks.size(); ++i) {
            line(px(x_.ticks[i]), y0_, px(x_.ticks[i]), y0_ + height_, x_.ticks[i] == 0 && !x_.is_log);
            write(x_.labels[i], px(x_.ticks[i]), y0_ + height_ + 11, small_text, 0, 0);
        }
        for (std::size_t i = 0; i < y_.ticks.size(); ++i) {
            line(x0_, py(y_.ticks[i]), x0_ + width_, py(y_.ticks[i]), y_.ticks[i] == 0 && !y_.is_log);
            write(y_.labels[i], x0_ - 6, py(y_.ticks[i]), small_text, -1, 0);
        }
        cairo_set_source_rgb(c_, 0.15, 0.15, 0.15);
        cairo_set_line_width(c_, 1);
        cairo_rectangle(c_, x0_, y0_, width_, height_);
        cairo_stroke(c_);
        write(panel_.x_label, x0_ + 0.5 * width_, y0_ + height_ + 32, small_text, 0, 0);
        cairo_save(c_);
        cairo_translate(c_, x0_ - 50, y0_ + 0.5 * height_);
        cairo_rotate(c_, -0.5 * std::numbers::pi);
        write(panel_.y_label, 0, 0, small_text, 0, 0);
        cairo_restore(c_);
    }

    void line(double x1, double y1, double x2, double y2, bool is_zero) {
        cairo_set_source_rgb(c_, is_zero ? 0.6 : 0.88, is_zero ? 0.6 : 0.88, is_zero ? 0.6 : 0.88);
        cairo_move_to(c_, x1, y1);
        cairo_line_to(c_, x2, y2);
        cairo_stroke(c_);
        cairo_set_source_rgb(c_, 0.15, 0.15, 0.15);
    }

    void set_colour(std::size_t colour) {
        const auto& rgb = palette[colour];
        cairo_set_source_rgb(c_, rgb[0], rgb[1], rgb[2]);
    }

    void stroke(Mark mark) {
        cairo_set_line_width(c_, 1.6);
        const double dash[2] = {5, 3};
        cairo_set_dash(c_, dash, mark == Mark::dashed ? 2 : 0, 0);
        cairo_stroke(c_);
        cairo_set_dash(c_, dash, 0, 0);
    }

    void dot(double x, double y) {
        cairo_arc(c_, x, y, 2.6, 0, 2 * std::numbers::pi);
        cairo_fill(c_);
    }

    void curve(const Series& s, std::size_t colour) {
        set_colour(colour);
        bool is_begun = false;
        for (std::size_t i = 0; i < s.x.size() && s.mark != Mark::points; ++i) {
            const auto x = place(s.x[i], x_.is_log), y = place(s.y[i], y_.is_log);
            if (!x || !y) {
                is_begun = false;
                continue;
            }
            if (is_begun)
                cairo_line_to(c_, px(*x), py(*y));
            else
                cairo_move_to(c_, px(*x), py(*y));
            is_begun = true;
        }
        stroke(s.mark);
        if (s.mark != Mark::points && s.mark != Mark::line_and_points) return;
        for (std::size_t i = 0; i < s.x.size(); ++i) {
            const auto x = place(s.x[i], x_.is_log), y = place(s.y[i], y_.is_log);
            if (x && y) dot(px(*x), py(*y));
        }
    }

    struct Legend {
        double x = 0, y = 0, width = 0, height = 0; // no height: there is none
        std::size_t covered = 0;                    // points of curves behind it
    };

    void size_legend() {
        double wide = 0;
        std::size_t count = 0;
        cairo_select_font_face(c_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
        cairo_set_font_size(c_, small_text);
        for (const Series& s : panel_.series) {
            if (s.label.empty()) continue;
            cairo_text_extents_t e;
            cairo_text_extents(c_, s.label.c_str(), &e);
            wide = std::max(wide, e.x_advance), ++count;
        }
        if (count > 0) legend_.width = wide + 38, legend_.height = 15.0 * static_cast<double>(count) + 8;
    }

    // Where it hides the least of the curves, corners first.
    void place_legend() {
        if (legend_.height == 0) return;
        legend_.covered = std::numeric_limits<std::size_t>::max();
        const double w = legend_.width, h = legend_.height;
        for (const double sx : {0.0, 1.0, 0.25, 0.5, 0.75})
            for (const double sy : {0.0, 1.0, 0.25, 0.5, 0.75}) {
                const double cx = x0_ + 6 + sx * (width_ - w - 12), cy = y0_ + 6 + sy * (height_ - h - 12);
                const std::size_t covered = points_in(cx, cy, w, h);
                if (covered < legend_.covered) legend_ = {cx, cy, w, h, covered};
            }
    }

    void legend(const std::vector<std::size_t>& colours) {
        if (legend_.height == 0) return;
        const double x = legend_.x, y = legend_.y, w = legend_.width, h = legend_.height;
        cairo_set_source_rgba(c_, 1, 1, 1, 0.85);
        cairo_rectangle(c_, x, y, w, h);
        cairo_fill(c_);
        double row = y + 4 + 7.5;
        for (std::size_t i = 0; i < panel_.series.size(); ++i) {
            const Series& s = panel_.series[i];
            if (s.label.empty()) continue;
            set_colour(colours[i]);
            if (s.mark != Mark::points) {
                cairo_move_to(c_, x + 6, row);
                cairo_line_to(c_, x + 26, row);
                stroke(s.mark);
            }
            if (s.mark == Mark::points || s.mark == Mark::line_and_points) dot(x + 16, row);
            cairo_set_source_rgb(c_, 0.15, 0.15, 0.15);
            write(s.label, x + 32, row, small_text, 1, 0);
            row += 15;
        }
    }

    // Points of the curves in a rectangle, those between the given ones included.
    std::size_t points_in(double x, double y, double w, double h) const {
        std::size_t count = 0;
        const auto look = [&](double a, double b) { count += a > x && a < x + w && b > y && b < y + h; };
        for (const Series& s : panel_.series) {
            std::optional<double> a, b;
            for (std::size_t i = 0; i < s.x.size(); ++i) {
                const auto before_a = a, before_b = b;
                a = place(s.x[i], x_.is_log), b = place(s.y[i], y_.is_log);
                if (!a || !b) continue;
                look(px(*a), py(*b));
                if (s.mark == Mark::points || !before_a || !before_b) continue;
                for (int k = 1; k < pieces; ++k) {
                    const double t = static_cast<double>(k) / pieces;
                    look(px(*before_a + t * (*a - *before_a)), py(*before_b + t * (*b - *before_b)));
                }
            }
        }
        return count;
    }

    cairo_t* c_;
    const Panel& panel_;
    double x0_, y0_, width_, height_;
    Axis x_, y_;
    Legend legend_;
};

} // namespace

void draw(const std::vector<Panel>& panels, const std::filesystem::path& file) {
    const std::size_t columns = std::clamp<std::size_t>(panels.size(), 1, most_in_row);
    const std::size_t rows = std::max<std::size_t>((panels.size() + columns - 1) / columns, 1);
    Canvas canvas(panel_width * static_cast<double>(columns), panel_height * static_cast<double>(rows), file);
    for (std::size_t i = 0; i < panels.size(); ++i) {
        const std::size_t row = i / columns, column = i % columns;
        PanelPainter(canvas.cairo(), panels[i], panel_width * static_cast<double>(column),
                     panel_height * static_cast<double>(row))
            .paint();
    }
    canvas.write();
}

} // namespace calot::plot
