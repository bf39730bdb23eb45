// The adapter from a rod's mechanics to a plugin: what it refuses, converts, takes back and passes on.
#include <calot/rod_model.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <new>
#include <vector>

namespace {

std::size_t allocations = 0;

} // namespace

// Not inlined: seeing both sides, the compiler takes free() for a mistake.
[[gnu::noinline]] void* operator new(std::size_t size) {
    ++allocations;
    if (void* memory = std::malloc(size)) return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}

namespace {

// Nodes that gravity moves in a straight line; beyond 100 m/s2 it overflows.
class Mote {
  public:
    static constexpr std::string_view cost_names[] = {"thought", "motion"};
    static inline calot::RodStep seen;
    static inline std::vector<calot::RodContact> contacts;

    Mote(const calot::RodDescription& d, std::span<const double>) : position_(d.position) {}

    void set_properties(const calot::RodProperties&) {}
    bool step(const calot::RodStep& step) {
        seen = step;
        contacts.assign(step.contacts.begin(), step.contacts.end());
        if (norm(step.gravity) > 100) return false;
        move(step.gravity, step.dt);
        elapsed_ = step.farthest > 0 ? 0.5 * step.dt : step.dt;
        return true;
    }
    double elapsed() const { return elapsed_; }
    calot::Vec3 position(int i) const { return calot::vec3(&position_[static_cast<std::size_t>(3 * i)]); }
    calot::Vec3 velocity(int) const { return {}; }
    calot::Quat frame(int) const { return {}; }
    calot::Vec3 angular_velocity(int) const { return {}; }
    std::span<const calot::Vec3> contact_impulses() const { return {}; }
    calot::Vec3 base_force() const { return {}; }
    calot::Vec3 base_torque() const { return {}; }
    calot::Vec3 tip_force() const { return {}; }
    calot::Vec3 tip_torque() const { return {}; }
    double base_roll() const { return 0; }
    calot::RodEnergies energies() const { return {}; }
    std::size_t state_size() const { return position_.size(); }
    void save(std::span<double> to) const { std::copy(position_.begin(), position_.end(), to.begin()); }
    bool load(std::span<const double> from) {
        position_.assign(from.begin(), from.end());
        return true;
    }
    void measure_costs(bool is_on) { is_measured_ = is_on; }
    double cost(std::size_t part) const { return is_measured_ ? 1.0 + static_cast<double>(part) : 0.0; }

  protected:
    void move(const calot::Vec3& by, double times) {
        for (std::size_t i = 0; i < position_.size(); i += 3)
            calot::store(calot::vec3(&position_[i]) + times * by, &position_[i]);
    }

  private:
    std::vector<double> position_;
    double elapsed_ = 0;
    bool is_measured_ = false;
};

// The same by the contract's input: it moves before it finds out that it overflowed.
class Careless : public Mote {
  public:
    using Mote::Mote;
    static inline int stops = 0;
    void step(const calot_rod_input& in) {
        move(calot::vec3(in.gravity), 1.0);
        is_finite_ = norm(calot::vec3(in.gravity)) <= 100;
    }
    bool is_finite() const { return is_finite_; }
    void stop() { ++stops, is_finite_ = true; }

  private:
    bool is_finite_ = true;
};

struct Scene {
    std::vector<double> position{0, 0, 0, 0, 0, 0.1, 0, 0, 0.2, 0, 0, 0.3}, ones{1, 1, 1},
        radius{0.01, 0.02, 0.03}, shown = std::vector<double>(12);
    calot_rod_setup setup{};
    calot_rod_input input{};
    calot_rod_output output{};
    calot_activation activation{};

    Scene() {
        setup.node_count = 4;
        setup.position = calot::reals(position);
        for (const auto property : calot::detail::contract_rod_properties)
            setup.segments.*property = calot::reals(ones);
        setup.segments.radius = calot::reals(radius);
        output.position = {shown.data(), shown.size()};
        activation.step_nanoseconds = 1'000'000;
        activation.max_contacts = 2;
    }
};

class RodModel : public testing::Test, protected Scene {
  protected:
    template<class Rod>
    void begin(Rod& rod) {
        rod.configure(setup);
        rod.activate(activation);
    }
    calot::CostedRod<Mote> rod_;
};

TEST_F(RodModel, names_the_property_and_the_segment_that_no_model_can_use) {
    const std::vector<double> stiffness{1, 1, 1e-16};
    setup.segments.bending_x = calot::reals(stiffness);
    try {
        rod_.configure(setup);
        FAIL() << "a stiffness of 1e-16 was accepted";
    } catch (const calot::Discard& e) {
        EXPECT_EQ(e.field(), "setup.segments.bending_x[2]");
    }
    setup.segments.bending_x = calot::reals(ones);
    begin(rod_);
    calot_rod_segments segments{};
    segments.torsion = calot::reals(stiffness);
    const calot::Result result = rod_.set_segments(segments);
    EXPECT_EQ(result.status, CALOT_DISCARD);
    EXPECT_STREQ(result.field, "segments.torsion");
}

TEST_F(RodModel, refuses_lengths_and_frames_that_no_model_can_use) {
    const std::vector<double> length{0.1, 1e-10, 0.1}, frame{1, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0};
    setup.length = calot::reals(length);
    EXPECT_THROW(rod_.configure(setup), calot::Discard);
    setup.length = {};
    setup.frame = calot::reals(frame);
    EXPECT_THROW(rod_.configure(setup), calot::Discard);
}

TEST_F(RodModel, a_step_that_is_refused_changes_nothing) {
    begin(rod_);
    input.gravity[1] = 2e9;
    EXPECT_EQ(rod_.step(input, output).status, CALOT_DISCARD);
    input.gravity[1] = 0, input.base.mode = CALOT_END_COUPLED;
    EXPECT_STREQ(rod_.step(input, output).field, "input.base.mode");
    input.base.mode = CALOT_END_FREE, input.duration = 1e-9;
    EXPECT_STREQ(rod_.step(input, output).field, "input.duration");
    ASSERT_TRUE(rod_.read(output));
    EXPECT_EQ(shown, position);
}

TEST_F(RodModel, contacts_are_given_with_the_steps_compliance_and_a_self_contact_between_axes) {
    begin(rod_);
    std::array<calot_contact, 2> list{};
    for (calot_contact& c : list)
        c.normal[1] = 1, c.point[1] = 0.5, c.free_position[1] = 0.6, c.axis_point[1] = 0.7;
    list[0].compliance[4] = 8;
    list[1].flags = CALOT_CONTACT_SELF, list[1].other_segment = 2;
    input.contacts = {list.data(), list.size(), sizeof(calot_contact)};
    input.duration = 0.5e-3;
    ASSERT_TRUE(rod_.step(input, output));
    ASSERT_EQ(Mote::contacts.size(), 2u);
    EXPECT_DOUBLE_EQ(Mote::seen.dt, 0.5e-3);
    EXPECT_DOUBLE_EQ(Mote::contacts[0].compliance[4], 4e-3);
    EXPECT_DOUBLE_EQ(Mote::contacts[0].motion.y, 0.1);
    EXPECT_EQ(Mote::contacts[0].other_segment, -1);
    EXPECT_EQ(Mote::contacts[1].other_segment, 2);
    // The other axis lies a radius behind its surface: 0.5 - 0.03; from there to 0.7.
    EXPECT_DOUBLE_EQ(Mote::contacts[1].centre.y, 0.23);
    EXPECT_EQ(Mote::contacts[1].motion, calot::Vec3{});
}

TEST_F(RodModel, steps_and_new_properties_allocate_nothing) {
    calot::ModelledRod<Careless> careless;
    begin(rod_), begin(careless);
    std::array<calot_contact, 2> list{};
    input.contacts = {list.data(), list.size(), sizeof(calot_contact)};
    calot_rod_segments segments{};
    segments.torsion = calot::reals(ones);
    ASSERT_TRUE(rod_.step(input, output)); // the model's own list grows
    const std::size_t before = allocations;
    bool is_good = true;
    for (int k = 0; k < 3; ++k) {
        input.gravity[0] = 100.0 * k; // the last overflows
        is_good = is_good && rod_.step(input, output) && careless.step(input, output);
        is_good = is_good && rod_.set_segments(segments) && careless.set_segments(segments);
    }
    EXPECT_EQ(allocations, before);
    EXPECT_TRUE(is_good);
}

TEST_F(RodModel, says_how_much_of_a_step_was_taken) {
    begin(rod_);
    ASSERT_TRUE(rod_.step(input, output));
    EXPECT_DOUBLE_EQ(output.elapsed, 1e-3);
    input.farthest = 1e-3;
    ASSERT_TRUE(rod_.step(input, output));
    EXPECT_DOUBLE_EQ(output.elapsed, 0.5e-3);
}

TEST_F(RodModel, takes_an_overflow_back_where_the_model_does_not) {
    calot::ModelledRod<Careless> careless;
    begin(careless);
    Careless::stops = 0;
    input.gravity[1] = 200;
    ASSERT_TRUE(careless.step(input, output));
    EXPECT_EQ(shown, position);
    EXPECT_EQ(Careless::stops, 1);
    input.gravity[1] = 2;
    ASSERT_TRUE(careless.step(input, output));
    EXPECT_EQ(shown[1], 2.0);
    careless.reset(0);
    ASSERT_TRUE(careless.read(output));
    EXPECT_EQ(shown, position);
}

TEST_F(RodModel, costs_are_measured_from_activation_on_where_they_were_asked_for_before) {
    rod_.enable_cost(true);
    EXPECT_EQ(rod_.cost_seconds(1), 0.0) << "there is no rod yet";
    begin(rod_);
    EXPECT_EQ(rod_.cost_part_count(), 2u);
    EXPECT_EQ(rod_.cost_name(1), "motion");
    EXPECT_EQ(rod_.cost_name(2), "");
    EXPECT_EQ(rod_.cost_seconds(1), 2.0);
    rod_.enable_cost(false);
    EXPECT_EQ(rod_.cost_seconds(1), 0.0);
}

TEST_F(RodModel, a_saved_state_holds_the_properties_that_were_set_since) {
    calot::CostedRod<Mote> second;
    begin(rod_), begin(second);
    const std::vector<double> stiffness{3, 4, 5};
    calot_rod_segments segments{};
    segments.bending_y = calot::reals(stiffness);
    ASSERT_TRUE(rod_.set_segments(segments));
    input.gravity[2] = 7;
    ASSERT_TRUE(rod_.step(input, output));
    calot::StateWriter first_state, second_state;
    rod_.save(first_state);
    calot::StateReader reader(first_state.bytes());
    second.load(reader);
    EXPECT_TRUE(reader.at_end());
    second.save(second_state);
    EXPECT_TRUE(std::ranges::equal(first_state.bytes(), second_state.bytes()));
}

} // namespace
