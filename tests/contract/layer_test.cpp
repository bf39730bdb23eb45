// The adapters of the C++ layer: order of life, checks of inputs, exceptions, states.
#include <calot/plugin.hpp>

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

// Remembers what it was given; throws where it is told to.
class Recorder final : public calot::Rod {
  public:
    static inline std::string fail_in;
    static inline int steps = 0;

    void init() override { maybe("init"); }
    void configure(const calot_rod_setup& setup) override {
        maybe("configure");
        value_.assign(setup.node_count, 1.0);
    }
    void activate(const calot_activation&) override { maybe("activate"); }
    void reset(std::uint64_t seed) override { value_.assign(value_.size(), static_cast<double>(seed)); }
    void save(calot::StateWriter& to) const override { to.values(value_); }
    void load(calot::StateReader& from) override {
        from.values(value_);
        if (value_[0] < 0) throw std::runtime_error("negative");
    }
    std::span<const calot::Parameter> parameters() const override {
        static constexpr calot::Parameter table[] = {{"gain", "Gain", "", 0, 2, 1, false},
                                                     {"substeps", "Substeps", "", 1, 8, 4, true}};
        return table;
    }
    calot::Result set_segments(const calot_rod_segments&) override { return calot::Result::ok(); }
    calot::Result step(const calot_rod_input&, calot_rod_output&) override {
        maybe("step");
        ++steps;
        for (double& v : value_)
            v += 1;
        return fail_in == "result" ? calot::Result::discard(CALOT_CODE_OUT_OF_RANGE, "input.tick", "is odd")
                                   : calot::Result::ok();
    }
    calot::Result read(calot_rod_output&) override { return calot::Result::ok(); }

  private:
    static void maybe(const char* function) {
        if (fail_in == function)
            throw calot::Error(CALOT_CODE_MISSING_ASSET, function, "was told to fail: größer");
    }
    std::vector<double> value_;
};

class Layer : public testing::Test {
  protected:
    Layer() {
        Recorder::fail_in.clear();
        Recorder::steps = 0;
        error_.struct_size = sizeof error_;
        host_.struct_size = sizeof host_;
        host_.abi_major = CALOT_ABI_MAJOR, host_.abi_minor = CALOT_ABI_MINOR;
        host_.abi_fingerprint = CALOT_ABI_FINGERPRINT;
        host_.service = [](const calot_host*, calot_string) -> const void* { return nullptr; };
        instance_.struct_size = sizeof instance_;
        static const calot::Export exports[] = {calot::export_rod<Recorder>("org.test.rod", "Rod", "1.0.0")};
        static calot::detail::Library library(exports);
        calot_library out{};
        out.struct_size = sizeof out;
        EXPECT_EQ(library.enter(&host_, &out, &error_), CALOT_OK);
        const calot_factory* factory = out.factory(out.self, calot::string("rod"));
        EXPECT_EQ(factory->create(factory->self, calot::string("org.test.rod"), &host_, &instance_, &error_),
                  CALOT_OK);
        rod_ = static_cast<const calot_rod*>(instance_.kind);

        setup_.struct_size = sizeof setup_;
        setup_.node_count = 4;
        setup_.position = calot::reals(position_);
        setup_.segments.struct_size = sizeof setup_.segments;
        for (calot_reals* span :
             {&setup_.segments.mass_per_length, &setup_.segments.radius, &setup_.segments.bending_x,
              &setup_.segments.bending_y, &setup_.segments.torsion, &setup_.segments.bending_damping,
              &setup_.segments.torsion_damping, &setup_.segments.drag, &setup_.segments.friction})
            *span = calot::reals(ones_);
        input_.struct_size = sizeof input_;
        output_.struct_size = sizeof output_;
        activation_.struct_size = sizeof activation_;
        activation_.step_nanoseconds = 1'000'000;
        activation_.max_contacts = 2;
    }
    ~Layer() override { instance_.destroy(instance_.self); }

    void begin() {
        ASSERT_EQ(instance_.init(instance_.self, &error_), CALOT_OK);
        ASSERT_EQ(rod_->configure(instance_.self, &setup_, &error_), CALOT_OK) << error_.message;
        ASSERT_EQ(instance_.activate(instance_.self, &activation_, &error_), CALOT_OK) << error_.message;
    }
    calot_status step() { return rod_->step(instance_.self, &input_, &output_, &error_); }

    std::vector<std::uint8_t> save() {
        std::vector<std::uint8_t> bytes;
        calot_sink sink{sizeof sink, &bytes, [](void* self, calot_bytes b) -> calot_status {
                            auto& all = *static_cast<std::vector<std::uint8_t>*>(self);
                            all.insert(all.end(), b.data, b.data + b.size);
                            return CALOT_OK;
                        }};
        EXPECT_EQ(instance_.save_state(instance_.self, &sink, &error_), CALOT_OK) << error_.message;
        return bytes;
    }
    // Hands the bytes out in pieces of three.
    calot_status load(std::span<const std::uint8_t> bytes) {
        calot_source source{sizeof source, &bytes, [](void* self, calot_bytes_out out) -> std::uint64_t {
                                auto& rest = *static_cast<std::span<const std::uint8_t>*>(self);
                                const std::size_t n = std::min<std::size_t>({rest.size(), out.size, 3});
                                if (n > 0) std::memcpy(out.data, rest.data(), n);
                                rest = rest.subspan(n);
                                return n;
                            }};
        return instance_.load_state(instance_.self, &source, &error_);
    }

    calot_host host_{};
    calot_error error_{};
    calot_instance instance_{};
    const calot_rod* rod_ = nullptr;
    std::vector<double> position_ = {0, 0, 0, 0, 0, 1, 0, 0, 2, 0, 0, 3};
    std::vector<double> ones_ = {1, 1, 1};
    calot_rod_setup setup_{};
    calot_rod_input input_{};
    calot_rod_output output_{};
    calot_activation activation_{};
};

TEST_F(Layer, calls_out_of_order_are_refused_and_change_nothing) {
    void* self = instance_.self;
    const auto refused = [&](calot_status status, const char* what) {
        EXPECT_EQ(status, CALOT_ERROR) << what;
        EXPECT_EQ(error_.code, CALOT_CODE_WRONG_STATE) << what;
        EXPECT_STREQ(error_.field, what);
        error_.code = 0;
    };
    refused(rod_->configure(self, &setup_, &error_), "configure");
    refused(instance_.activate(self, &activation_, &error_), "activate");
    ASSERT_EQ(instance_.init(self, &error_), CALOT_OK);
    refused(instance_.init(self, &error_), "init");
    refused(instance_.activate(self, &activation_, &error_), "activate");
    refused(step(), "step");
    refused(instance_.reset(self, 1, &error_), "reset");
    refused(instance_.deactivate(self, &error_), "deactivate");
    ASSERT_EQ(rod_->configure(self, &setup_, &error_), CALOT_OK) << error_.message;
    ASSERT_EQ(instance_.activate(self, &activation_, &error_), CALOT_OK);
    refused(rod_->configure(self, &setup_, &error_), "configure");
    refused(instance_.activate(self, &activation_, &error_), "activate");
    refused(instance_.set_parameter(self, 0, 1, &error_), "set_parameter");
    EXPECT_EQ(step(), CALOT_OK) << error_.message;
    EXPECT_EQ(Recorder::steps, 1);
    EXPECT_EQ(instance_.deactivate(self, &error_), CALOT_OK);
    EXPECT_EQ(rod_->configure(self, &setup_, &error_), CALOT_OK);
}

TEST_F(Layer, a_number_that_is_not_finite_is_discarded_by_name) {
    begin();
    input_.gravity[1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(step(), CALOT_DISCARD);
    EXPECT_EQ(error_.code, CALOT_CODE_NOT_FINITE);
    EXPECT_STREQ(error_.field, "input.gravity[1]");
    input_.gravity[1] = 1e300;
    EXPECT_EQ(step(), CALOT_DISCARD);
    EXPECT_EQ(error_.code, CALOT_CODE_OUT_OF_RANGE);
    input_.gravity[1] = 0;

    std::vector<calot_contact> contacts(2);
    for (auto& k : contacts)
        k.normal[2] = 1;
    contacts[1].free_position[2] = std::numeric_limits<double>::infinity();
    input_.contacts = calot::structs<calot_contact>(contacts);
    EXPECT_EQ(step(), CALOT_DISCARD);
    EXPECT_STREQ(error_.field, "input.contacts[1].free_position[2]");
    EXPECT_EQ(Recorder::steps, 0);
    contacts[1].free_position[2] = 0;
    EXPECT_EQ(step(), CALOT_OK) << error_.field << " " << error_.message;
}

TEST_F(Layer, contacts_beyond_the_declared_list_or_the_rods_end_are_discarded) {
    begin();
    std::vector<calot_contact> contacts(3);
    for (auto& k : contacts)
        k.normal[2] = 1;
    input_.contacts = calot::structs<calot_contact>(contacts);
    EXPECT_EQ(step(), CALOT_DISCARD);
    EXPECT_EQ(error_.code, CALOT_CODE_CAPACITY);
    contacts.resize(1);
    contacts[0].segment = 3;
    input_.contacts = calot::structs<calot_contact>(contacts);
    EXPECT_EQ(step(), CALOT_DISCARD);
    EXPECT_EQ(error_.code, CALOT_CODE_OUT_OF_RANGE);
}

TEST_F(Layer, a_setup_with_a_wrong_size_or_a_negative_stiffness_is_discarded) {
    ASSERT_EQ(instance_.init(instance_.self, &error_), CALOT_OK);
    setup_.node_count = 5;
    EXPECT_EQ(rod_->configure(instance_.self, &setup_, &error_), CALOT_DISCARD);
    EXPECT_STREQ(error_.field, "setup.position");
    setup_.node_count = 4;
    std::vector<double> bending = {1, -1, 1};
    setup_.segments.bending_y = calot::reals(bending);
    EXPECT_EQ(rod_->configure(instance_.self, &setup_, &error_), CALOT_DISCARD);
    EXPECT_STREQ(error_.field, "segments.bending_y[1]");
}

TEST_F(Layer, no_exception_crosses_and_its_code_field_and_message_do) {
    ASSERT_EQ(instance_.init(instance_.self, &error_), CALOT_OK);
    Recorder::fail_in = "configure";
    EXPECT_EQ(rod_->configure(instance_.self, &setup_, &error_), CALOT_ERROR);
    EXPECT_EQ(error_.code, CALOT_CODE_MISSING_ASSET);
    EXPECT_STREQ(error_.field, "configure");
    EXPECT_STREQ(error_.message, "was told to fail: größer");
    // It stays in the state that it was in.
    Recorder::fail_in.clear();
    EXPECT_EQ(instance_.activate(instance_.self, &activation_, &error_), CALOT_ERROR);
    EXPECT_EQ(rod_->configure(instance_.self, &setup_, nullptr), CALOT_OK);
    EXPECT_EQ(instance_.activate(instance_.self, &activation_, &error_), CALOT_OK);
    Recorder::fail_in = "result";
    EXPECT_EQ(step(), CALOT_DISCARD);
    EXPECT_STREQ(error_.field, "input.tick");
    Recorder::fail_in = "step";
    EXPECT_EQ(step(), CALOT_ERROR);
}

TEST_F(Layer, parameters_clamp_round_and_refuse_what_is_not_finite) {
    void* self = instance_.self;
    double value = 0;
    EXPECT_EQ(instance_.parameter_count(self), 2u);
    EXPECT_EQ(instance_.get_parameter(self, 0, &value, &error_), CALOT_OK);
    EXPECT_EQ(value, 1);
    EXPECT_EQ(instance_.set_parameter(self, 0, 7, &error_), CALOT_OK);
    instance_.get_parameter(self, 0, &value, &error_);
    EXPECT_EQ(value, 2);
    EXPECT_EQ(instance_.set_parameter(self, 1, 2.6, &error_), CALOT_OK);
    instance_.get_parameter(self, 1, &value, &error_);
    EXPECT_EQ(value, 3);
    EXPECT_EQ(instance_.set_parameter(self, 1, std::numeric_limits<double>::quiet_NaN(), &error_),
              CALOT_DISCARD);
    EXPECT_EQ(instance_.get_parameter(self, 2, &value, &error_), CALOT_ERROR);
}

TEST_F(Layer, a_step_length_out_of_bounds_is_discarded) {
    ASSERT_EQ(instance_.init(instance_.self, &error_), CALOT_OK);
    ASSERT_EQ(rod_->configure(instance_.self, &setup_, &error_), CALOT_OK);
    activation_.step_nanoseconds = 0;
    EXPECT_EQ(instance_.activate(instance_.self, &activation_, &error_), CALOT_DISCARD);
    EXPECT_STREQ(error_.field, "activation.step_nanoseconds");
}

TEST_F(Layer, a_state_comes_back_byte_for_byte_in_small_pieces) {
    begin();
    ASSERT_EQ(step(), CALOT_OK);
    const auto saved = save();
    ASSERT_EQ(step(), CALOT_OK);
    EXPECT_NE(save(), saved);
    ASSERT_EQ(load(saved), CALOT_OK) << error_.message;
    EXPECT_EQ(save(), saved);
}

TEST_F(Layer, a_corrupt_state_is_refused_and_the_instance_stays_as_it_was) {
    begin();
    ASSERT_EQ(step(), CALOT_OK);
    const auto good = save();
    ASSERT_EQ(step(), CALOT_OK);
    const auto before = save();
    const auto refused = [&](std::vector<std::uint8_t> bytes, const std::string& what) {
        EXPECT_EQ(load(bytes), CALOT_ERROR) << what;
        EXPECT_EQ(error_.code, CALOT_CODE_CORRUPT_STATE) << what;
        EXPECT_EQ(save(), before) << what;
    };
    refused({}, "empty");
    for (std::size_t n = 0; n < good.size(); ++n)
        refused({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(n)}, "cut at " + std::to_string(n));
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
        auto bytes = good;
        bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << (bit % 8)));
        refused(bytes, "bit " + std::to_string(bit));
    }
    auto longer = good;
    longer.push_back(0);
    refused(longer, "longer");
    refused(std::vector<std::uint8_t>(1 << 20, 0x5a), "rubbish");
    EXPECT_EQ(load(good), CALOT_OK);
}

TEST_F(Layer, a_model_that_throws_half_way_through_loading_is_put_back) {
    begin();
    ASSERT_EQ(step(), CALOT_OK);
    const auto before = save();
    // The right frame around values that the model itself refuses.
    calot::StateWriter payload;
    payload.values(std::vector<double>{-1, 5, 5, 5});
    std::vector<std::uint8_t> bytes;
    calot_sink sink{sizeof sink, &bytes, [](void* self, calot_bytes b) -> calot_status {
                        auto& all = *static_cast<std::vector<std::uint8_t>*>(self);
                        all.insert(all.end(), b.data, b.data + b.size);
                        return CALOT_OK;
                    }};
    calot::detail::write_state(sink, calot::fnv1a("org.test.rod"), 1, payload.bytes());
    EXPECT_EQ(load(bytes), CALOT_ERROR);
    EXPECT_EQ(save(), before);
}

TEST(Maths, quaternions_turn_vectors_right_handed) {
    const auto turn = calot::axis_angle({0, 0, 1}, 0.5 * 3.14159265358979323846);
    const auto y = calot::rotate(turn, {1, 0, 0});
    EXPECT_NEAR(norm(y - calot::Vec3{0, 1, 0}), 0, 1e-15);
    EXPECT_NEAR(norm(calot::rotate_back(turn, y) - calot::Vec3{1, 0, 0}), 0, 1e-15);
    const auto a = calot::normalized(calot::Vec3{1, 2, 3}), b = calot::normalized(calot::Vec3{-3, 1, 0.5});
    EXPECT_NEAR(norm(calot::rotate(calot::between(a, b), a) - b), 0, 1e-14);
    EXPECT_NEAR(norm(calot::rotate(calot::between(a, -a), a) + a), 0, 1e-14);
}

} // namespace
