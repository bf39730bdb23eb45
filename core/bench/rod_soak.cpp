// push-soak: the shaft in anatomy, pushed, pulled, turned and steered as roughly as the devices allow.
#include "bench/rod_soak.hpp"

#include "bench/rod_problems.hpp"
#include "bench/rough_hands.hpp"
#include "bench/soak_judge.hpp"
#include "bench/watch.hpp"
#include "host/error.hpp"
#include "simulation/assets.hpp"
#include "simulation/endoscope_chain.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

namespace calot::bench {

namespace {

std::string scene_text(const std::string& anatomy, const std::string& endoscope, double insertion,
                       double spread) {
    return "format = 1\nanatomy = \"" + anatomy + "\"\nendoscope = \"" + endoscope +
           "\"\n[start.default]\npath = \"path\"\ninsertion = " + std::to_string(insertion) +
           "\ninsertion_spread = " + std::to_string(spread) + "\nrotation_spread = 3.1\n";
}

// The datasheet with what the options give: EI and GJ of the shaft's last segment before the bending section,
// the others in proportion.
void change(simulation::EndoscopeDatasheet& sheet, const RodOptions& o) {
    const auto bends = std::find_if(sheet.segments.begin(), sheet.segments.end(),
                                    [](const simulation::ShaftSegment& s) { return s.bends; });
    const simulation::ShaftSegment& shaft = bends == sheet.segments.begin() ? *bends : *(bends - 1);
    const double bending = o.bending.value_or(0) / shaft.flexural_rigidity.to,
                 torsion = o.torsion.value_or(0) / shaft.torsional_rigidity.to;
    double longer = 1;
    if (o.length) {
        const double rest = sheet.working_length - sheet.bending_length();
        if (*o.length < sheet.bending_length() + 0.1)
            throw host::UserError("--length", "",
                                  "must leave room for the bending section and 0.1 m of shaft");
        longer = (*o.length - sheet.bending_length()) / rest;
        sheet.working_length = *o.length;
    }
    for (simulation::ShaftSegment& s : sheet.segments) {
        for (double* v : {&s.flexural_rigidity.from, &s.flexural_rigidity.to})
            *v *= o.bending ? bending : 1;
        for (double* v : {&s.torsional_rigidity.from, &s.torsional_rigidity.to})
            *v *= o.torsion ? torsion : 1;
        s.mass_per_length = o.mass_per_length.value_or(s.mass_per_length);
        s.outer_radius = o.radius.value_or(s.outer_radius);
        if (!s.bends) s.length *= longer;
    }
}

// Ends a case that takes longer by the clock than `seconds`, or that is interrupted; tells how far it is.
class Patience : public simulation::Observer {
  public:
    Patience(simulation::Simulation& simulation, double seconds, std::int64_t ticks)
        : simulation_(simulation),
          end_(std::chrono::steady_clock::now() + std::chrono::milliseconds(std::llround(1e3 * seconds))),
          ticks_(ticks) {}
    void ticked(const simulation::Snapshot& s) override {
        share_done = static_cast<double>(s.tick) / static_cast<double>(ticks_);
        if (Interruptible::was_interrupted() || std::chrono::steady_clock::now() >= end_) simulation_.stop();
    }

  private:
    simulation::Simulation& simulation_;
    std::chrono::steady_clock::time_point end_;
    std::int64_t ticks_;
};

} // namespace

std::shared_ptr<simulation::World> load_soak_world(const std::string& anatomy, const std::string& endoscope,
                                                   std::optional<double> friction) {
    if (anatomy.empty() || anatomy.find_first_of("/\\\"\n") != std::string::npos)
        throw host::UserError("--anatomy", "", "must be the name of a folder of assets/anatomy");
    const bool is_colon = anatomy == "colon";
    simulation::WorldOptions options;
    options.assets = simulation::find_assets();
    options.friction = friction;
    if (!std::filesystem::exists(options.assets / "anatomy" / anatomy / "anatomy.toml")) {
        std::string known;
        for (const auto& folder : std::filesystem::directory_iterator(options.assets / "anatomy"))
            if (std::filesystem::exists(folder.path() / "anatomy.toml"))
                known += (known.empty() ? "" : ", ") + folder.path().filename().string();
        throw host::UserError("--anatomy", "",
                              "no anatomy is called \"" + anatomy + "\"; there are " + known);
    }
    std::string name = is_colon ? "colonoscope" : "gif-2t160";
    if (!endoscope.empty())
        options.endoscope =
            simulation::find_datasheet(options.assets / "endoscopes", endoscope, "--endoscope");
    const std::string text =
        is_colon ? scene_text(anatomy, name, 0.65, 0.5) : scene_text(anatomy, name, 0.22, 0.1);
    auto world = std::make_shared<simulation::World>(
        *simulation::load_world(simulation::parse_scene(text, "scene"), options));
    // Never more inside at the start than the path and the shaft are long.
    simulation::StartPose& start = world->scene.starts.front();
    const double most = std::min(path_length(*world), world->endoscope.working_length) - 0.03;
    if (start.insertion + start.insertion_spread > most)
        start.insertion = start.insertion_spread = 0.5 * most;
    start.insertion_spread = std::min(start.insertion_spread, start.insertion - 0.03);
    return world;
}

double path_length(const simulation::World& world) {
    const auto& points = world.anatomy.find("path")->points;
    double sum = 0;
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
        sum += norm(points[i + 1] - points[i]);
    return sum;
}

std::vector<Row> run_push_soak(const MakeInstance& make, const RodOptions& o) {
    const auto world = load_soak_world(o.anatomy, o.endoscope, o.friction);
    change(world->endoscope, o);
    const double seconds = o.duration.value_or(10);

    const host::Instance rod = make();
    RoughHands::Limits limits;
    if (o.angle) limits.rotation_angle = limits.wheel_angle = *o.angle;
    RoughHands hands(o.seed, limits);
    simulation::Setup setup;
    setup.world = world;
    setup.rod = {rod.id(), rod.abi()};
    setup.replay = &hands;
    setup.seed = o.seed;
    setup.threads = 1;
    setup.nodes = o.nodes ? static_cast<std::uint32_t>(*o.nodes) : simulation::usual_nodes(world->endoscope);
    if (o.load) setup.max_force = *o.load;

    Row like;
    like.problem = "push-soak", like.model = o.model, like.nodes = static_cast<int>(setup.nodes),
    like.dt = 1e-3;
    like.setting = o.anatomy + " " + setting("seed", static_cast<double>(o.seed));
    SoakJudge judge(*world, 10);
    try {
        simulation::Simulation simulation(setup);
        simulation.add_observer(judge);
        const Interruptible until_interrupted;
        const std::int64_t ticks = std::llround(seconds * 1000);
        Patience patience(simulation, o.patience.value_or(1e6), ticks);
        simulation.add_observer(patience);
        if (o.patience) like.setting += ", at most " + setting("s by the clock", *o.patience);
        simulation.run({.max_ticks = ticks});
        if (Interruptible::was_interrupted()) like.setting += ", interrupted";
    } catch (const host::PluginError& error) {
        // The run ends here: its duration falls short, and the row says why.
        like.setting += ", " + error.function + ": " + error.field + ": " + error.message;
    }
    return judge.rows(like, std::round(seconds * 1000) * 1e-3);
}

} // namespace calot::bench
