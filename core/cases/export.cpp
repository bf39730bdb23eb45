// metrics.csv, its dictionary, and the object of --json.
#include "cases/metrics.hpp"
#include "host/error.hpp"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace calot::cases {

namespace {

// The shortest text that reads back as the same double, whatever the locale.
std::string number(double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value).ptr;
    return {text, end};
}

// RFC 4180; a cell that a spreadsheet would take for a formula gets an apostrophe before it.
std::string cell(std::string_view text) {
    std::string out;
    const bool is_formula =
        !text.empty() && std::string_view("=+-@\t").find(text.front()) != std::string_view::npos;
    if (is_formula) out = "'";
    out += text;
    if (out.find_first_of(",\"\r\n") == std::string::npos) return out;
    std::string quoted = "\"";
    for (const char c : out) {
        if (c == '"') quoted += '"';
        quoted += c;
    }
    return quoted + "\"";
}

std::string line(const std::vector<std::string>& cells) {
    std::string out;
    for (std::size_t i = 0; i < cells.size(); ++i)
        out += (i == 0 ? "" : ",") + cells[i];
    return out + "\r\n";
}

void write_file(const std::filesystem::path& file, const std::string& text) {
    const auto refuse = [&] {
        throw host::UserError(file.string(), "",
                              std::string("can't be written (") + std::strerror(errno) + "); check the disk");
    };
    const int handle = ::open(file.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
    if (handle < 0) refuse();
    std::size_t done = 0;
    while (done < text.size()) {
        const ssize_t written = ::write(handle, text.data() + done, text.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) {
            ::close(handle);
            refuse();
        }
        done += static_cast<std::size_t>(written);
    }
    ::close(handle);
}

std::string json(std::string_view text) {
    static constexpr char digits[] = "0123456789abcdef";
    std::string out = "\"";
    for (const char c : text) {
        const auto u = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\')
            (out += '\\') += c;
        else if (u < 0x20)
            ((out += "\\u00") += digits[u >> 4]) += digits[u & 15];
        else
            out += c;
    }
    return out + "\"";
}

std::string json(double value) {
    return std::isfinite(value) ? number(value) : "null";
}

const char* name_of(simulation::End end) {
    switch (end) {
    case simulation::End::finished:
        return "finished";
    case simulation::End::until:
        return "until";
    case simulation::End::time_limit:
        return "time-limit";
    case simulation::End::replay_ended:
        return "replay-ended";
    case simulation::End::stopped:
        break;
    }
    return "stopped";
}

std::string fingerprint_text(const MetricsRecorder& metrics) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(metrics.fingerprint()));
    return text;
}

// One column: its name, its value in the row, its entry in the dictionary. Task and title, where there are
// any, are what people read in tables.
struct Column {
    std::string name, value, unit, definition;
    std::string task = {}, title = {};
};

// Only what the same inputs give again: no wall time, no date, no place.
std::vector<Column> columns(const CaseHeader& h, const simulation::Outcome& outcome,
                            const MetricsRecorder& metrics) {
    const auto values = metrics.values();
    const auto value = [&](const std::string& key) {
        const auto found = values.find(key);
        return found == values.end() ? std::string() : number(found->second);
    };
    std::vector<Column> all = {
        {"case", fingerprint_text(metrics), "", "Fingerprint of what happened: same inputs, same text."},
        {"procedure", cell(h.procedure), "", "Identifier of the procedure."},
        {"operator", cell(h.operator_code), "", "The operator's code, as given."},
        {"device", cell(h.device), "", "What the operator's hands held."},
        {"rod", cell(h.rod), "", "Model of the endoscope's mechanics."},
        {"anatomy", cell(h.anatomy), "", "Anatomy."},
        {"start", cell(h.start), "", "Start pose."},
        {"seed", std::to_string(h.seed), "", "Seed of start pose and operator's noise."},
        {"completed", outcome.is_completed ? "1" : "0", "",
         "1: every required task (or the one asked for) completed."},
        {"duration", number(static_cast<double>(outcome.ticks) / 1000), "s",
         "Simulated time of the whole case."},
    };
    for (const simulation::TaskState& task : outcome.tasks) {
        all.push_back({column_of(task.id, "completed"), task.is_completed ? "1" : "0", "",
                       task.title + ": 1 when its goal was reached.", task.title, "Completed"});
        const auto add = [&](const MetricDefinition& m) {
            all.push_back({column_of(task.id, m.id), value(task.id + "." + m.id), m.unit,
                           task.title + ": " + m.title + ". " + m.definition, task.title, m.title});
        };
        for (const MetricDefinition& m : task_metrics())
            add(m);
        for (const MetricDefinition& m : metrics.own())
            if (m.task == task.id) add(m);
    }
    for (const MetricDefinition& m : metrics.own())
        if (m.task.empty())
            all.push_back(
                {column_of("", m.id), value(m.id), m.unit, m.title + ". " + m.definition, "", m.title});
    all.push_back({"penetration_max", number(outcome.penetration.deepest), "m",
                   "Deepest overlap of shaft and organs: a measure of the simulation, not of the operator."});
    all.push_back({"penetration_time", number(static_cast<double>(outcome.penetration.ticks_over_1mm) / 1000),
                   "s", "Time with an overlap of more than 1 mm: a measure of the simulation."});
    return all;
}

} // namespace

void write_metrics(const std::filesystem::path& folder, const CaseHeader& header,
                   const simulation::Outcome& outcome, const MetricsRecorder& metrics) {
    std::vector<std::string> names, values;
    std::string dictionary = line({"name", "unit", "definition", "task", "title"});
    for (const Column& c : columns(header, outcome, metrics)) {
        names.push_back(c.name);
        values.push_back(c.value);
        dictionary += line({c.name, cell(c.unit), cell(c.definition), cell(c.task), cell(c.title)});
    }
    write_file(folder / "metrics.csv", line(names) + line(values));
    write_file(folder / "metrics-dictionary.csv", dictionary);
}

std::string to_json(const CaseHeader& header, const simulation::Outcome& outcome,
                    const MetricsRecorder& metrics, const std::vector<std::filesystem::path>& files) {
    std::string out = "{";
    out += "\"case\": " + json(fingerprint_text(metrics)) + ", \"procedure\": " + json(header.procedure) +
           ", \"seed\": " + std::to_string(header.seed) +
           ", \"completed\": " + (outcome.is_completed ? "true" : "false") +
           ", \"end\": " + json(name_of(outcome.end)) +
           ", \"seconds\": " + json(static_cast<double>(outcome.ticks) / 1000) + ", \"tasks\": [";
    const char* comma = "";
    for (const simulation::TaskState& t : outcome.tasks) {
        out += comma;
        out += "{\"id\": " + json(t.id) + ", \"name\": " + json(t.title) +
               ", \"required\": " + (t.is_required ? "true" : "false") +
               ", \"completed\": " + (t.is_completed ? "true" : "false") +
               ", \"seconds\": " + (t.is_completed ? json(t.seconds()) : std::string("null")) + "}";
        comma = ", ";
    }
    out += "], \"metrics\": {";
    comma = "";
    for (const auto& [name, value] : metrics.values()) {
        out += comma + json(name) + ": " + json(value);
        comma = ", ";
    }
    out += "}, \"late_ticks\": " + std::to_string(outcome.late.late) +
           ", \"slipped_ticks\": " + std::to_string(outcome.late.slipped) +
           ", \"real_time_scheduling\": " + (outcome.late.is_first ? "true" : "false") +
           ", \"real_time_factor\": " + json(outcome.real_time_factor) +
           ", \"penetration\": {\"deepest\": " + json(outcome.penetration.deepest) +
           ", \"seconds_over_1mm\": " + json(static_cast<double>(outcome.penetration.ticks_over_1mm) / 1000) +
           "}, \"files\": [";
    comma = "";
    for (const std::filesystem::path& file : files) {
        out += comma + json(file.string());
        comma = ", ";
    }
    return out + "]}";
}

} // namespace calot::cases
