#include "plot/beads.hpp"

#include "plot/canvas.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace calot::plot {

namespace {

constexpr double width = 900, margin = 24, title_height = 30, legend_height = 34;

// The two directions in which points spread most, and the one towards the viewer.
struct View {
    Vec3 along, up, towards, centre;
};

View view_of(const std::vector<Vec3>& points) {
    View view;
    for (const Vec3& p : points)
        view.centre += (1.0 / static_cast<double>(points.size())) * p;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Vec3& p : points) {
        const Eigen::Vector3d d(p.x - view.centre.x, p.y - view.centre.y, p.z - view.centre.z);
        spread += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread); // smallest first
    const auto axis = [&](int k) {
        const Eigen::Vector3d v = solver.eigenvectors().col(k);
        return Vec3{v.x(), v.y(), v.z()};
    };
    view.along = axis(2), view.up = axis(1);
    // From the mouth on the left to the blind end on the right.
    if (!points.empty() && dot(points.back() - points.front(), view.along) < 0) view.along = -view.along;
    view.towards = cross(view.along, view.up);
    return view;
}

class Painter {
  public:
    Painter(const Vessel& vessel, const std::vector<BeadString>& strings)
        : vessel_(vessel), view_(view_of(vessel.axis)) {
        low_[0] = low_[1] = 1e300, high_[0] = high_[1] = -1e300;
        const auto cover = [&](const Vec3& p, double r) {
            const std::array<double, 2> at{dot(p - view_.centre, view_.along),
                                           dot(p - view_.centre, view_.up)};
            for (std::size_t k = 0; k < 2; ++k)
                low_[k] = std::min(low_[k], at[k] - r), high_[k] = std::max(high_[k], at[k] + r);
        };
        for (const Vec3& p : vessel.axis)
            cover(p, vessel.radius);
        // What is still outside the vessel is shown for an eighth of its extent.
        const double shown = low_[0] - 0.125 * (high_[0] - low_[0]);
        for (const BeadString& s : strings)
            for (const Bead& b : s.beads)
                if (dot(b.centre - view_.centre, view_.along) > shown) cover(b.centre, s.radius);
        low_[0] = std::max(low_[0], shown);
        scale_ = (width - 2 * margin) / (high_[0] - low_[0]);
    }

    double height() const { return title_height + scale_ * (high_[1] - low_[1]) + margin; }

    void paint(cairo_t* c, const BeadString& string, double top) {
        c_ = c, top_ = top + title_height;
        cairo_set_source_rgb(c_, 0.15, 0.15, 0.15);
        cairo_select_font_face(c_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
        cairo_set_font_size(c_, 14);
        cairo_move_to(c_, margin, top + 20);
        cairo_show_text(c_, string.title.c_str());
        cairo_save(c_);
        cairo_rectangle(c_, margin, top_, width - 2 * margin, height() - title_height);
        cairo_clip(c_);
        tube();
        std::vector<const Bead*> order;
        for (const Bead& b : string.beads)
            order.push_back(&b);
        std::stable_sort(order.begin(), order.end(), [&](const Bead* a, const Bead* b) {
            return dot(a->centre, view_.towards) < dot(b->centre, view_.towards);
        });
        for (const Bead* b : order)
            bead(px(b->centre), py(b->centre), scale_ * string.radius, b->is_touching);
        cairo_restore(c_);
    }

    void legend(cairo_t* c, double top) {
        c_ = c;
        cairo_select_font_face(c_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
        cairo_set_font_size(c_, 12);
        const double y = top + 0.5 * legend_height;
        double x = margin + 6;
        for (const bool is_touching : {true, false}) {
            bead(x, y, 6, is_touching);
            cairo_set_source_rgb(c_, 0.15, 0.15, 0.15);
            cairo_move_to(c_, x + 12, y + 4);
            cairo_show_text(c_, is_touching ? "touches the wall" : "does not");
            x += 150;
        }
        // A bar of 1, 2 or 5 times a power of ten, near a tenth of the width.
        const double wanted = 0.15 * width / scale_, power = std::pow(10.0, std::floor(std::log10(wanted)));
        const double bar = power * (wanted >= 5 * power ? 5 : wanted >= 2 * power ? 2 : 1);
        char text[40];
        std::snprintf(text, sizeof text, "%g mm", 1e3 * bar);
        const double right = width - margin, left = right - bar * scale_;
        cairo_set_source_rgb(c_, 0.15, 0.15, 0.15);
        cairo_set_line_width(c_, 2);
        cairo_move_to(c_, left, y);
        cairo_line_to(c_, right, y);
        cairo_stroke(c_);
        cairo_text_extents_t e;
        cairo_text_extents(c_, text, &e);
        cairo_move_to(c_, left - e.x_advance - 8, y + 4);
        cairo_show_text(c_, text);
    }

  private:
    double px(const Vec3& p) const {
        return margin + scale_ * (dot(p - view_.centre, view_.along) - low_[0]);
    }
    double py(const Vec3& p) const { return top_ + scale_ * (high_[1] - dot(p - view_.centre, view_.up)); }

    // The axis, stroked ever narrower and lighter: a glassy tube with a dark outline.
    void tube() {
        cairo_set_line_join(c_, CAIRO_LINE_JOIN_ROUND);
        cairo_set_line_cap(c_, CAIRO_LINE_CAP_BUTT);
        constexpr std::array<std::array<double, 4>, 5> coats{{{1.00, 0.62, 0.45, 0.45},
                                                              {0.97, 0.90, 0.78, 0.76},
                                                              {0.85, 0.94, 0.85, 0.83},
                                                              {0.65, 0.97, 0.90, 0.89},
                                                              {0.35, 0.98, 0.94, 0.93}}};
        for (const auto& [share, red, green, blue] : coats) {
            for (std::size_t i = 0; i < vessel_.axis.size(); ++i) {
                const Vec3& p = vessel_.axis[i];
                i == 0 ? cairo_move_to(c_, px(p), py(p)) : cairo_line_to(c_, px(p), py(p));
            }
            cairo_set_source_rgb(c_, red, green, blue);
            cairo_set_line_width(c_, 2 * share * scale_ * vessel_.radius);
            cairo_stroke(c_);
        }
    }

    void bead(double x, double y, double radius, bool is_touching) {
        cairo_pattern_t* light =
            cairo_pattern_create_radial(x - 0.35 * radius, y - 0.35 * radius, 0.1 * radius, x, y, radius);
        if (is_touching) {
            cairo_pattern_add_color_stop_rgb(light, 0, 0.72, 0.98, 0.66);
            cairo_pattern_add_color_stop_rgb(light, 0.5, 0.20, 0.72, 0.22);
            cairo_pattern_add_color_stop_rgb(light, 1, 0.04, 0.36, 0.08);
        } else {
            cairo_pattern_add_color_stop_rgb(light, 0, 1.0, 0.70, 0.64);
            cairo_pattern_add_color_stop_rgb(light, 0.5, 0.86, 0.18, 0.14);
            cairo_pattern_add_color_stop_rgb(light, 1, 0.45, 0.04, 0.04);
        }
        cairo_set_source(c_, light);
        cairo_arc(c_, x, y, radius, 0, 2 * std::numbers::pi);
        cairo_fill(c_);
        cairo_pattern_destroy(light);
    }

    const Vessel& vessel_;
    View view_;
    std::array<double, 2> low_, high_; // m, along and up
    double scale_ = 1, top_ = 0;       // units for a metre
    cairo_t* c_ = nullptr;
};

} // namespace

void draw(const Vessel& vessel, const std::vector<BeadString>& strings, const std::filesystem::path& file) {
    Painter painter(vessel, strings);
    const double all = painter.height() * static_cast<double>(strings.size());
    Canvas canvas(width, all + legend_height, file);
    for (std::size_t i = 0; i < strings.size(); ++i)
        painter.paint(canvas.cairo(), strings[i], painter.height() * static_cast<double>(i));
    painter.legend(canvas.cairo(), all);
    canvas.write();
}

} // namespace calot::plot
