// The metrics of every task, and what the procedure adds; CSV and JSON.
#pragma once

#include "cases/journal.hpp"
#include "simulation/simulation.hpp"

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace calot::cases {

/// Name, unit and meaning of a metric. `task`: id, or "" for the whole case.
struct MetricDefinition {
    std::string id, title, unit, definition, task;
};

/// The metrics that the host measures of every task, in the order of their columns.
const std::vector<MetricDefinition>& task_metrics();

/// Measures tasks as they run. An observer of the simulation; its state is fixed in size.
class MetricsRecorder : public simulation::Observer {
  public:
    /// `own`: what the procedure declares. [main]
    MetricsRecorder(std::vector<simulation::TaskState> tasks, std::vector<MetricDefinition> own);
    ~MetricsRecorder() override;
    MetricsRecorder(MetricsRecorder&&) noexcept;
    void began(const simulation::Snapshot&) override;
    void ticked(const simulation::Snapshot&) override;
    void commanded(std::int64_t tick, const simulation::Command&) override;
    void digested(const simulation::Digest&) override;

    /// Values by "<task>.<metric>" (the whole case: "<metric>"); a metric without observations is absent.
    std::map<std::string, double> values() const;
    const std::vector<MetricDefinition>& own() const;
    const std::vector<simulation::TaskState>& tasks() const;
    /// Of the case's last state: same inputs, same value.
    std::uint64_t fingerprint() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Name of a metric's column: letters, digits and underscores, as statistics programs want them.
std::string column_of(std::string_view task, std::string_view metric);

/// One row for the case. UTF-8, comma, CRLF, header row, full stop as decimal sign; a value that was not
/// measured is an empty cell. Writes metrics.csv and metrics-dictionary.csv into `folder`.
void write_metrics(const std::filesystem::path& folder, const CaseHeader& header,
                   const simulation::Outcome& outcome, const MetricsRecorder& metrics);

/// The object that `--json` prints.
std::string to_json(const CaseHeader& header, const simulation::Outcome& outcome,
                    const MetricsRecorder& metrics, const std::vector<std::filesystem::path>& files);

} // namespace calot::cases
