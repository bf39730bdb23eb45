#include "virtual_operator.hpp"

#include <calot/plugin.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace calot::virtual_operator {
namespace {

constexpr double degree = 3.14159265358979323846 / 180;

// A stiff shaft that slides along +z through a fixed entry, with a bending section of 90 mm at its end that
// bends into an arc at once: enough to close the loop around the operator, with none of the real rod's
// mechanics.
struct Model {
    double blocked_at = 1e9; // m: the shaft goes no farther

    calot_pose view(const calot_controls& c) const {
        constexpr double length = 0.09;
        const double up = c.wheel[0], left = c.wheel[1], bend = std::hypot(up, left);
        const Quat shaft = axis_angle({0, 0, 1}, c.rotation);
        Vec3 tip{0, 0, length};
        Quat turn;
        if (bend > 1e-9) {
            const Vec3 aside{left / bend, up / bend, 0};
            tip = length / bend * ((1 - std::cos(bend)) * aside + std::sin(bend) * Vec3{0, 0, 1});
            turn = axis_angle({-up / bend, left / bend, 0}, bend);
        }
        const double out = std::min(c.insertion, blocked_at) - length;
        return pose(Vec3{0, 0, out} + rotate(shaft, tip), shaft * turn);
    }
};

// Straight for 160 mm, then bending towards a ring of 9 mm radius.
struct Scene {
    Vec3 ring{0.020, 0.040, 0.260};
    Vec3 normal = normalized(Vec3{0.35, 0.70, 0.60});
    std::vector<double> path;

    Scene() {
        for (int i = 0; i <= 16; ++i)
            path.insert(path.end(), {0, 0, 0.01 * i});
        const Vec3 from{0, 0, 0.16}, to = ring + 0.018 * normal;
        for (int i = 1; i <= 12; ++i) { // Hermite curve
            const double t = i / 12.0, u = 1 - t;
            const Vec3 p = u * u * (1 + 2 * t) * from + t * t * (3 - 2 * t) * to +
                           0.12 * (t * u * u * Vec3{0, 0, 1} - t * t * u * normal);
            path.insert(path.end(), {p.x, p.y, p.z});
        }
    }
};

const calot_random& generator() {
    // Any well mixed counter-based generator will do for a test (SplitMix64's finaliser).
    static const auto mix = [](std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
        std::uint64_t z = seed * 0x9e3779b97f4a7c15ull + stream * 0xd1b54a32d192ed03ull + counter;
        for (int i = 0; i < 2; ++i) {
            z += 0x9e3779b97f4a7c15ull;
            z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
            z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
            z ^= z >> 31;
        }
        return z;
    };
    static const calot_random service{
        sizeof(calot_random), nullptr,
        [](void*, std::uint64_t s, std::uint64_t t, std::uint64_t c) { return mix(s, t, c); },
        [](void*, std::uint64_t s, std::uint64_t t, std::uint64_t c) {
            return static_cast<double>(mix(s, t, c) >> 11) * 0x1p-53;
        },
        [](void*, std::uint64_t s, std::uint64_t t, std::uint64_t c) {
            double sum = -6; // of twelve uniform numbers: mean 0, deviation 1
            for (std::uint64_t i = 0; i < 12; ++i)
                sum += static_cast<double>(mix(s, t + 1000 * i, c) >> 11) * 0x1p-53;
            return sum;
        }};
    return service;
}

class Session {
  public:
    explicit Session(std::uint64_t seed, std::string skill = "expert") : skill_(std::move(skill)) {
        current_skill() = &skill_;
        host_.struct_size = sizeof host_;
        host_.service = [](const calot_host*, calot_string id) -> const void* {
            static const calot_settings settings{
                sizeof(calot_settings), nullptr,
                [](void*, calot_string key, calot_string* out) -> std::uint32_t {
                    if (view(key) != "operator.skill") return 0;
                    *out = string(*current_skill());
                    return 1;
                }};
            if (view(id) == CALOT_SERVICE_RANDOM) return &generator();
            return view(id) == CALOT_SERVICE_SETTINGS ? &settings : nullptr;
        };
        exported_.create(exported_, &host_, instance_);
        device_ = static_cast<const calot_device*>(instance_.kind);
        watch_ = static_cast<const calot_device_observation*>(
            instance_.extension(instance_.self, string(CALOT_EXTENSION_OBSERVATION)));
        error_.struct_size = sizeof error_;
        status = instance_.init(instance_.self, &error_);
        if (status != CALOT_OK) return;
        controls = resting_controls();
        controls.insertion = 0.12;
        controls.wheel[0] = 0.1, controls.wheel[1] = -0.08;
        controls.rotation = 0.3;
        device_->configure(instance_.self, &controls, &error_);
        calot_activation activation{};
        activation.struct_size = sizeof activation;
        activation.step_nanoseconds = 1'000'000;
        activation.seed = seed;
        instance_.activate(instance_.self, &activation, &error_);
    }
    ~Session() { instance_.destroy(instance_.self); }

    void tick() {
        calot_marker markers[2]{};
        for (auto& m : markers)
            m.struct_size = sizeof m;
        markers[0].kind = CALOT_MARKER_PATH;
        markers[0].polyline = reals(scene.path);
        markers[1].kind = CALOT_MARKER_RING;
        store(scene.ring, markers[1].position), store(scene.normal, markers[1].normal);
        markers[1].radius = 0.009;
        calot_observation o{};
        o.struct_size = sizeof o;
        o.tick = tick_;
        o.view = model.view(controls);
        o.task = string(task);
        if (shows_markers) o.markers = structs<calot_marker>(markers);
        o.felt.struct_size = sizeof o.felt;
        o.felt.insertion_force = felt_force;
        ASSERT_EQ(watch_->observe(instance_.self, &o, &error_), CALOT_OK) << error_.message;
        const calot_controls before = controls;
        ASSERT_EQ(device_->poll(instance_.self, tick_++, &controls, &error_), CALOT_OK);
        fastest_push = std::max(fastest_push, std::abs(controls.insertion - before.insertion) / 0.001);
        fastest_turn = std::max(fastest_turn, std::abs(controls.rotation - before.rotation) / 0.001);
        for (int i = 0; i < 2; ++i)
            fastest_wheel = std::max(fastest_wheel, std::abs(controls.wheel[i] - before.wheel[i]) / 0.001);
        least_insertion = std::min(least_insertion, controls.insertion);
        follow_tip();
    }
    void run(double seconds) {
        for (int i = 0; i < 1000 * seconds && !is_done(); ++i)
            tick();
    }
    bool is_done() const { return height >= 0.045; }

    std::vector<std::uint8_t> save() {
        std::vector<std::uint8_t> bytes;
        calot_sink sink{sizeof sink, &bytes, [](void* self, calot_bytes b) -> calot_status {
                            auto& all = *static_cast<std::vector<std::uint8_t>*>(self);
                            all.insert(all.end(), b.data, b.data + b.size);
                            return CALOT_OK;
                        }};
        EXPECT_EQ(instance_.save_state(instance_.self, &sink, &error_), CALOT_OK);
        return bytes;
    }
    void load(const std::vector<std::uint8_t>& bytes) {
        std::span<const std::uint8_t> rest(bytes);
        calot_source source{sizeof source, &rest, [](void* self, calot_bytes_out out) -> std::uint64_t {
                                auto& left = *static_cast<std::span<const std::uint8_t>*>(self);
                                const std::size_t n = std::min<std::size_t>(left.size(), out.size);
                                std::copy_n(left.begin(), n, out.data);
                                left = left.subspan(n);
                                return n;
                            }};
        EXPECT_EQ(instance_.load_state(instance_.self, &source, &error_), CALOT_OK) << error_.message;
    }

    Model model;
    Scene scene;
    std::string task = "navigation";
    bool shows_markers = true;
    double felt_force = 0;
    calot_status status = CALOT_OK;
    calot_controls controls{};
    double height = -1;   // m, of the tip above the ring's plane
    double crossing = -1; // m, from the ring's centre when the tip first crossed its plane
    double fastest_push = 0, fastest_turn = 0, fastest_wheel = 0, least_insertion = 1;
    std::int64_t tick_ = 0;
    const calot_error& error() const { return error_; }

  private:
    static const std::string*& current_skill() {
        static const std::string* skill = nullptr;
        return skill;
    }
    void follow_tip() {
        const Vec3 tip = vec3(model.view(controls).position) - scene.ring;
        height = dot(tip, scene.normal);
        if (height > 0 && crossing < 0) crossing = norm(tip - height * scene.normal);
    }

    std::string skill_;
    Export exported_ = export_device<VirtualOperator>("org.calot.virtual-operator", "", "0");
    calot_host host_{};
    calot_instance instance_{};
    calot_error error_{};
    const calot_device* device_ = nullptr;
    const calot_device_observation* watch_ = nullptr;
};

TEST(Pilot, bearings_are_positive_up_and_left_as_the_screen_shows_them) {
    const calot_pose view = pose({0, 0, 0}, {});
    EXPECT_NEAR(bearing(view, {0, 1, 1})[0], 45 * degree, 1e-12);
    EXPECT_NEAR(bearing(view, {1, 0, 1})[1], 45 * degree, 1e-12);
    EXPECT_NEAR(bearing(view, {0, -1, -1})[0], -135 * degree, 1e-12) << "behind, below";
}

TEST(Pilot, a_point_on_a_line_is_found_by_its_arc_length_and_beyond_its_end) {
    const std::vector<Vec3> line = {{0, 0, 0}, {0, 0, 1}, {0, 2, 1}};
    EXPECT_EQ(length(line), 3);
    EXPECT_EQ(point_at(line, 0.5), (Vec3{0, 0, 0.5}));
    EXPECT_EQ(point_at(line, 2), (Vec3{0, 1, 1}));
    EXPECT_EQ(point_at(line, 4), (Vec3{0, 3, 1}));
}

class Skilled : public testing::TestWithParam<const char*> {};

TEST_P(Skilled, operators_of_many_seeds_pass_through_the_ring) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Session session(seed, GetParam());
        session.run(90);
        EXPECT_TRUE(session.is_done())
            << "seed " << seed << ": the tip is " << session.height << " m above the ring";
        EXPECT_LT(session.crossing, 0.009) << "seed " << seed << ": beside the ring";
        EXPECT_GE(session.crossing, 0) << "seed " << seed;
    }
}

TEST_P(Skilled, hands_stay_humane) {
    Session session(3, GetParam());
    session.run(90);
    EXPECT_LT(session.fastest_push, 0.3);
    EXPECT_LT(session.fastest_turn, 360 * degree);
    EXPECT_LT(session.fastest_wheel, 180 * degree);
}

INSTANTIATE_TEST_SUITE_P(Operator, Skilled, testing::Values("expert", "novice"),
                         [](const auto& info) { return std::string(info.param); });

TEST(Operator, a_novice_is_slower_than_an_expert) {
    Session expert(1), novice(1, "novice");
    expert.run(90), novice.run(90);
    EXPECT_GT(novice.tick_, expert.tick_);
}

TEST(Operator, the_same_seed_gives_the_same_hands_and_another_seed_others) {
    Session first(7), again(7), other(8);
    for (Session* s : {&first, &again, &other})
        s->run(3);
    EXPECT_EQ(first.controls.insertion, again.controls.insertion);
    EXPECT_EQ(first.controls.wheel[0], again.controls.wheel[0]);
    EXPECT_NE(first.controls.wheel[0], other.controls.wheel[0]);
}

TEST(Operator, holds_still_without_a_task_or_without_anything_to_go_by) {
    Session idle(1), blind(1);
    idle.task.clear();
    blind.shows_markers = false;
    for (Session* s : {&idle, &blind}) {
        const double begin = s->controls.insertion;
        s->run(5);
        EXPECT_NEAR(s->controls.insertion, begin, 0.002) << "more than tremor";
    }
}

TEST(Operator, does_not_push_against_a_force_that_hurts) {
    Session session(1);
    session.felt_force = 25;
    session.run(1.5);
    EXPECT_LT(session.controls.insertion, 0.1215);
}

TEST(Operator, draws_back_when_there_is_no_way_on) {
    Session session(1);
    session.model.blocked_at = 0.15;
    session.run(6);
    const double pushed = session.controls.insertion;
    session.least_insertion = pushed;
    session.run(6);
    EXPECT_LT(session.least_insertion, pushed - 0.01) << "never drew back";
}

TEST(Operator, a_skill_that_does_not_exist_is_refused_by_name) {
    Session session(1, "wizard");
    EXPECT_EQ(session.status, CALOT_ERROR);
    EXPECT_STREQ(session.error().field, "operator.skill");
}

TEST(Operator, goes_on_bit_for_bit_from_a_saved_state) {
    Session first(5), second(5);
    first.run(2.345);
    second.load(first.save());
    second.controls = first.controls, second.tick_ = first.tick_;
    first.run(2), second.run(2);
    EXPECT_EQ(first.controls.insertion, second.controls.insertion);
    EXPECT_EQ(first.controls.wheel[1], second.controls.wheel[1]);
    EXPECT_EQ(first.save(), second.save());
}

} // namespace
} // namespace calot::virtual_operator
