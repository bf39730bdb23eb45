#include "rendering/picture_shapes.hpp"

#include "rendering/optics.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace calot::rendering {
namespace {

struct FlatVertex {
    std::array<float, 2> position;
    std::array<float, 4> colour;
};

using Point = std::array<double, 2>;

// The mask's outline: an octagon within the square -1..1 with rounded corners, counter-clockwise.
std::vector<Point> mask_outline(double shrink) {
    const double c = kMaskCorner;
    const std::array<Point, 8> corner{
        {{1, -c}, {1, c}, {c, 1}, {-c, 1}, {-1, c}, {-1, -c}, {-c, -1}, {c, -1}}};
    constexpr double kRounding = 0.10; // along both edges of a corner
    constexpr int kPieces = 6;
    std::vector<Point> out;
    for (std::size_t i = 0; i < corner.size(); ++i) {
        const Point &p = corner[i], &before = corner[(i + 7) % 8], &after = corner[(i + 1) % 8];
        const auto towards = [&](const Point& q) {
            const double length = std::hypot(q[0] - p[0], q[1] - p[1]);
            return Point{p[0] + (q[0] - p[0]) / length * kRounding,
                         p[1] + (q[1] - p[1]) / length * kRounding};
        };
        const Point a = towards(before), b = towards(after);
        for (int k = 0; k <= kPieces; ++k) { // quadratic Bezier curve
            const double t = static_cast<double>(k) / kPieces, u = 1 - t;
            out.push_back({u * u * a[0] + 2 * u * t * p[0] + t * t * b[0],
                           u * u * a[1] + 2 * u * t * p[1] + t * t * b[1]});
        }
    }
    for (Point& q : out)
        q = {q[0] * shrink, q[1] * shrink};
    return out;
}

void strip(std::vector<FlatVertex>& out, const std::vector<Point>& inner, const std::vector<Point>& outer,
           const std::array<float, 4>& in, const std::array<float, 4>& on) {
    const auto vertex = [](const Point& p, const std::array<float, 4>& c) {
        return FlatVertex{{static_cast<float>(p[0]), static_cast<float>(p[1])}, c};
    };
    for (std::size_t i = 0; i < inner.size(); ++i) {
        const std::size_t j = (i + 1) % inner.size();
        for (const FlatVertex& v : {vertex(inner[i], in), vertex(outer[i], on), vertex(outer[j], on),
                                    vertex(inner[i], in), vertex(outer[j], on), vertex(inner[j], in)})
            out.push_back(v);
    }
}

} // namespace

PictureShapes::PictureShapes() : array_(make_vertex_array()), vertices_(make_buffer()) {
    std::vector<FlatVertex> v;
    const auto begin = [&](Part& part) { part.first = static_cast<int>(v.size()); };
    const auto end = [&](Part& part) { part.count = static_cast<int>(v.size()) - part.first; };
    const std::array<float, 4> black{0, 0, 0, 1}, clear{0, 0, 0, 0};

    begin(surround_);
    const std::vector<Point> outline = mask_outline(0.998);
    std::vector<Point> square;
    square.reserve(outline.size());
    for (const Point& p : outline) { // the nearest point of a larger square, radially
        const double scale = 1.45 / std::max(std::abs(p[0]), std::abs(p[1]));
        square.push_back({p[0] * scale, p[1] * scale});
    }
    strip(v, outline, square, black, black);
    end(surround_);

    begin(edge_);
    strip(v, mask_outline(0.978), mask_outline(0.9985), clear, black);
    end(edge_);

    begin(background_);
    const std::array<float, 4> low{0.085f, 0.105f, 0.125f, 1}, high{0.270f, 0.310f, 0.345f, 1};
    for (const auto& [x, y, c] : {std::tuple{-1.f, -1.f, low},
                                  {1.f, -1.f, low},
                                  {1.f, 1.f, high},
                                  {-1.f, -1.f, low},
                                  {1.f, 1.f, high},
                                  {-1.f, 1.f, high}})
        v.push_back({{x, y}, c});
    end(background_);

    begin(fade_);
    for (const auto& [x, y] :
         {std::pair{-1.f, -1.f}, {1.f, -1.f}, {1.f, 1.f}, {-1.f, -1.f}, {1.f, 1.f}, {-1.f, 1.f}})
        v.push_back({{x, y}, black});
    end(fade_);

    glBindVertexArray(*array_);
    glBindBuffer(GL_ARRAY_BUFFER, *vertices_);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(v.size() * sizeof(FlatVertex)), v.data(),
                 GL_STATIC_DRAW);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, sizeof(FlatVertex), nullptr);
    glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, sizeof(FlatVertex),
                          reinterpret_cast<const void*>(sizeof(float) * 2));
    glEnableVertexAttribArray(0);
    glEnableVertexAttribArray(1);
    glBindVertexArray(0);
}

void PictureShapes::draw_mask(const Program& flat) const {
    flat.use();
    flat.set("u_depth", -0.9999f);
    flat.set("u_scale", 1.0f, 1.0f);
    glBindVertexArray(*array_);
    glDrawArrays(GL_TRIANGLES, surround_.first, surround_.count);
}

void PictureShapes::draw_mask_edge(const Program& flat) const {
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
    flat.use();
    flat.set("u_scale", 1.0f, 1.0f);
    glBindVertexArray(*array_);
    glDrawArrays(GL_TRIANGLES, edge_.first, edge_.count);
    glDisable(GL_BLEND);
    glEnable(GL_DEPTH_TEST);
}

void PictureShapes::draw_background(const Program& flat) const {
    glDisable(GL_DEPTH_TEST);
    flat.use();
    flat.set("u_scale", 1.0f, 1.0f);
    glBindVertexArray(*array_);
    glDrawArrays(GL_TRIANGLES, background_.first, background_.count);
}

void PictureShapes::draw_fade(const Program& flat, float amount) const {
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendColor(0, 0, 0, amount);
    glBlendFuncSeparate(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA, GL_ZERO, GL_ONE);
    flat.use();
    flat.set("u_scale", 1.0f, 1.0f);
    glBindVertexArray(*array_);
    glDrawArrays(GL_TRIANGLES, fade_.first, fade_.count);
    glDisable(GL_BLEND);
}

} // namespace calot::rendering
