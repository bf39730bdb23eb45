// What a user can put right: one line with file, field and remedy, and exit code 2.
#include "program.hpp"

namespace fs = std::filesystem;
using calot_test::Result;

class UserError : public calot_test::ProgramTest {
  protected:
    void expect(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) {
        const Result result = calot(arguments);
        EXPECT_EQ(result.exit_code, 2) << result.out << result.err;
        EXPECT_EQ(result.messages().size(), 1u) << "not one line: " << result.err;
        for (const std::string& part : parts)
            EXPECT_NE(result.err.find(part), std::string::npos) << "lacks \"" << part << "\": " << result.err;
        EXPECT_FALSE(fs::exists(scratch / "case")) << "no case was begun, so it must leave no folder";
    }
    /// A copy of the shipped datasheet.
    fs::path datasheet() {
        const fs::path file = scratch / "scope.toml";
        fs::copy_file(scratch / "assets/endoscopes/gif-2t160.toml", file);
        return file;
    }
};

TEST_F(UserError, manifest_with_a_wrong_version) {
    const fs::path folder = copy_plugin("good/test-models");
    rewrite(folder / "plugin.toml", "major = 0", "major = 7");
    expect(run_test_case(), {(folder / "plugin.toml").string() + ": contract.major: ", "7.", "; rebuild"});
}

TEST_F(UserError, missing_library) {
    const fs::path folder = copy_plugin("good/test-models");
    fs::remove(folder / "test-models.so");
    expect(run_test_case(), {(folder / "plugin.toml").string() + ": library: ", "; build or install"});
}

TEST_F(UserError, library_that_aborts_while_it_is_loaded) {
    environment["CALOT_PLUGIN_PATH"] += ":" + plugins("bad").string();
    expect(run_test_case({"--device", "org.calot.test.bad-abort"}),
           {"test-bad-abort.so: ", "crashes while it is loaded: Aborted", "; repair"});
}

TEST_F(UserError, truncated_mesh) {
    const fs::path mesh = scratch / "assets/anatomy/reference/stone.obj";
    fs::resize_file(mesh, fs::file_size(mesh) - 9);
    expect(run_test_case(), {mesh.string() + ": "});
}

TEST_F(UserError, truncated_mesh_in_place_of_an_organs) {
    const fs::path mesh = scratch / "mine.obj";
    fs::copy_file(scratch / "assets/anatomy/reference/stone.obj", mesh);
    fs::resize_file(mesh, fs::file_size(mesh) - 9);
    expect(run_test_case({"--anatomy", "stone=" + mesh.string()}), {mesh.string() + ": "});
    expect(run_test_case({"--anatomy", "kidney=" + mesh.string()}), {"--anatomy: kidney: is no organ of "});
}

TEST_F(UserError, datasheet_with_a_negative_stiffness) {
    const fs::path file = datasheet();
    rewrite(file, "flexural_rigidity = 0.033", "flexural_rigidity = -0.033");
    expect(run_test_case({"--endoscope", file.string()}),
           {file.string() + ": segment[0].flexural_rigidity: ", "; "});
}

TEST_F(UserError, datasheet_with_an_unknown_key) {
    const fs::path file = datasheet();
    rewrite(file, "outer_radius = 0.0063", "outer_radius = 0.0063\nouter_diameter = 0.0126");
    expect(run_test_case({"--endoscope", file.string()}), {file.string() + ": ", "outer_diameter", "; "});
}

TEST_F(UserError, instrument_for_a_channel_that_is_not_there_or_too_narrow) {
    expect(run_test_case({"--instrument", "3=forceps"}), {"--instrument: 3: is no channel of ", "it has 2"});
    expect(run_test_case({"--instrument", "forceps"}), {"--instrument: forceps: must be CHANNEL=NAME"});
    expect(run_test_case({"--instrument", "1=spoon"}), {"spoon: is neither a file nor one of "});
    const fs::path thick = scratch / "thick.toml";
    fs::copy_file(scratch / "assets/instruments/forceps.toml", thick);
    rewrite(thick, "diameter = 0.0023", "diameter = 0.0033");
    expect(run_test_case({"--instrument", "1=" + thick.string()}),
           {"is thicker than channel 1 of ", "; choose"});
}

TEST_F(UserError, bench_test_with_a_bad_row) {
    const fs::path table = scratch / "bench.csv";
    fs::copy_file(scratch / "assets/endoscopes/example-bench.csv", table);
    rewrite(table, "0.0048,0.937", "0.0048,0.937kg");
    const fs::path out = scratch / "mine.toml";
    expect({"fit", "endoscope", table.string(), "--out", out.string()},
           {table.string() + ": line 6: force: is \"0.937kg\"; "});
    EXPECT_FALSE(fs::exists(out)) << "nothing is written";
    expect({"fit", "endoscope", (scratch / "none.csv").string()}, {"none.csv: "});
}

TEST_F(UserError, datasheet_that_is_not_there) {
    expect(run_test_case({"--endoscope", "/nowhere/scope.toml"}), {"/nowhere/scope.toml: "});
}

TEST_F(UserError, unknown_procedure_rod_device_task_pose_and_anatomy) {
    expect({"run", "org.example.none", "--headless", "--device", "org.calot.test.device"},
           {"org.example.none: no procedure has this id; ", "calot why org.example.none"});
    expect(run_test_case({"--rod", "org.calot.test.device"}), {"is a device, a rod is needed; "});
    expect(run_test_case({"--device", "org.example.none"}), {"no device has this id"});
    expect(run_test_case({"--until", "dance"}), {"--until: ", "dance", "push"});
    expect(run_test_case({"--pose", "upside-down"}), {"upside-down"});
    expect(run_test_case({"--anatomy", "martian"}), {"martian"});
}

TEST_F(UserError, no_device_without_a_window_and_no_window_without_a_display) {
    expect({"run", "org.calot.test.procedure", "--headless"},
           {"--device: is needed", "org.calot.test.device"});
    expect({"run", "org.calot.test.procedure", "--device", "org.calot.test.device", "--rod",
            "org.calot.test.rod", "--out", (scratch / "case").string()},
           {"--headless: ", "DISPLAY"});
}

TEST_F(UserError, video_that_cannot_be_written) {
    expect(run_test_case({"--video", "/nowhere/case.mp4"}), {"/nowhere/case.mp4", "cannot be written"});
}

TEST_F(UserError, record_that_is_none) {
    expect({"replay", (scratch / "assets/anatomy/reference/stone.obj").string()}, {"stone.obj: "});
    expect({"replay", "/nowhere"}, {"/nowhere"});
}
