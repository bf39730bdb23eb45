// A rod for tests in which its mechanics don't matter.
#pragma once

#include <calot/math.hpp>
#include <calot/rod.hpp>

#include <algorithm>
#include <vector>

namespace calot_test {

// Straight and rigid: lies along the guide (or where it was placed) and follows the coupling's targets at
// once.
class RigidRod : public calot::Rod {
  public:
    void configure(const calot_rod_setup& setup) override {
        const auto p = calot::span(setup.position);
        rest_.assign(p.begin(), p.end());
        has_guide_ = setup.guide.present != 0;
        direction_ = calot::vec3(setup.guide.direction);
        insertion_ = 0;
        if (has_guide_)
            insertion_ = dot(calot::vec3(rest_.data()) - calot::vec3(setup.guide.exit), direction_);
        start_ = insertion_;
        rotation_ = 0;
    }
    void reset(std::uint64_t) override { insertion_ = start_, rotation_ = 0; }
    void save(calot::StateWriter& to) const override { to.value(insertion_), to.value(rotation_); }
    void load(calot::StateReader& from) override { from.value(insertion_), from.value(rotation_); }

    calot::Result set_segments(const calot_rod_segments&) override { return calot::Result::ok(); }
    calot::Result step(const calot_rod_input& input, calot_rod_output& output) override {
        if (input.base.mode == CALOT_END_COUPLED) {
            insertion_ = input.base.insertion.target;
            rotation_ = input.base.rotation.target;
        }
        return read(output);
    }
    calot::Result read(calot_rod_output& output) override {
        const auto shift = (insertion_ - start_) * direction_;
        const auto position = calot::span(output.position);
        for (std::size_t i = 0; i + 2 < position.size(); i += 3)
            calot::store(calot::vec3(rest_.data() + i) + shift, position.data() + i);
        std::ranges::fill(calot::span(output.velocity), 0.0);
        std::ranges::fill(calot::span(output.angular_velocity), 0.0);
        std::ranges::fill(calot::span(output.contact_impulse), 0.0);
        const auto frame = calot::span(output.frame);
        for (std::size_t i = 0; i + 3 < frame.size(); i += 4) {
            const auto axis = calot::normalized(calot::vec3(rest_.data() + 3 * (i / 4 + 1)) -
                                                calot::vec3(rest_.data() + 3 * (i / 4)));
            calot::store(calot::axis_angle(axis, rotation_) * calot::between({0, 0, 1}, axis), &frame[i]);
        }
        output.base = output.tip = {};
        output.insertion = insertion_, output.rotation = rotation_;
        output.insertion_force = output.rotation_torque = 0;
        output.kinetic_energy = output.bending_energy = output.twist_energy = output.gravity_energy = 0;
        return calot::Result::ok();
    }

  private:
    std::vector<double> rest_;
    bool has_guide_ = false;
    calot::Vec3 direction_{0, 0, 1};
    double start_ = 0, insertion_ = 0, rotation_ = 0;
};

} // namespace calot_test
