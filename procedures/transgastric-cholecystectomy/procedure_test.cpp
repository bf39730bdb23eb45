#include "procedure.hpp"

#include <calot/plugin.hpp>

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

namespace calot::transgastric {
namespace {

// A shaft along -y through (or beside) a ring of 9 mm radius at y = -0.1, driven through the contract as the
// host does it. The tip's place is given as its height above the ring's plane.
class Case {
  public:
    explicit Case(bool has_incision = true) : has_incision_(has_incision) {
        host_.struct_size = sizeof host_;
        host_.service = [](const calot_host*, calot_string id) -> const void* {
            static const calot_assets assets{
                sizeof(calot_assets), nullptr,
                [](void*, calot_string path, calot_bytes* out, calot_error*) -> calot_status {
                    static std::string text;
                    std::ifstream file(CALOT_SOURCE_DIR "/procedures/transgastric-cholecystectomy/" +
                                       std::string(view(path)));
                    text.assign(std::istreambuf_iterator<char>(file), {});
                    *out = {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
                    return file ? CALOT_OK : CALOT_ERROR;
                }};
            return view(id) == CALOT_SERVICE_ASSETS ? &assets : nullptr;
        };
        exported_.create(exported_, &host_, instance_);
        procedure_ = static_cast<const calot_procedure*>(instance_.kind);
        error_.struct_size = sizeof error_;
        EXPECT_EQ(instance_.init(instance_.self, &error_), CALOT_OK) << error_.message;
        place(-0.2);
        setup_.struct_size = sizeof setup_;
        setup_.shaft_radius = 0.0063, setup_.shaft_length = 1.03;
        setup_.node_count = nodes;
        setup_.start = &snapshot_;
        activation_.struct_size = sizeof activation_;
        activation_.step_nanoseconds = 16'000'000;
        queue_.struct_size = sizeof queue_;
        queue_.self = this;
        queue_.push = [](void* self, const calot_command* command) {
            return static_cast<Case*>(self)->take(*command);
        };
    }
    ~Case() { instance_.destroy(instance_.self); }

    calot_status configure() { return procedure_->configure(instance_.self, &setup_, &error_); }
    void begin() {
        ASSERT_EQ(configure(), CALOT_OK) << error_.message;
        ASSERT_EQ(instance_.activate(instance_.self, &activation_, &error_), CALOT_OK);
    }
    // Straight shaft along -y, its axis `aside` from the ring's centre.
    void place(double height, double aside = 0) {
        centreline_.clear();
        for (std::size_t i = 0; i < nodes; ++i) {
            const double back = 0.01 * static_cast<double>(nodes - 1 - i);
            centreline_.insert(centreline_.end(), {aside, -0.1 - height + back, 0});
        }
        snapshot_.struct_size = sizeof snapshot_;
        snapshot_.self = this;
        snapshot_.tip = calot::pose({aside, -0.1 - height, 0}, {});
        snapshot_.centreline = calot::reals(centreline_);
        snapshot_.pose = [](void*, calot_string, calot_pose*) -> std::uint32_t { return 0; };
        snapshot_.organ = [](void*, calot_string) -> std::uint32_t { return UINT32_MAX; };
        snapshot_.quantity = [](void*, calot_string, double*) -> std::uint32_t { return 0; };
        snapshot_.landmark = [](void* self, calot_string id, calot_marker* out) -> std::uint32_t {
            static const std::vector<double> path = {0, 0.3, 0, 0, -0.1, 0};
            static const std::vector<double> oesophagus = {0, 0.3, 0, 0, 0, 0};
            if (view(id) == "path")
                out->polyline = calot::reals(path);
            else if (view(id) == "oesophagus")
                out->polyline = calot::reals(oesophagus);
            else if (view(id) == "viscerotomy" && static_cast<Case*>(self)->has_incision_) {
                out->position[0] = 0, out->position[1] = -0.1, out->position[2] = 0;
                out->normal[0] = 0, out->normal[1] = -1, out->normal[2] = 0;
                out->radius = 0.009;
            } else
                return 0;
            return 1;
        };
    }
    // Updates for so long, as often as the host does.
    void wait(double seconds) {
        for (int i = 0; i < static_cast<int>(seconds / 0.016); ++i) {
            snapshot_.tick += 16;
            ASSERT_EQ(procedure_->update(instance_.self, &snapshot_, &queue_, &error_), CALOT_OK)
                << error_.message;
        }
    }
    calot_status take(const calot_command& c) {
        if (room == 0) return CALOT_ERROR;
        --room;
        switch (c.kind) {
        case CALOT_COMMAND_TASK_BEGIN:
            begun.emplace_back(view(c.id));
            break;
        case CALOT_COMMAND_TASK_COMPLETE:
            completed.emplace_back(view(c.id));
            break;
        case CALOT_COMMAND_METRIC:
            metrics[std::string(view(c.id))] = c.value;
            break;
        case CALOT_COMMAND_MARKER_SET:
            markers[std::string(view(c.marker->id))] = c.marker->is_done != 0;
            break;
        case CALOT_COMMAND_FINISH:
            ++finished;
            break;
        default:
            break;
        }
        return CALOT_OK;
    }

    std::vector<std::string> begun, completed;
    std::map<std::string, double> metrics;
    std::map<std::string, bool> markers;
    int finished = 0;
    int room = 1'000'000;
    calot_error& error() { return error_; }
    const calot_procedure& functions() const { return *procedure_; }
    void* self() const { return instance_.self; }

  private:
    static constexpr std::size_t nodes = 50;
    bool has_incision_;
    Export exported_ =
        export_procedure<TransgastricCholecystectomy>("org.calot.transgastric-cholecystectomy", "", "0");
    calot_host host_{};
    calot_instance instance_{};
    calot_error error_{};
    const calot_procedure* procedure_ = nullptr;
    std::vector<double> centreline_;
    calot_snapshot snapshot_{};
    calot_procedure_setup setup_{};
    calot_activation activation_{};
    calot_commands queue_{};
};

const std::vector<std::string> navigation_only = {"navigation"};

TEST(Transgastric, passing_through_the_ring_completes_the_task_with_its_metrics) {
    Case c;
    c.begin();
    c.wait(1);
    EXPECT_EQ(c.begun, navigation_only);
    EXPECT_EQ(c.markers, (std::map<std::string, bool>{{"way", false}, {"viscerotomy", false}}));
    c.place(-0.05);
    c.wait(1);
    c.place(0.01, 0.002);
    c.wait(1);
    EXPECT_TRUE(c.completed.empty()) << "10 mm beyond the ring is too little";
    c.place(0.05, 0.002);
    c.wait(1);
    EXPECT_EQ(c.completed, navigation_only);
    EXPECT_EQ(c.finished, 1);
    EXPECT_TRUE(c.markers["viscerotomy"]) << "the ring is not dimmed";
    EXPECT_EQ(c.metrics.size(), 4u);
    EXPECT_NEAR(c.metrics["time-to-stomach"], 1, 0.05);
    EXPECT_NEAR(c.metrics["time-to-incision"], 1, 0.05);
    EXPECT_NEAR(c.metrics["path-deviation"], 0, 2e-4);
    EXPECT_NEAR(c.metrics["incision-offset"], 0.002, 1e-9);
    c.wait(5);
    EXPECT_EQ(c.completed.size(), 1u);
}

TEST(Transgastric, every_metric_that_is_given_is_declared_with_a_definition) {
    Case c;
    c.begin();
    c.place(-0.05), c.wait(0.5), c.place(0.05), c.wait(1);
    std::map<std::string, std::string> declared;
    for (std::uint32_t i = 0; i < c.functions().metric_count(c.self()); ++i) {
        calot_metric m{};
        m.struct_size = sizeof m;
        ASSERT_EQ(c.functions().metric(c.self(), i, &m, nullptr), CALOT_OK);
        EXPECT_FALSE(view(m.definition).empty());
        EXPECT_FALSE(view(m.unit).empty());
        declared[std::string(view(m.id))] = view(m.unit);
    }
    EXPECT_EQ(c.metrics.size(), declared.size());
    for (const auto& [id, value] : c.metrics)
        EXPECT_TRUE(declared.contains(id)) << id;
}

TEST(Transgastric, waiting_never_completes_it) {
    Case c;
    c.begin();
    c.wait(120);
    EXPECT_TRUE(c.completed.empty());
    EXPECT_TRUE(c.metrics.empty());
}

TEST(Transgastric, a_shaft_beside_the_ring_has_not_passed_it) {
    Case c;
    c.begin();
    c.place(0.06, 0.0095);
    c.wait(3);
    EXPECT_TRUE(c.completed.empty());
    c.place(0.06, 0.0085);
    c.wait(3);
    EXPECT_EQ(c.completed, navigation_only);
}

TEST(Transgastric, slipping_back_before_half_a_second_does_not_count) {
    Case c;
    c.begin();
    for (int i = 0; i < 5; ++i) {
        c.place(0.06), c.wait(0.4);
        c.place(0.03), c.wait(0.1);
    }
    EXPECT_TRUE(c.completed.empty());
}

TEST(Transgastric, a_full_queue_is_tried_again) {
    Case c;
    c.begin();
    c.room = 2;
    c.wait(1);
    EXPECT_EQ(c.markers.size(), 1u);
    c.room = 1'000'000;
    c.wait(0.1);
    EXPECT_EQ(c.begun, navigation_only);
    EXPECT_EQ(c.markers.size(), 2u);
    c.place(0.06);
    c.room = 0;
    c.wait(1);
    c.room = 1'000'000;
    c.wait(0.1);
    EXPECT_EQ(c.completed, navigation_only);
}

TEST(Transgastric, an_anatomy_without_the_incision_is_refused_by_name) {
    Case c(false);
    EXPECT_EQ(c.configure(), CALOT_ERROR);
    EXPECT_STREQ(c.error().field, "scene.viscerotomy");
}

TEST(Transgastric, the_scene_is_the_asset) {
    Case c;
    std::string text;
    calot_sink sink{sizeof sink, &text, [](void* self, calot_bytes b) -> calot_status {
                        static_cast<std::string*>(self)->append(reinterpret_cast<const char*>(b.data),
                                                                b.size);
                        return CALOT_OK;
                    }};
    EXPECT_EQ(c.functions().scene(c.self(), &sink, nullptr), CALOT_OK);
    EXPECT_NE(text.find("[marker.viscerotomy]"), std::string::npos);
}

} // namespace
} // namespace calot::transgastric
