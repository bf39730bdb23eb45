// Charts: curves and points on axes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace calot::plot {

enum class Mark { line, dashed, points, line_and_points };

struct Series {
    std::string label{}; // in the legend; empty: not there
    Mark mark = Mark::line;
    std::vector<double> x{}, y{}; // of one size; where one is not finite the line is broken
    int colour = -1;              // of the palette of eight; -1: the next
};

struct Panel {
    std::string title{}, x_label{}, y_label{};
    bool is_log_x = false, is_log_y = false; // values that are not positive are left out
    bool is_to_scale = false;                // the same length for a unit on both axes: shapes
    std::vector<Series> series{};
};

/// Draws the panels side by side, at most three in a row, and writes `file`, whose name ends in .png or .svg;
/// whole or not at all. Throws host::UserError. [main thread]
void draw(const std::vector<Panel>& panels, const std::filesystem::path& file);
/// The same check of the name, before the work that the picture is to show.
void require_picture_name(const std::filesystem::path& file, const std::string& option);

} // namespace calot::plot
