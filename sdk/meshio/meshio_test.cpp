#include <calot/meshio/check.hpp>
#include <calot/meshio/read.hpp>
#include <calot/meshio/sha256.hpp>
#include <calot/meshio/write.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

namespace {

using namespace calot::meshio;

/// A cube of side `size` around `centre`, outward-oriented: the top two triangles are region 1.
TriangleMesh cube(double size = 0.02, Vec3 centre = {0.01, 0.02, 0.03}) {
    TriangleMesh m;
    m.name = "cube";
    for (int i = 0; i < 8; ++i)
        m.vertices.push_back({centre[0] + size * ((i & 1) - 0.5), centre[1] + size * (((i >> 1) & 1) - 0.5),
                              centre[2] + size * (((i >> 2) & 1) - 0.5)});
    m.triangles = {{0, 2, 1}, {1, 2, 3}, {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                   {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}, {4, 5, 6}, {5, 7, 6}};
    m.region = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1};
    m.region_names = {"side", "top"};
    return m;
}

class Files : public testing::Test {
  protected:
    void SetUp() override {
        folder_ =
            std::filesystem::temp_directory_path() /
            ("calot-meshio-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) +
             std::to_string(std::random_device{}()));
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::filesystem::path write(const std::string& name, const std::string& bytes) const {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
        return folder_ / name;
    }
    /// The one line that reading the file fails with; empty when it can be read.
    static std::string complaint(const std::filesystem::path& file, const ReadOptions& options = {}) {
        try {
            read_mesh(file, options);
        } catch (const MeshError& error) {
            return error.what();
        }
        return {};
    }
    std::filesystem::path folder_;
};

TEST(Sha256, agrees_with_the_published_examples) {
    EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(sha256(std::string(1'000'000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Check, measures_a_cube) {
    const MeshReport r = check(cube());
    EXPECT_EQ(r.problem(), "");
    EXPECT_EQ(r.components, 1u);
    EXPECT_NEAR(r.volume, 8e-6, 1e-18);
    EXPECT_NEAR(r.area, 6 * 4e-4, 1e-15);
    EXPECT_NEAR(r.minimum[2], 0.02, 1e-15);
    EXPECT_NEAR(r.maximum[1], 0.03, 1e-15);
}

TEST(Check, finds_a_hole_a_flipped_triangle_and_an_inverted_solid) {
    TriangleMesh hole = cube();
    hole.triangles.pop_back();
    EXPECT_EQ(check(hole).boundary_edges, 3u);
    EXPECT_NE(check(hole).problem().find("not closed"), std::string::npos);

    TriangleMesh flipped = cube();
    std::swap(flipped.triangles[3][0], flipped.triangles[3][1]);
    EXPECT_EQ(check(flipped).misoriented_edges, 3u);

    TriangleMesh inverted = cube();
    for (auto& t : inverted.triangles)
        std::swap(t[0], t[1]);
    EXPECT_EQ(check(inverted).inverted_components, 1u);
}

TEST(Check, finds_two_cubes_that_touch_in_a_vertex_or_an_edge) {
    const auto joined = [](Vec3 shift) {
        TriangleMesh both = cube(), other = cube(0.02, {0.01 + shift[0], 0.02 + shift[1], 0.03 + shift[2]});
        for (auto& p : other.vertices)
            for (int i = 0; i < 3; ++i) // onto the first cube's corners, to the bit
                for (const auto& q : both.vertices)
                    if (std::abs(p[i] - q[i]) < 1e-9) p[i] = q[i];
        for (auto t : other.triangles)
            both.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
        both.vertices.insert(both.vertices.end(), other.vertices.begin(), other.vertices.end());
        both.region.clear();
        weld(both);
        return check(both);
    };
    EXPECT_EQ(joined({0.02, 0.02, 0.02}).non_manifold_vertices, 1u);
    EXPECT_EQ(joined({0.02, 0.02, 0.0}).non_manifold_edges, 1u);
    EXPECT_EQ(joined({0.05, 0.0, 0.0}).problem(), "");
}

TEST(Check, wants_a_cavity_to_face_inwards) {
    TriangleMesh shell = cube(0.04), cavity = cube(0.02);
    shell.region.clear();
    for (auto t : cavity.triangles)
        shell.triangles.push_back({t[1] + 8, t[0] + 8, t[2] + 8});
    shell.vertices.insert(shell.vertices.end(), cavity.vertices.begin(), cavity.vertices.end());
    EXPECT_EQ(check(shell).problem(), "");
    EXPECT_NEAR(check(shell).volume, 64e-6 - 8e-6, 1e-15);
    for (std::size_t t = 12; t < 24; ++t)
        std::swap(shell.triangles[t][0], shell.triangles[t][1]);
    EXPECT_EQ(check(shell).inverted_components, 1u);
}

TEST_F(Files, a_mesh_written_as_glb_is_read_back_with_its_regions_and_frame) {
    TriangleMesh m = cube();
    m.colours.assign(8, Colour{255, 128, 0, 255});
    write_glb(folder_ / "cube.glb", m);
    const TriangleMesh back = read_mesh(folder_ / "cube.glb");
    EXPECT_EQ(check(back).problem(), "");
    ASSERT_EQ(back.triangles.size(), 12u);
    ASSERT_EQ(back.vertices.size(), 8u);
    EXPECT_EQ(back.region_names, (std::vector<std::string>{"side", "top"}));
    const MeshReport a = check(m), b = check(back);
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(a.minimum[i], b.minimum[i], 1e-8) << "axis " << i;
        EXPECT_NEAR(a.maximum[i], b.maximum[i], 1e-8) << "axis " << i;
    }
    for (std::size_t t = 0; t < 12; ++t)
        for (const auto v : back.triangles[t]) {
            if (back.region[t] == 1) {
                EXPECT_NEAR(back.vertices[v][2], 0.04, 1e-8) << "region 'top' is the superior face";
            }
        }
    ASSERT_EQ(back.colours.size(), 8u);
    EXPECT_EQ(back.colours[0], (Colour{255, 128, 0, 255}));
    EXPECT_EQ(to_glb(m), to_glb(m));
}

TEST_F(Files, the_extras_of_a_glb_are_read_back) {
    GlbOptions options;
    options.extras = {{"description_sha256", "00ff"}, {"quoted", "a \"b\" \\ c"}};
    write_glb(folder_ / "cube.glb", cube(), options);
    EXPECT_EQ(read_glb_extras(folder_ / "cube.glb"), options.extras);
    write_glb(folder_ / "plain.glb", cube());
    EXPECT_TRUE(read_glb_extras(folder_ / "plain.glb").empty());
}

TEST_F(Files, every_truncation_of_a_glb_gives_one_clear_line) {
    const std::string whole = to_glb(cube());
    for (std::size_t size = 0; size < whole.size(); size += 7) {
        const auto file = write("cut.glb", whole.substr(0, size));
        const std::string line = complaint(file);
        ASSERT_NE(line, "") << "cut at " << size;
        EXPECT_EQ(line.find('\n'), std::string::npos);
        EXPECT_EQ(line.rfind(file.string() + ": ", 0), 0u) << line;
    }
}

TEST_F(Files, a_broken_glb_is_refused_or_read_but_never_crashes) {
    const std::string whole = to_glb(cube());
    std::mt19937 random(7);
    int refused = 0;
    for (int i = 0; i < 400; ++i) {
        std::string broken = whole;
        for (int k = 0; k < 3; ++k)
            broken[20 + random() % (broken.size() - 20)] = static_cast<char>(random());
        const auto file = write("broken.glb", broken);
        try {
            const TriangleMesh m = read_mesh(file);
            for (const auto& p : m.vertices)
                ASSERT_TRUE(std::isfinite(p[0] + p[1] + p[2]));
            check(m);
        } catch (const MeshError& error) {
            ++refused;
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
    EXPECT_GT(refused, 50);
}

TEST_F(Files, obj_stl_and_ply_of_a_cube_in_millimetres_give_the_same_solid) {
    const TriangleMesh m = cube();
    std::string obj, stl(84, '\0'),
        ply = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
              "property float z\nelement face 12\nproperty list uchar int vertex_indices\n"
              "end_header\n";
    const auto text = [](double v) { return std::to_string(1000 * v) + " "; };
    for (const auto& p : m.vertices) {
        obj += "v " + text(p[0]) + text(p[1]) + text(p[2]) + "\n";
        ply += text(p[0]) + text(p[1]) + text(p[2]) + "\n";
    }
    const std::uint32_t count = 12;
    std::memcpy(stl.data() + 80, &count, 4);
    for (const auto& t : m.triangles) {
        obj += "f";
        ply += "3";
        float facet[12] = {};
        for (int k = 0; k < 3; ++k) {
            obj += " " + std::to_string(t[k] + 1);
            ply += " " + std::to_string(t[k]);
            for (int i = 0; i < 3; ++i)
                facet[3 + 3 * k + i] = static_cast<float>(1000 * m.vertices[t[k]][i]);
        }
        obj += "\n", ply += "\n";
        stl.append(reinterpret_cast<const char*>(facet), sizeof facet);
        stl.append(2, '\0');
    }
    for (const auto& [name, bytes] : {std::pair{"a.obj", obj}, {"a.stl", stl}, {"a.ply", ply}}) {
        ReadOptions millimetres;
        millimetres.scale = 0.001;
        const TriangleMesh back = read_mesh(write(name, bytes), millimetres);
        const MeshReport r = check(back);
        EXPECT_EQ(r.problem(), "") << name;
        EXPECT_EQ(r.vertices, 8u) << name;
        EXPECT_NEAR(r.volume, 8e-6, 1e-11) << name;
    }
    EXPECT_NE(complaint(write("cut.ply", ply.substr(0, ply.size() - 20))), "");
    EXPECT_NE(complaint(write("cut.stl", stl.substr(0, 300))), "");
}

TEST_F(Files, a_ply_in_either_byte_order_is_read_and_broken_ones_are_refused) {
    const TriangleMesh m = cube();
    const auto binary = [&](bool big) {
        std::string out =
            std::string("ply\nformat binary_") + (big ? "big" : "little") +
            "_endian 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n"
            "property uchar red\nelement face 12\nproperty list uchar uint vertex_indices\nend_header\n";
        const auto put = [&](const auto& v) {
            std::string raw(reinterpret_cast<const char*>(&v), sizeof v);
            if (big) std::reverse(raw.begin(), raw.end());
            out += raw;
        };
        for (const auto& p : m.vertices) {
            put(p[0]), put(p[1]), put(p[2]);
            out += 'r';
        }
        for (const auto& t : m.triangles) {
            out += '\3';
            put(t[0]), put(t[1]), put(t[2]);
        }
        return out;
    };
    for (const bool big : {false, true})
        EXPECT_NEAR(check(read_mesh(write("c.ply", binary(big)))).volume, 8e-6, 1e-15)
            << "big-endian: " << big;
    const std::string whole = binary(false);
    std::mt19937 random(3);
    int refused = 0;
    for (int i = 0; i < 600; ++i) {
        std::string broken = whole.substr(0, 1 + random() % whole.size());
        broken[random() % broken.size()] = static_cast<char>(random());
        refused += !complaint(write("broken.ply", broken)).empty();
    }
    EXPECT_GT(refused, 500);
    EXPECT_NE(complaint(write("huge.ply", "ply\nformat ascii 1.0\nelement vertex 99999999\nproperty float x\n"
                                          "property float y\nproperty float z\nend_header\n"))
                  .find("more than"),
              std::string::npos);
}

TEST_F(Files, values_that_are_not_finite_and_unknown_kinds_are_refused) {
    EXPECT_NE(complaint(write("nan.ply",
                              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                              "property float z\nelement face 1\nproperty list uchar int vertex_index\n"
                              "end_header\nnan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"))
                  .find("not finite"),
              std::string::npos);
    EXPECT_NE(complaint(write("a.step", "x")).find("unknown kind"), std::string::npos);
    EXPECT_NE(complaint(folder_ / "absent.glb").find("no such file"), std::string::npos);
    EXPECT_NE(complaint(folder_ / "absent.glb").find("absent.glb"), std::string::npos);
}

} // namespace
