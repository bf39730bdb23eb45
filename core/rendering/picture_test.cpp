// Facts that must hold in pictures, measured on pixels.
#include "rendering/egl_context.hpp"
#include "rendering/example_scene.hpp"
#include "rendering/linear.hpp"
#include "rendering/renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

namespace calot::rendering {
namespace {

class Picture : public testing::Test {
  protected:
    void SetUp() override {
        limit_software_threads();
        try {
            context_ = std::make_unique<EglContext>();
        } catch (const std::exception& error) {
            GTEST_SKIP() << error.what();
        }
    }

    void start(int width = 640, int height = 320) {
        RendererSettings settings;
        settings.width = width;
        settings.height = height;
        settings.scale = 1;
        renderer_ = std::make_unique<Renderer>(settings);
    }

    Image draw(const FrameState& frame) {
        renderer_->draw(frame);
        Image image;
        renderer_->read(image);
        return image;
    }

    // The pixel at which the endoscope's camera shows a point of the world.
    std::array<int, 2> place(const FrameState& frame, const Vec3& world) const {
        const Eigen::Vector3d local =
            to_matrix(frame.tip.rotation).transpose() * (to_eigen(world) - to_eigen(frame.tip.position));
        double x = 0, y = 0;
        EXPECT_TRUE(project(renderer_->settings().optics, to_plain(local), x, y));
        const Rect mask = renderer_->layout(frame.external.on).mask;
        return {mask.x + static_cast<int>((x + 1) / 2 * mask.width),
                mask.y + static_cast<int>((y + 1) / 2 * mask.height)};
    }

    std::unique_ptr<EglContext> context_; // before the renderer, so that it is destroyed after it
    std::unique_ptr<Renderer> renderer_;
};

double luma(std::span<const std::uint8_t, 4> p) {
    return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

double mean_luma(const Image& image, const Rect& r) {
    double sum = 0;
    for (int y = r.y; y < r.y + r.height; ++y)
        for (int x = r.x; x < r.x + r.width; ++x)
            sum += luma(image.pixel(x, y));
    return sum / (static_cast<double>(r.width) * r.height);
}

Surface ball_of(const char* name, const char* look, const Vec3& centre, double radius) {
    Surface s = ball(name, centre, radius, 24);
    s.appearance = look;
    return s;
}

// A camera at the origin that looks along the world's +z with +y up, so that its frame is the world's.
FrameState plain_frame() {
    FrameState f;
    f.external.on = false;
    return f;
}

// Centre of brightness of a ball in the endoscope's picture, relative to the picture's centre, x right, y
// down.
TEST_F(Picture, what_lies_at_plus_x_appears_on_the_left_and_at_plus_y_at_the_top) {
    struct Case {
        Vec3 centre;
        int x, y; // sign of the expected place
    };
    for (const Case& c : {Case{{0.02, 0, 0.04}, -1, 0},
                          {{-0.02, 0, 0.04}, 1, 0},
                          {{0, 0.02, 0.04}, 0, -1},
                          {{0, -0.02, 0.04}, 0, 1}}) {
        start(320, 320);
        renderer_->add(ball_of("ball", "plain", c.centre, 0.006));
        const Image image = draw(plain_frame());
        double sum = 0, x = 0, y = 0;
        for (int v = 0; v < image.height; ++v)
            for (int u = 0; u < image.width; ++u) {
                const double l = luma(image.pixel(u, v));
                sum += l;
                x += l * (u - 160);
                y += l * (v - 160);
            }
        ASSERT_GT(sum, 0) << "the picture is black";
        x /= sum;
        y /= sum;
        const double expected = std::atan2(0.02, 0.04) * 160 / mask_half_side(Optics{});
        EXPECT_NEAR(x, c.x * expected, 8) << "ball at x = " << c.centre[0] << ", y = " << c.centre[1];
        EXPECT_NEAR(y, c.y * expected, 8) << "ball at x = " << c.centre[0] << ", y = " << c.centre[1];
    }
}

TEST_F(Picture, the_external_view_has_the_same_handedness) {
    start();
    renderer_->add(ball_of("ball", "plain", {0.05, 0, 0.5}, 0.02));
    FrameState f = plain_frame();
    f.tip.position = {0, 0, 3}; // away from it
    f.external.on = true;
    const Image image = draw(f);
    const Rect r = renderer_->layout(true).external;
    const double left = mean_luma(image, {r.x, r.height / 4, r.width / 2, r.height / 2});
    const double right = mean_luma(image, {r.x + r.width / 2, r.height / 4, r.width / 2, r.height / 2});
    EXPECT_GT(left, right + 2) << "a ball at +x must be left of the middle";
}

TEST_F(Picture, the_lens_is_an_equidistant_fisheye) {
    start(400, 400);
    const Optics optics;
    // Small balls 15 degrees apart are equally far apart in the picture.
    std::vector<double> found;
    for (const double degrees : {15.0, 30.0, 45.0}) {
        start(400, 400);
        const double theta = degrees * EIGEN_PI / 180;
        renderer_->add(ball_of("ball", "plain", {-0.04 * std::sin(theta), 0, 0.04 * std::cos(theta)}, 0.002));
        const Image image = draw(plain_frame());
        double sum = 0, x = 0;
        for (int v = 0; v < image.height; ++v)
            for (int u = 0; u < image.width; ++u) {
                const double l = luma(image.pixel(u, v));
                sum += l;
                x += l * (u + 0.5 - 200);
            }
        ASSERT_GT(sum, 0);
        found.push_back(x / sum);
    }
    const double step = 15 * EIGEN_PI / 180 / mask_half_side(optics) * 200;
    for (std::size_t i = 0; i < found.size(); ++i)
        EXPECT_NEAR(found[i], step * static_cast<double>(i + 1), 1.0)
            << "ball at " << 15 * (i + 1) << " degrees";
}

TEST_F(Picture, near_triangles_are_bent_like_the_lens_bends_them) {
    // One large square close to the lens, given as two triangles and as many: the same outline.
    const auto sheet = [](int pieces) {
        Surface s;
        s.name = "sheet";
        s.appearance = "plain";
        for (int j = 0; j <= pieces; ++j)
            for (int i = 0; i <= pieces; ++i)
                s.vertices.push_back({0.004f + 0.012f * static_cast<float>(i) / static_cast<float>(pieces),
                                      -0.008f + 0.016f * static_cast<float>(j) / static_cast<float>(pieces),
                                      0.012f});
        for (int j = 0; j < pieces; ++j)
            for (int i = 0; i < pieces; ++i) {
                const auto at = [&](int a, int b) {
                    return static_cast<std::uint32_t>(b * (pieces + 1) + a);
                };
                s.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
                s.triangles.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
            }
        return s;
    };
    std::array<Image, 2> images;
    for (std::size_t k = 0; k < 2; ++k) {
        start(320, 320);
        renderer_->add(sheet(k == 0 ? 2 : 64));
        images[k] = draw(plain_frame());
    }
    int covered = 0, different = 0;
    for (int v = 0; v < 320; ++v)
        for (int u = 0; u < 320; ++u) {
            const bool a = luma(images[0].pixel(u, v)) > 8, b = luma(images[1].pixel(u, v)) > 8;
            covered += b;
            different += a != b;
        }
    EXPECT_GT(covered, 5000);
    EXPECT_LT(different, covered / 40) << "pixels that only one of the two sheets covers, of " << covered;
}

TEST_F(Picture, the_ring_is_red_where_it_projects_and_the_mask_is_black) {
    start();
    ExampleScene scene = make_example_scene(20000);
    for (const Surface& s : scene.surfaces)
        renderer_->add(s);
    const Image image = draw(scene.frame);
    const RingMarker& ring = scene.frame.rings.front();
    const Eigen::Matrix3d axes = to_matrix(ring.rotation);
    int red = 0;
    for (int i = 0; i < 16; ++i) {
        const double angle = i * EIGEN_PI / 8;
        const Eigen::Vector3d p = to_eigen(ring.centre) + ring.radius * (std::cos(angle) * axes.col(0) +
                                                                         std::sin(angle) * axes.col(1));
        const auto [x, y] = place(scene.frame, to_plain(p));
        const auto pixel = image.pixel(x, y);
        red += pixel[0] > 150 && pixel[0] > 1.8 * pixel[1] && pixel[0] > 1.8 * pixel[2];
    }
    EXPECT_GE(red, 12) << "of 16 places on the ring";
    for (std::size_t i = 3; i < image.rgba.size(); i += 4)
        ASSERT_EQ(image.rgba[i], 255) << "the picture is opaque";
    const Rect mask = renderer_->layout(true).mask;
    for (const int x : {mask.x + 2, mask.x + mask.width - 3})
        for (const int y : {mask.y + 2, mask.y + mask.height - 3})
            EXPECT_EQ(luma(image.pixel(x, y)), 0) << "corner of the mask at " << x << ", " << y;
    const double mean = mean_luma(
        image, {mask.x + mask.width / 4, mask.y + mask.height / 4, mask.width / 2, mask.height / 2});
    EXPECT_GT(mean, 40) << "automatic exposure left the picture dark";
    EXPECT_LT(mean, 215) << "automatic exposure left the picture glaring";
    const double left = mean_luma(image, {0, 0, 320, 320});
    EXPECT_GT(std::abs(left - mean_luma(image, {320, 0, 320, 320})), 5) << "the two views look alike";
}

TEST_F(Picture, light_falls_off_with_distance) {
    start(320, 320);
    // Two balls that look equally large, one three times as far: beside each other in one picture.
    renderer_->add(ball_of("near", "plain", {0.014, 0, 0.03}, 0.006));
    renderer_->add(ball_of("far", "plain", {-0.042, 0, 0.09}, 0.018));
    FrameState f = plain_frame();
    f.light = 0.003; // too dim for the automatic exposure to brighten it to glare
    const Image image = draw(f);
    const auto [nx, ny] = place(f, {0.014, 0, 0.03});
    const auto [fx, fy] = place(f, {-0.042, 0, 0.09});
    const double near = luma(image.pixel(nx, ny)), far = luma(image.pixel(fx, fy));
    EXPECT_GT(far, 3) << "the far ball is lit too";
    EXPECT_GT(near, 2 * far) << "near " << near << ", far " << far;
}

TEST_F(Picture, a_hidden_surface_a_fade_and_a_closed_external_view_do_what_they_say) {
    start();
    const SurfaceId ball_id = renderer_->add(ball_of("ball", "liver", {0, 0, 0.04}, 0.02));
    FrameState f = plain_frame();
    const Rect whole{0, 0, 640, 320};
    EXPECT_GT(mean_luma(draw(f), whole), 5);
    f.surfaces = {{ball_id, Style::Hidden, {}}};
    EXPECT_LT(mean_luma(draw(f), whole), 0.5) << "hidden";
    f.surfaces.clear();
    f.fade = 1;
    EXPECT_EQ(mean_luma(draw(f), whole), 0) << "faded";
    f.fade = 0;
    f.external.on = true;
    EXPECT_GT(mean_luma(draw(f), {0, 0, 320, 40}), 10) << "the external view has a background";
}

TEST_F(Picture, moved_vertices_move_in_the_picture) {
    start(320, 320);
    const Surface s = ball_of("ball", "plain", {0.02, 0, 0.04}, 0.006);
    const SurfaceId id = renderer_->add(s);
    const FrameState f = plain_frame();
    const Rect left{0, 0, 160, 320}, right{160, 0, 160, 320};
    Image image = draw(f);
    EXPECT_GT(mean_luma(image, left), mean_luma(image, right));
    auto moved = s.vertices;
    for (auto& v : moved)
        v[0] -= 0.04f;
    renderer_->update_vertices(id, 0, moved, {});
    image = draw(f);
    EXPECT_LT(mean_luma(image, left), mean_luma(image, right));
    EXPECT_THROW(renderer_->update_vertices(id, 1, moved, {}), std::out_of_range);
}

TEST_F(Picture, a_surface_that_cannot_be_drawn_is_refused_by_name) {
    start();
    Surface s = ball_of("odd", "plain", {0, 0, 0.04}, 0.006);
    s.triangles.front()[1] = static_cast<std::uint32_t>(s.vertices.size());
    EXPECT_THROW(renderer_->add(s), std::invalid_argument);
    s = ball_of("odd", "marzipan", {0, 0, 0.04}, 0.006);
    try {
        renderer_->add(s);
        FAIL() << "an unknown appearance was taken";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("marzipan"), std::string::npos) << error.what();
    }
}

} // namespace
} // namespace calot::rendering
