#include "cases/metrics.hpp"
#include "cases/motion_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <numbers>
#include <sstream>
#include <unistd.h>

namespace calot::cases {

namespace {

simulation::TaskState navigation() {
    simulation::TaskState t;
    t.id = "navigation";
    t.title = "Navigation";
    t.is_required = true;
    return t;
}

const std::vector<MetricDefinition> own = {
    {"offset", "Offset", "m", "How far \"off\", in metres.", "navigation"},
    {"never", "Never", "", "Not observed.", ""},
};

simulation::Command command(std::uint32_t kind, std::string_view id, double value = 0,
                            std::string_view text = {}) {
    simulation::Command c;
    c.kind = kind;
    c.id = id;
    c.value = value;
    c.text = text;
    return c;
}

// The task runs from tick `begin` to tick `end`; `move` fills the snapshot of each tick.
MetricsRecorder measured(std::int64_t begin, std::int64_t end,
                         const std::function<void(std::int64_t, simulation::Snapshot&)>& move) {
    MetricsRecorder recorder({navigation()}, own);
    simulation::Snapshot s;
    move(0, s);
    recorder.began(s);
    for (s.tick = 1; s.tick <= end; ++s.tick) {
        move(s.tick, s);
        if (s.tick == begin) recorder.commanded(s.tick, command(CALOT_COMMAND_TASK_BEGIN, "navigation"));
        if (s.tick == end) {
            recorder.commanded(s.tick, command(CALOT_COMMAND_METRIC, "offset", 0.0025, "navigation"));
            recorder.commanded(s.tick, command(CALOT_COMMAND_TASK_COMPLETE, "navigation"));
        }
        recorder.ticked(s);
    }
    return recorder;
}

void expect_near(const std::map<std::string, double>& values, const std::string& name, double expected,
                 double error) {
    const auto found = values.find("navigation." + name);
    ASSERT_NE(found, values.end()) << name << " is missing";
    EXPECT_NEAR(found->second, expected, error) << name;
}

std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

} // namespace

TEST(Metrics, of_a_steady_push_are_its_speed_and_way) {
    // 20 mm/s for the task's 4 s, after a second in which the filter settles; the tip goes diagonally.
    const auto values = measured(1000, 5000, [](std::int64_t tick, simulation::Snapshot& s) {
                            const double way = 0.02e-3 * static_cast<double>(tick);
                            s.insertion = 0.1 + way;
                            s.camera.position[0] = way / std::sqrt(2.0);
                            s.camera.position[2] = -way / std::sqrt(2.0);
                            s.feedback.insertion_force = tick % 2 == 0 ? 3 : -1;
                            s.feedback.rotation_torque = -0.02;
                            s.tissue_force = tick > 2000 && tick <= 2032 ? 10 : 2;
                        }).values();
    expect_near(values, "completion-time", 4, 1e-12);
    expect_near(values, "path-length", 0.02 * 4, 1e-6);
    expect_near(values, "tip-speed-mean", 0.02, 1e-9);
    expect_near(values, "tip-speed-max", 0.02, 1e-9);
    expect_near(values, "shaft-speed-mean", 0.02, 1e-9);
    expect_near(values, "shaft-speed-max", 0.02, 1e-9);
    expect_near(values, "shaft-acceleration-max", 0, 1e-7);
    expect_near(values, "haptic-force-mean", 2, 1e-3);
    expect_near(values, "haptic-force-max", 2, 1e-9);
    expect_near(values, "haptic-torque-mean", 0.02, 1e-12);
    expect_near(values, "tissue-force-mean", 2 + 8 * 32.0 / 4000, 1e-3);
    expect_near(values, "tissue-force-max", 10, 1e-12);
    expect_near(values, "offset", 0.0025, 0);
    EXPECT_FALSE(values.contains("never"));
}

TEST(Metrics, of_a_shaft_that_swings_follow_the_filter_of_their_definition) {
    // 5 mm at 2 Hz: speed and acceleration are those of the sine, smaller by 1 / (1 + (2 / 10)^2).
    const double w = 2 * std::numbers::pi * 2, gain = 1 / (1 + 0.04);
    const auto values = measured(1000, 5000, [&](std::int64_t tick, simulation::Snapshot& s) {
                            s.insertion = 0.005 * std::sin(w * 1e-3 * static_cast<double>(tick));
                            s.camera.position[1] = s.insertion;
                        }).values();
    expect_near(values, "shaft-speed-max", 0.005 * w * gain, 2e-4);
    expect_near(values, "shaft-speed-mean", 0.005 * w * gain * 2 / std::numbers::pi, 2e-4);
    expect_near(values, "shaft-acceleration-max", 0.005 * w * w * gain, 5e-3);
    expect_near(values, "path-length", 0.005 * gain * 4 * 8, 5e-4);
}

TEST(Metrics, a_still_case_measures_nothing_but_time) {
    const auto values = measured(16, 1016, [](std::int64_t, simulation::Snapshot&) {}).values();
    expect_near(values, "completion-time", 1, 1e-12);
    for (const char* name : {"path-length", "tip-speed-max", "tissue-force-max", "shaft-speed-max",
                             "shaft-acceleration-max", "haptic-force-max", "haptic-torque-max"})
        expect_near(values, name, 0, 0);
}

TEST(MotionFilter, comes_to_rest_at_a_step_without_overshoot) {
    MotionFilter filter;
    filter.start(0);
    double most = 0;
    for (int tick = 0; tick < 1000; ++tick) {
        filter.step(1);
        most = std::max(most, filter.position());
    }
    EXPECT_NEAR(filter.position(), 1, 1e-12);
    EXPECT_LE(most, 1 + 1e-12);
    EXPECT_NEAR(filter.velocity(), 0, 1e-9);
}

TEST(Metrics, are_written_as_one_row_whose_every_column_the_dictionary_explains) {
    const auto recorder =
        measured(16, 1016, [](std::int64_t, simulation::Snapshot& s) { s.tissue_force = 1; });
    CaseHeader header;
    header.procedure = "org.calot.test";
    header.operator_code = "=cmd, \"x\"";
    header.seed = 7;
    simulation::Outcome outcome;
    outcome.ticks = 1016;
    outcome.is_completed = true;
    outcome.end = simulation::End::finished;
    outcome.tasks = recorder.tasks();
    const auto folder =
        std::filesystem::temp_directory_path() / ("calot-metrics-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    write_metrics(folder, header, outcome, recorder);
    const std::string csv = text_of(folder / "metrics.csv"),
                      dictionary = text_of(folder / "metrics-dictionary.csv");
    std::filesystem::remove_all(folder);

    const std::size_t end = csv.find("\r\n");
    ASSERT_NE(end, std::string::npos);
    EXPECT_EQ(csv.find("\r\n", end + 2), csv.size() - 2) << "two lines";
    std::istringstream names(csv.substr(0, end));
    std::string name;
    int columns = 0;
    while (std::getline(names, name, ',')) {
        ++columns;
        EXPECT_EQ(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_"), std::string::npos) << name;
        EXPECT_LE(name.size(), 64u) << name << " is longer than SPSS takes";
        EXPECT_NE(dictionary.find("\r\n" + name + ","), std::string::npos) << name << " is not explained";
    }
    EXPECT_GT(columns, 25);
    EXPECT_NE(csv.find("navigation_tissue_force_mean"), std::string::npos);
    EXPECT_NE(csv.find("\"'=cmd, \"\"x\"\"\""), std::string::npos) << "quoted, and no formula: " << csv;
    EXPECT_NE(csv.find(",,"), std::string::npos) << "what was not observed is empty";
}

TEST(Metrics, as_json_name_tasks_values_and_files) {
    const auto recorder = measured(16, 1016, [](std::int64_t, simulation::Snapshot&) {});
    simulation::Outcome outcome;
    outcome.ticks = 1016;
    outcome.tasks = recorder.tasks();
    const std::string text = to_json({}, outcome, recorder, {"/tmp/a \"b\"\n.csv"});
    EXPECT_NE(text.find("\"tasks\": [{\"id\": \"navigation\", \"name\": \"Navigation\", \"required\": true, "
                        "\"completed\": true, \"seconds\": 1}]"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("\"navigation.offset\": 0.0025"), std::string::npos) << text;
    EXPECT_NE(text.find("\"files\": [\"/tmp/a \\\"b\\\"\\u000a.csv\"]"), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
}

} // namespace calot::cases
