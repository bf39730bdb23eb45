// The hybrid trans-gastric cholecystectomy: what is simulated, what the operator is told, what is measured.
#pragma once

#include "navigation.hpp"

#include <calot/procedure.hpp>

#include <string>

namespace calot::transgastric {

class TransgastricCholecystectomy final : public Procedure {
  public:
    void init() override;
    std::string scene() override { return scene_; }
    std::span<const TaskInfo> tasks() const override;
    std::span<const MetricInfo> metrics() const override;
    void configure(const calot_procedure_setup& setup) override;
    void activate(const calot_activation& activation) override;
    void reset(std::uint64_t seed) override;
    void save(StateWriter& to) const override;
    void load(StateReader& from) override;
    Result update(const calot_snapshot& snapshot, Commands& commands) override;

  private:
    // What has been told so far. A full queue is tried again at the next update.
    enum class Told : std::uint32_t {
        nothing,
        task,
        way,
        ring,
        goal,
        stomach,
        through,
        metrics,
        ring_done,
        done,
        finished
    };
    bool tell_next(Commands& commands);

    std::string scene_;
    Navigation navigation_;
    Told told_ = Told::nothing;
};

} // namespace calot::transgastric
