// The simulating child process of `calot run` and `calot replay`.
#include "app/case_process.hpp"

#include "app/case_display.hpp"
#include "app/case_parts.hpp"
#include "app/commands.hpp"
#include "app/video_recorder.hpp"
#include "cases/metrics.hpp"
#include "cases/recorder.hpp"
#include "cases/replay.hpp"
#include "host/error.hpp"
#include "rendering/egl_context.hpp"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <sys/stat.h>
#include <thread>

namespace calot::app {
namespace {

namespace fs = std::filesystem;

// Runs the simulation on a thread of its own, while this one shows it.
class Runner {
  public:
    Runner(simulation::Simulation& simulation, const simulation::RunOptions& options)
        : thread_([this, &simulation, options] {
              host::note_faults();
              try {
                  outcome_ = simulation.run(options);
              } catch (...) {
                  problem_ = std::current_exception();
              }
              is_over_.store(true);
          }) {}
    ~Runner() { join(); }
    bool is_over() const { return is_over_.load(); }
    void join() {
        if (thread_.joinable()) thread_.join();
    }
    const std::optional<simulation::Outcome>& outcome() const { return outcome_; }
    std::exception_ptr problem() const { return problem_; }

  private:
    std::optional<simulation::Outcome> outcome_;
    std::exception_ptr problem_;
    std::atomic<bool> is_over_{false};
    std::thread thread_;
};

// Removes the folder of a case that never began, if it was not there before.
class UnbegunFolder {
  public:
    explicit UnbegunFolder(const fs::path& folder) {
        if (!folder.empty() && !fs::exists(fs::symlink_status(folder))) folder_ = folder;
    }
    ~UnbegunFolder() {
        std::error_code ignored;
        if (!folder_.empty()) fs::remove_all(folder_, ignored);
    }
    UnbegunFolder(const UnbegunFolder&) = delete;
    UnbegunFolder& operator=(const UnbegunFolder&) = delete;
    void keep() { folder_.clear(); }

  private:
    fs::path folder_;
};

// What can be said of a case that a plugin's failure ended.
simulation::Outcome cut_short(const simulation::Simulation& simulation) {
    simulation::Outcome outcome;
    outcome.tasks = simulation.tasks();
    if (const auto last = simulation.latest()) {
        outcome.ticks = last->tick;
        outcome.late = last->late;
        outcome.penetration = last->penetration;
    }
    return outcome;
}

const char* end_in_words(simulation::End end) {
    switch (end) {
    case simulation::End::finished:
        return "the procedure is over";
    case simulation::End::until:
        return "the task is completed";
    case simulation::End::stopped:
        return "it was ended";
    case simulation::End::time_limit:
        return "its time is over (--time-limit)";
    case simulation::End::replay_ended:
        return "the record ends here";
    }
    return "";
}

void print_summary(const simulation::Outcome& outcome, bool has_failed, const std::vector<fs::path>& files) {
    for (const simulation::TaskState& task : outcome.tasks) {
        if (task.is_completed)
            std::printf("%s: completed in %.1f s\n", task.title.c_str(), task.seconds());
        else
            std::printf("%s: not completed\n", task.title.c_str());
    }
    std::printf("%.1f s simulated", static_cast<double>(outcome.ticks) * 1e-3);
    if (outcome.real_time_factor > 0) std::printf(", %.2f times real time", outcome.real_time_factor);
    if (!has_failed) std::printf("; %s", end_in_words(outcome.end));
    std::printf("\n");
    if (outcome.late.slipped > 0)
        std::printf("Simulated time fell behind by %.3f s: this machine was too slow or too busy\n",
                    static_cast<double>(outcome.late.slipped) * 1e-3);
    for (const fs::path& file : files)
        std::printf("  %s\n", file.c_str());
}

int verdict(const cases::Verifier& verifier, const cases::Journal& journal) {
    if (const auto& difference = verifier.difference()) {
        std::printf("differs: first at tick %lld, in the %s\n", static_cast<long long>(difference->tick),
                    difference->part.c_str());
        return not_completed;
    }
    std::printf("verified: %lld of %lld ticks give the same bits\n",
                static_cast<long long>(verifier.compared_ticks()), static_cast<long long>(journal.ticks));
    return verifier.compared_ticks() > 0 ? completed : not_completed;
}

} // namespace

int run_case(const CaseOptions& options, const cases::Journal* replay, CaseShared& shared) {
    umask(077); // a case is its operator's own
    rendering::limit_software_threads();
    StopSignal::install();

    CaseParts parts(options, replay);
    if (replay != nullptr) {
        for (const std::string& line : cases::changed_parts(replay->header, parts.header))
            std::fprintf(stderr, "calot: replay: %s\n", line.c_str());
        if (!replay->damage.empty()) std::fprintf(stderr, "calot: replay: %s\n", replay->damage.c_str());
    }
    std::optional<cases::JournalControls> controls;
    if (replay != nullptr) controls.emplace(*replay);
    simulation::Simulation simulation(parts.setup(options, controls ? &*controls : nullptr));

    std::unique_ptr<CaseDisplay> display = options.is_headless
                                               ? make_progress_line(simulation)
                                               : make_window(simulation, *parts.world, parts.title);

    std::vector<fs::path> files;
    UnbegunFolder unbegun(replay == nullptr ? options.folder : "");
    std::optional<cases::JournalWriter> journal;
    std::optional<cases::CaseRecorder> recorder;
    cases::MetricsRecorder metrics(simulation.tasks(), parts.metrics());
    std::optional<cases::Verifier> verifier;
    if (replay == nullptr) {
        fs::create_directories(fs::absolute(options.folder).parent_path());
        journal.emplace(options.folder, parts.header);
        shared.set_folder(options.folder);
        recorder.emplace(*journal);
        simulation.add_observer(*recorder);
    } else if (options.verify) {
        verifier.emplace(*replay);
        simulation.add_observer(*verifier);
    }
    simulation.add_observer(metrics);
    std::optional<VideoRecorder> video;
    if (!options.video.empty()) {
        video.emplace(options.video, *parts.world, simulation.tasks(), !options.is_realtime);
        simulation.add_observer(*video);
    }

    simulation::RunOptions run;
    run.speed = options.is_realtime ? simulation::Speed::realtime : simulation::Speed::max;
    if (options.time_limit > 0) run.max_ticks = static_cast<std::int64_t>(options.time_limit * 1000);

    shared.is_running.store(true);
    unbegun.keep();
    Runner runner(simulation, run);
    while (!runner.is_over()) {
        if (StopSignal::is_set()) simulation.stop();
        display->show();
    }
    runner.join();
    display.reset();

    std::exception_ptr problem = runner.problem();
    const simulation::Outcome outcome = runner.outcome() ? *runner.outcome() : cut_short(simulation);
    if (journal) {
        journal->flush();
        if (journal->failed())
            problem = std::make_exception_ptr(
                host::UserError(journal->file().string(), "",
                                "the record could not be written to its end; is the disk full?"));
        files.push_back(journal->file());
        cases::write_metrics(options.folder, parts.header, outcome, metrics);
        files.push_back(fs::path(options.folder) / "metrics.csv");
        files.push_back(fs::path(options.folder) / "metrics-dictionary.csv");
    }
    if (video) {
        try {
            video->finish();
            files.push_back(options.video);
            if (video->missed() > 0)
                std::fprintf(stderr, "calot: %zu pictures are missing from the video: drawing was too slow\n",
                             video->missed());
        } catch (...) {
            if (!problem) problem = std::current_exception();
        }
    }
    if (options.as_json)
        std::printf("%s\n", cases::to_json(parts.header, outcome, metrics, files).c_str());
    else
        print_summary(outcome, problem != nullptr, files);
    if (problem) {
        try {
            std::rethrow_exception(problem);
        } catch (const host::PluginError& e) {
            std::fprintf(stderr, "calot: at tick %lld: %s\n", static_cast<long long>(outcome.ticks),
                         e.what());
        } catch (const std::exception& e) {
            std::fprintf(stderr, "calot: %s\n", e.what());
        }
        return plugin_failure;
    }
    if (verifier) return verdict(*verifier, *replay);
    if (replay != nullptr) return completed;
    return outcome.is_completed ? completed : not_completed;
}

} // namespace calot::app
