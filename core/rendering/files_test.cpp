// Optics, tables, PNG and video: what needs no graphics.
#include "rendering/appearance.hpp"
#include "rendering/optics.hpp"
#include "rendering/png.hpp"
#include "rendering/sweep.hpp"
#include "rendering/video_writer.hpp"

#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <png.h>
#include <unistd.h>

namespace calot::rendering {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
  protected:
    Files() : folder_(fs::temp_directory_path() / ("calot-files-test-" + std::to_string(getpid()))) {
        fs::create_directories(folder_);
    }
    ~Files() override { fs::remove_all(folder_); }
    fs::path folder_;
};

Image stripes(int width, int height, int shift) {
    Image image;
    image.width = width;
    image.height = height;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto v = static_cast<std::uint8_t>((x + shift) / 8 % 2 * 255);
            image.rgba.insert(image.rgba.end(), {v, static_cast<std::uint8_t>(y), 40, 255});
        }
    return image;
}

TEST(Optics, the_radius_has_the_angle_as_its_inverse) {
    Optics o;
    o.k = {-0.03, 0.004, 0, 0};
    check(o);
    for (int i = 0; 0.1 * i < o.field_of_view / 2; ++i)
        EXPECT_NEAR(fisheye_angle(o, fisheye_radius(o, 0.1 * i)), 0.1 * i, 1e-12);
}

TEST(Optics, a_radius_that_turns_back_is_refused) {
    Optics o;
    o.k = {-0.4, 0, 0, 0};
    EXPECT_THROW(check(o), std::invalid_argument);
    o.k = {NAN, 0, 0, 0};
    EXPECT_THROW(check(o), std::invalid_argument);
    o = Optics{};
    o.field_of_view = 0;
    EXPECT_THROW(check(o), std::invalid_argument);
}

TEST(LookAt, axes_are_left_up_forward) {
    const Pose pose = look_at({1, 2, 3}, {1, 2, 8}, {0, 1, 0}); // along +z with +y up: the world's own frame
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(std::abs(pose.rotation[i]), i == 0 ? 1 : 0, 1e-12);
}

TEST(Sweep, a_curve_passes_through_its_points_and_does_not_twist) {
    std::vector<Vec3> points;
    for (int i = 0; i <= 20; ++i)
        points.push_back({0.05 * std::cos(i * 0.15), 0.05 * std::sin(i * 0.15), 0});
    const auto curve = smooth_curve(points, {}, 0.002);
    ASSERT_GT(curve.size(), points.size());
    EXPECT_NEAR(curve.back().arc, 0.05 * 3.0, 0.0005) << "length of an arc of 3 rad";
    // In a plane curve the transported x keeps its angle to the plane.
    for (const auto& c : curve)
        EXPECT_NEAR(c.x.z(), curve.front().x.z(), 1e-3);
    EXPECT_TRUE(smooth_curve({{0, 0, 0}, {0, 0, 0}}, {}, 0.01).empty());
}

TEST_F(Files, the_shipped_table_of_tissues_is_readable_and_a_broken_one_is_refused_by_field) {
    const fs::path shipped = fs::path(CALOT_SOURCE_DIR) / "assets/shaders/appearance.toml";
    const auto table = read_appearances(shipped);
    EXPECT_NO_THROW(find_appearance(table, "mucosa-stomach"));
    EXPECT_THROW(find_appearance(table, "nothing"), std::invalid_argument);
    std::ifstream in(shipped);
    const std::string good{std::istreambuf_iterator<char>(in), {}};
    for (const auto& [from, to, field] : {std::array<std::string, 3>{"soft = 0.45", "soft = 7", "soft"},
                                          {"mottle = 0.5", "motley = 0.5", "mottle"},
                                          {"albedo = [0.78", "albedo = [nan", "albedo"},
                                          {"wet = 0.55", "wet = 0.55\nshine = 1", "shine"}}) {
        std::string bad = good;
        const auto at = bad.find(from);
        ASSERT_NE(at, std::string::npos) << from;
        bad.replace(at, from.size(), to);
        const fs::path file = folder_ / "appearance.toml";
        std::ofstream(file) << bad;
        try {
            read_appearances(file);
            ADD_FAILURE() << "taken: " << to;
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
        }
    }
}

TEST(Appearances, every_shipped_anatomy_names_only_looks_that_exist) {
    const auto table = read_appearances(fs::path(CALOT_SOURCE_DIR) / "assets/shaders/appearance.toml");
    int looks = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(CALOT_SOURCE_DIR) / "assets/anatomy")) {
        const fs::path file = entry.path() / "anatomy.toml";
        if (!fs::exists(file)) continue;
        const toml::table anatomy = toml::parse_file(file.string());
        const toml::array* organs = anatomy["organ"].as_array();
        ASSERT_TRUE(organs) << file;
        for (const toml::node& organ : *organs) {
            const toml::node_view look = organ.as_table()->operator[]("appearance");
            std::vector<std::string> names;
            if (const toml::table* regions = look.as_table())
                for (const auto& [region, name] : *regions)
                    names.push_back(name.value_or(std::string()));
            else
                names.push_back(look.value_or(std::string()));
            for (const std::string& name : names)
                EXPECT_NO_THROW(find_appearance(table, name)) << file << ": " << name;
            looks += static_cast<int>(names.size());
        }
    }
    EXPECT_GT(looks, 0);
}

TEST_F(Files, a_png_holds_the_pixels_that_were_written) {
    const Image image = stripes(37, 21, 0);
    const fs::path file = folder_ / "a.png";
    write_png(file, image);
    png_image read{};
    read.version = PNG_IMAGE_VERSION;
    ASSERT_TRUE(png_image_begin_read_from_file(&read, file.c_str())) << read.message;
    read.format = PNG_FORMAT_RGBA;
    std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(read));
    ASSERT_TRUE(png_image_finish_read(&read, nullptr, pixels.data(), 0, nullptr)) << read.message;
    EXPECT_EQ(read.width, 37u);
    EXPECT_EQ(read.height, 21u);
    EXPECT_EQ(pixels, image.rgba);
    EXPECT_THROW(write_png(folder_ / "no/such/folder.png", image), std::runtime_error);
}

// Reads back the number of frames through ffmpeg's own decoder.
int decoded_frames(const fs::path& video, const fs::path& scratch) {
    const std::string command =
        "ffmpeg -v error -i '" + video.string() + "' -f framecrc '" + scratch.string() + "'";
    if (std::system(command.c_str()) != 0) return -1;
    std::ifstream in(scratch);
    int count = 0;
    for (std::string line; std::getline(in, line);)
        count += !line.empty() && line.front() != '#';
    return count;
}

bool has_ffmpeg() {
    return std::system("ffmpeg -version > /dev/null 2>&1") == 0;
}

TEST_F(Files, a_video_has_as_many_frames_as_were_written_also_with_an_odd_size) {
    if (!has_ffmpeg()) GTEST_SKIP() << "the program ffmpeg is not installed";
    VideoWriter video(folder_ / "a b'c.mp4", 161, 91, 30);
    for (int i = 0; i < 45; ++i)
        video.write(stripes(161, 91, i));
    EXPECT_THROW(video.write(stripes(64, 64, 0)), std::invalid_argument);
    video.finish();
    fs::rename(video.file(), folder_ / "a.mp4");
    EXPECT_EQ(decoded_frames(folder_ / "a.mp4", folder_ / "crc"), 45);
    EXPECT_THROW(video.write(stripes(161, 91, 0)), std::runtime_error);
}

TEST_F(Files, a_video_that_cannot_be_made_says_why) {
    EXPECT_THROW(VideoWriter(folder_ / "no/such/folder.mp4", 64, 64, 30), std::runtime_error);
    EXPECT_THROW(VideoWriter(folder_ / "a.mp4", 64, 64, 0), std::runtime_error);
    const char* found = std::getenv("PATH");
    const std::string path = found != nullptr ? found : "";
    setenv("PATH", folder_.c_str(), 1);
    std::string said;
    try {
        VideoWriter video(folder_ / "a.mp4", 64, 64, 30);
    } catch (const std::runtime_error& error) {
        said = error.what();
    }
    setenv("PATH", path.c_str(), 1);
    EXPECT_NE(said.find("install the package ffmpeg"), std::string::npos) << said;
}

TEST_F(Files, an_encoder_that_dies_is_an_error_and_not_a_signal) {
    // A program of that name that ends at once.
    const fs::path fake = folder_ / "ffmpeg";
    std::ofstream(fake) << "#!/bin/sh\necho 'no such encoder' >&2\nexit 3\n";
    fs::permissions(fake, fs::perms::owner_all);
    const char* found = std::getenv("PATH");
    const std::string path = found != nullptr ? found : "";
    setenv("PATH", (folder_.string() + ":" + path).c_str(), 1);
    VideoWriter video(folder_ / "a.mp4", 640, 360, 30);
    setenv("PATH", path.c_str(), 1);
    std::string said;
    try {
        for (int i = 0; i < 50; ++i)
            video.write(stripes(640, 360, i)); // more than a pipe holds
    } catch (const std::runtime_error& error) {
        said = error.what();
    }
    EXPECT_NE(said.find("no such encoder"), std::string::npos) << said;
}

} // namespace
} // namespace calot::rendering
