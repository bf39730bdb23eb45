// A device that performs a procedure: a person's reaction time, tremor and speeds around the pilot.
#pragma once

#include "pilot.hpp"

#include <calot/device.hpp>
#include <calot/host.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace calot::virtual_operator {

/// How a person's hands differ from the pilot's wish.
struct Manner {
    Skill skill;
    double reaction = 0.15;           // s from seeing to acting
    double tremor_insertion = 0.0002; // m, standard deviation of the hand about where it is meant to be
    double tremor_rotation = 0.004;   // rad
    double tremor_wheel = 0.004;      // rad
    double aim_wander = 0.02;         // rad, standard deviation of where one looks
};

/// "expert" or "novice"; anything else throws Error.
Manner manner_of(std::string_view skill);

class VirtualOperator final : public Device, public ObservingDevice {
  public:
    void init() override;
    void sheet(calot_device_sheet& out) override;
    void configure(const calot_controls& start) override;
    void activate(const calot_activation& activation) override;
    void reset(std::uint64_t seed) override;
    void save(StateWriter& to) const override;
    void load(StateReader& from) override;
    Result observe(const calot_observation& observation) override;
    Result poll(std::int64_t tick, calot_controls& out) override;
    Result send(const calot_feedback& feedback) override;

  private:
    static constexpr std::size_t most_points = 1024;

    // What was seen and felt at a moment, kept until the reaction time is over.
    struct Moment {
        calot_pose view{};
        double insertion_force = 0;
    };
    enum Stream : std::uint64_t {
        stream_insertion,
        stream_rotation,
        stream_wheels,
        stream_aim = stream_wheels + 2
    };

    double noise(std::uint64_t stream, std::int64_t tick, double period) const;

    Manner manner_;
    Random random_;
    double step_ = 0.001; // s
    std::uint64_t seed_ = 0;
    calot_controls start_ = resting_controls();

    // Everything below steers the future.
    Pilot pilot_;
    std::vector<Moment> moments_; // ring buffer as long as the reaction time
    std::uint64_t seen_ = 0;      // moments so far
    std::vector<Vec3> path_;
    bool has_ring_ = false, has_task_ = false, is_stopped_ = false;
    Vec3 ring_centre_, ring_normal_;
    double ring_radius_ = 0;
    double insertion_ = 0, rotation_ = 0; // where the hands mean to be
    std::array<double, 2> wheel_{};
    Rates rates_; // as fast as the hands are
};

} // namespace calot::virtual_operator
