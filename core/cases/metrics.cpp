#include "cases/metrics.hpp"

#include "cases/motion_filter.hpp"
#include "simulation/digest.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace calot::cases {

namespace {

constexpr double dt = 1e-3;              // s
constexpr std::int64_t block_ticks = 16; // over which forces are averaged before the greatest is taken

double length(double x, double y, double z) {
    return std::sqrt(x * x + y * y + z * z);
}

// Largest and mean of what is seen once a tick.
struct Extent {
    double sum = 0, most = 0;
    std::int64_t count = 0;
    void see(double value) {
        sum += value;
        most = std::max(most, value);
        ++count;
    }
    double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
};

// The mean as it is, the largest of means over blocks.
struct BlockExtent {
    Extent ticks, blocks;
    double sum = 0;
    std::int64_t count = 0;
    void see(double value) {
        ticks.see(value);
        sum += value;
        if (++count == block_ticks) {
            blocks.see(sum / block_ticks);
            sum = 0;
            count = 0;
        }
    }
    double most() const {
        return count > 0 ? std::max(blocks.most, sum / static_cast<double>(count)) : blocks.most;
    }
};

struct TaskRecord {
    double path = 0; // m
    Extent tip_speed, speed, acceleration;
    BlockExtent tissue, force, torque;
};

std::string column(std::string_view text) {
    std::string name(text);
    for (char& c : name)
        if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
    return name;
}

} // namespace

double MotionFilter::decay_per_tick() {
    static const double decay = std::exp(-2 * std::numbers::pi * frequency * 1e-3);
    return decay;
}

const std::vector<MetricDefinition>& task_metrics() {
    static const std::vector<MetricDefinition> list = {
        {"completion-time", "Completion time", "s",
         "Simulated time from the task's begin until its goal was reached; pauses do not count.", ""},
        {"path-length", "Path length of the tip", "m",
         "Length of the way of the endoscope's camera, its position low-passed at 10 Hz (second order, "
         "critically damped).",
         ""},
        {"tip-speed-mean", "Mean speed of the tip", "m/s", "Path length over the time measured.", ""},
        {"tip-speed-max", "Greatest speed of the tip", "m/s", "Of the low-passed position of the camera.",
         ""},
        {"tissue-force-mean", "Mean force on tissue", "N",
         "Mean over all ticks of the sum of the magnitudes of all contact forces between endoscope and "
         "organs, each its impulse over a tick of 1 ms.",
         ""},
        {"tissue-force-max", "Greatest force on tissue", "N",
         "Greatest mean of that sum over 16 consecutive ticks (16 ms).", ""},
        {"shaft-speed-mean", "Mean velocity of the shaft", "m/s",
         "Mean magnitude of the velocity of the shaft into and out of the patient at its entry: insertion "
         "low-passed at 10 Hz (second order, critically damped).",
         ""},
        {"shaft-speed-max", "Greatest velocity of the shaft", "m/s",
         "Greatest magnitude of the same velocity.", ""},
        {"shaft-acceleration-mean", "Mean acceleration of the shaft", "m/s2",
         "Mean magnitude of the acceleration that belongs to the same velocity.", ""},
        {"shaft-acceleration-max", "Greatest acceleration of the shaft", "m/s2",
         "Greatest magnitude of the same acceleration.", ""},
        {"haptic-force-mean", "Mean haptic force", "N",
         "Mean magnitude of the force along the shaft that the operator's hand feels.", ""},
        {"haptic-force-max", "Greatest haptic force", "N",
         "Greatest mean of that magnitude over 16 consecutive ticks (16 ms).", ""},
        {"haptic-torque-mean", "Mean haptic torque", "N m",
         "Mean magnitude of the torque about the shaft that the operator's hand feels.", ""},
        {"haptic-torque-max", "Greatest haptic torque", "N m",
         "Greatest mean of that magnitude over 16 consecutive ticks (16 ms).", ""},
    };
    return list;
}

struct MetricsRecorder::Impl {
    std::vector<simulation::TaskState> tasks;
    std::vector<TaskRecord> records; // as tasks
    std::vector<MetricDefinition> own;
    std::vector<std::optional<double>> own_values; // as own
    std::array<MotionFilter, 3> tip;
    MotionFilter insertion;
    simulation::Digest last{};

    // What a task is worth is measured while it is at hand.
    static bool is_at_hand(const simulation::TaskState& t) { return t.is_begun && !t.is_completed; }
};

MetricsRecorder::MetricsRecorder(std::vector<simulation::TaskState> tasks, std::vector<MetricDefinition> own)
    : impl_(std::make_unique<Impl>()) {
    impl_->tasks = std::move(tasks);
    impl_->records.resize(impl_->tasks.size());
    impl_->own = std::move(own);
    impl_->own_values.resize(impl_->own.size());
}

MetricsRecorder::~MetricsRecorder() = default;
MetricsRecorder::MetricsRecorder(MetricsRecorder&&) noexcept = default;

void MetricsRecorder::began(const simulation::Snapshot& s) {
    for (std::size_t k = 0; k < 3; ++k)
        impl_->tip[k].start(s.camera.position[k]);
    impl_->insertion.start(s.insertion);
}

void MetricsRecorder::ticked(const simulation::Snapshot& s) {
    Impl& m = *impl_;
    for (std::size_t k = 0; k < 3; ++k)
        m.tip[k].step(s.camera.position[k]);
    m.insertion.step(s.insertion);
    const double tip_speed = length(m.tip[0].velocity(), m.tip[1].velocity(), m.tip[2].velocity());
    for (std::size_t i = 0; i < m.tasks.size(); ++i) {
        if (!Impl::is_at_hand(m.tasks[i])) continue;
        TaskRecord& r = m.records[i];
        r.path += tip_speed * dt;
        r.tip_speed.see(tip_speed);
        r.speed.see(std::fabs(m.insertion.velocity()));
        r.acceleration.see(std::fabs(m.insertion.acceleration()));
        r.tissue.see(s.tissue_force);
        r.force.see(std::fabs(s.feedback.insertion_force));
        r.torque.see(std::fabs(s.feedback.rotation_torque));
    }
}

void MetricsRecorder::commanded(std::int64_t tick, const simulation::Command& c) {
    Impl& m = *impl_;
    if (c.kind == CALOT_COMMAND_METRIC) {
        for (std::size_t i = 0; i < m.own.size(); ++i)
            if (m.own[i].id == c.id.view() && m.own[i].task == c.text.view()) m.own_values[i] = c.value;
        return;
    }
    for (simulation::TaskState& t : m.tasks) {
        if (t.id != c.id.view()) continue;
        if (c.kind == CALOT_COMMAND_TASK_BEGIN) {
            t.is_begun = true;
            t.begin_tick = tick;
        } else if (c.kind == CALOT_COMMAND_TASK_COMPLETE) {
            if (!t.is_begun) t.begin_tick = 0;
            t.is_begun = t.is_completed = true;
            t.end_tick = tick;
        }
    }
}

void MetricsRecorder::digested(const simulation::Digest& d) {
    impl_->last = d;
}

std::map<std::string, double> MetricsRecorder::values() const {
    std::map<std::string, double> values;
    const Impl& m = *impl_;
    for (std::size_t i = 0; i < m.tasks.size(); ++i) {
        const TaskRecord& r = m.records[i];
        const std::string prefix = m.tasks[i].id + ".";
        if (m.tasks[i].is_completed) values[prefix + "completion-time"] = m.tasks[i].seconds();
        if (r.tip_speed.count == 0) continue;
        values[prefix + "path-length"] = r.path;
        values[prefix + "tip-speed-mean"] = r.tip_speed.mean();
        values[prefix + "tip-speed-max"] = r.tip_speed.most;
        values[prefix + "tissue-force-mean"] = r.tissue.ticks.mean();
        values[prefix + "tissue-force-max"] = r.tissue.most();
        values[prefix + "shaft-speed-mean"] = r.speed.mean();
        values[prefix + "shaft-speed-max"] = r.speed.most;
        values[prefix + "shaft-acceleration-mean"] = r.acceleration.mean();
        values[prefix + "shaft-acceleration-max"] = r.acceleration.most;
        values[prefix + "haptic-force-mean"] = r.force.ticks.mean();
        values[prefix + "haptic-force-max"] = r.force.most();
        values[prefix + "haptic-torque-mean"] = r.torque.ticks.mean();
        values[prefix + "haptic-torque-max"] = r.torque.most();
    }
    for (std::size_t i = 0; i < m.own.size(); ++i)
        if (m.own_values[i])
            values[(m.own[i].task.empty() ? "" : m.own[i].task + ".") + m.own[i].id] = *m.own_values[i];
    return values;
}

const std::vector<MetricDefinition>& MetricsRecorder::own() const {
    return impl_->own;
}

const std::vector<simulation::TaskState>& MetricsRecorder::tasks() const {
    return impl_->tasks;
}

std::uint64_t MetricsRecorder::fingerprint() const {
    simulation::Hash hash;
    const simulation::Digest& d = impl_->last;
    for (const std::uint64_t part :
         {static_cast<std::uint64_t>(d.tick), d.rod, d.contacts, d.controls, d.procedure})
        hash.add(part);
    return hash.value();
}

std::string column_of(std::string_view task, std::string_view metric) {
    return task.empty() ? column(metric) : column(task) + "_" + column(metric);
}

} // namespace calot::cases
