// calot run, calot replay
#include "app/case_folder.hpp"
#include "app/case_process.hpp"
#include "app/commands.hpp"
#include "app/supervisor.hpp"
#include "host/error.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <thread>
#include <vector>

namespace calot::app {
namespace {

unsigned default_threads() {
    return std::clamp(std::thread::hardware_concurrency(), 1u, 2u);
}

struct Options {
    CaseOptions wanted;
    std::vector<std::string> anatomy;     // NAME or ORGAN=FILE
    std::vector<std::string> instruments; // CHANNEL=NAME
    std::string speed;
    std::string record; // of a replay
};

// A datasheet's file by its whole path, so that a replay finds it from another folder; a name stays one.
std::string lasting(const std::string& word) {
    const bool is_file = word.find('/') != std::string::npos || word.ends_with(".toml");
    return is_file ? std::filesystem::absolute(word).string() : word;
}

int run(const Options& given) {
    CaseOptions options = given.wanted;
    for (const std::string& entry : given.anatomy) {
        const std::size_t equals = entry.find('=');
        if (equals == std::string::npos)
            options.anatomy = entry;
        else // absolute, so that a replay finds it from another folder
            options.meshes[entry.substr(0, equals)] =
                std::filesystem::absolute(entry.substr(equals + 1)).string();
    }
    for (const std::string& entry : given.instruments) {
        const std::size_t equals = entry.find('=');
        if (equals == std::string::npos)
            throw host::UserError("--instrument", entry, "must be CHANNEL=NAME, for example 1=forceps");
        options.instruments[entry.substr(0, equals)] = lasting(entry.substr(equals + 1));
    }
    options.endoscope = lasting(options.endoscope);
    if (!given.speed.empty())
        options.is_realtime = given.speed == "realtime";
    else
        options.is_realtime = !options.is_headless;
    if (options.is_headless && options.time_limit == 0) options.time_limit = 600;
    if (options.folder.empty()) options.folder = new_case_folder(options.procedure, options.seed).string();
    return supervise([&](CaseShared& shared) { return run_case(options, nullptr, shared); }, options.as_json);
}

int replay(const Options& given) {
    return supervise(
        [&](CaseShared& shared) {
            const cases::Journal journal = cases::read_journal(given.record);
            const cases::CaseHeader& header = journal.header;
            CaseOptions options = given.wanted;
            options.procedure = header.procedure;
            options.rod = header.rod;
            options.endoscope = header.endoscope;
            options.anatomy = header.anatomy;
            options.start = header.start;
            options.until = header.until;
            options.operator_code = header.operator_code;
            options.seed = header.seed;
            const auto skill = header.options.find("skill");
            if (skill != header.options.end()) options.skill = skill->second;
            for (const auto& [key, value] : header.options)
                if (key.starts_with("mesh/"))
                    options.meshes[key.substr(5)] = value;
                else if (key.starts_with("instrument/"))
                    options.instruments[key.substr(11)] = value;
            options.is_headless = options.is_headless || options.verify || !options.video.empty();
            options.is_realtime = !options.is_headless;
            return run_case(options, &journal, shared);
        },
        given.wanted.as_json);
}

void add_common(CLI::App& command, const std::shared_ptr<Options>& o) {
    command
        .add_option("--threads", o->wanted.threads,
                    "threads of the physics; the result does not depend on it")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    command.add_flag("--headless", o->wanted.is_headless, "without a window");
    command.add_option("--video", o->wanted.video, "write both views to this MP4 file")->type_name("FILE");
    command.add_flag("--json", o->wanted.as_json, "print one JSON object");
}

} // namespace

void add_run(CLI::App& app, Action& action) {
    const auto o = std::make_shared<Options>();
    o->wanted.threads = default_threads();
    CLI::App* command = app.add_subcommand("run", "Perform a procedure");
    command->add_option("ID", o->wanted.procedure, "id of the procedure (calot list procedure)")->required();
    command
        ->add_option("--device", o->wanted.device,
                     "what the operator's hands hold; keyboard and mouse unless given")
        ->type_name("ID");
    command
        ->add_option("--rod", o->wanted.rod, "mechanics of the shaft; the first real-time model unless given")
        ->type_name("ID");
    command
        ->add_option("--endoscope", o->wanted.endoscope,
                     "a datasheet in assets/endoscopes, or a file; the procedure's unless given")
        ->type_name("NAME|FILE");
    command
        ->add_option("--instrument", o->instruments,
                     "what lies in a working channel (1 is the first) and stiffens the shaft: a datasheet in "
                     "assets/instruments, or a file; may be given several times")
        ->type_name("CHANNEL=NAME|FILE");
    command
        ->add_option(
            "--anatomy", o->anatomy,
            "an anatomy in assets, the procedure's unless given; or the mesh of one organ (GLB, OBJ, STL, "
            "PLY); may be given several times")
        ->type_name("NAME|ORGAN=FILE");
    command->add_option("--pose", o->wanted.start, "one of the scene's start poses")->capture_default_str();
    command->add_option("--until", o->wanted.until, "end, and succeed, when this task is completed")
        ->type_name("TASK");
    command->add_option("--seed", o->wanted.seed, "draws the start pose and the virtual operator's noise")
        ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{std::numeric_limits<std::int64_t>::max()}))
        ->capture_default_str();
    command
        ->add_option("--operator", o->wanted.operator_code,
                     "code of who performs it, for the record; no name")
        ->type_name("CODE");
    command->add_option("--skill", o->wanted.skill, "of the virtual operator")
        ->check(CLI::IsMember({"expert", "novice"}))
        ->capture_default_str();
    command->add_option("--speed", o->speed, "realtime, or max (unless given with --headless)")
        ->check(CLI::IsMember({"realtime", "max"}));
    command
        ->add_option("--time-limit", o->wanted.time_limit,
                     "end after that much simulated time; 600 with --headless, otherwise none")
        ->check(CLI::Range(0.001, 86400.0))
        ->type_name("SECONDS");
    command->add_option("--out", o->wanted.folder, "new folder for every file of the case")->type_name("DIR");
    add_common(*command, o);
    command->footer(examples({"calot run org.calot.transgastric-cholecystectomy",
                              "calot run org.calot.transgastric-cholecystectomy --device "
                              "org.calot.virtual-operator --headless --seed 7",
                              "    the virtual operator performs it as fast as this machine can",
                              "calot run org.calot.transgastric-cholecystectomy --until navigation --out "
                              "~/cases/p07-1 --operator p07"}));
    command->callback([o, &action] { action = [o] { return run(*o); }; });
}

void add_replay(CLI::App& app, Action& action) {
    const auto o = std::make_shared<Options>();
    o->wanted.threads = default_threads();
    CLI::App* command = app.add_subcommand("replay", "Show a recorded case again, or verify it");
    command->add_option("CASE", o->record, "folder of the case, or its case.calot")->required();
    command->add_flag("--verify", o->wanted.verify, "run it again without a window and compare every tick");
    add_common(*command, o);
    command->footer(examples({"calot replay ~/cases/p07-1", "calot replay ~/cases/p07-1 --verify",
                              "calot replay ~/cases/p07-1 --video p07-1.mp4"}));
    command->callback([o, &action] { action = [o] { return replay(*o); }; });
}

} // namespace calot::app
