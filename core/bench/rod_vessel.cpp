#include "bench/rod_vessel.hpp"

#include "bench/cpu_clock.hpp"
#include "bench/rod_problems.hpp"
#include "plot/beads.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

namespace calot::bench {

namespace {

// A thicker rod has the whole scene larger: under the same push it keeps its shape if EI goes as the square.
double scale_of(double radius) {
    return std::max(1.0, radius / 1e-3);
}

UniformRod catheter(const RodOptions& o) {
    const double scale = scale_of(o.radius.value_or(1e-3));
    UniformRod rod;
    rod.nodes = 256, rod.length = 0.255 * scale, rod.radius = 1e-3;
    rod.bending = rod.torsion = 1e-4 * scale * scale, rod.mass_per_length = 0.1;
    return UniformRod::of(o, rod);
}

std::vector<Vec3> vessel(std::uint64_t seed, double length, double scale) {
    Random random(seed);
    std::vector<Vec3> axis = Lumen::random_axis(random, length / scale, 0.02);
    for (Vec3& p : axis)
        p *= scale;
    return axis;
}

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

std::string short_name(const std::string& id) {
    return id.substr(id.rfind('.') + 1);
}

plot::BeadString beads(const PushedRod& run, const std::string& title) {
    plot::BeadString out{.title = title, .radius = run.uniform().radius};
    for (int i = 0; i < run.rod().nodes(); ++i)
        out.beads.push_back({run.rod().position(i), run.is_colliding(i)});
    return out;
}

} // namespace

BenchRod::Setup PushedRod::setup(const UniformRod& uniform) {
    BenchRod::Setup s;
    s.rod = uniform;
    s.position = straight_line(uniform, {-uniform.length, 0, 0}, along_x);
    s.frame = same_frames(uniform, along_x);
    s.drag = 20 * std::pow(scale_of(uniform.radius), -1.5); // a fiftieth of the push, whatever the scale
    calot_guide guide{};
    guide.present = 1;
    guide.direction[0] = 1;
    s.guide = guide;
    s.max_contacts = static_cast<std::uint32_t>(uniform.nodes + 1);
    return s;
}

PushedRod::PushedRod(const MakeInstance& make, const RodOptions& o, double load, double friction)
    : uniform_(catheter(o)), scale_(scale_of(uniform_.radius)),
      axis_(vessel(o.seed, 0.8 * uniform_.length, scale_)), lumen_(axis_, vessel_radius(), true, friction),
      rod_(make, setup(uniform_)), colliding_(static_cast<std::size_t>(uniform_.nodes), false), load_(load),
      speed_(0.2 * std::sqrt(scale_)), longest_(0.8 * uniform_.length / speed_ + 1.0),
      shortest_(uniform_.length) {
    rod_.input.base.mode = CALOT_END_COUPLED;
    rod_.input.base.insertion = {-uniform_.length, speed_, 2000, 20, load};
    rod_.input.base.rotation = {0, 0, 1, 0.01, 1};
}

bool PushedRod::step() {
    if (rod_.seconds() >= longest_ || is_blocked()) return false;
    double looking_up = 0;
    std::span<const calot_contact> contacts;
    const auto find = [&] {
        const double start = cpu_seconds();
        contacts = lumen_.contacts(rod_);
        for (const calot_contact& c : contacts)
            penetration_ = std::max(penetration_, -c.gap);
        looking_up += cpu_seconds() - start;
        return contacts;
    };
    const double start = cpu_seconds();
    rod_.step_in_parts(find, scale_ * holds_for_);
    step_seconds_ = cpu_seconds() - start - looking_up;
    std::fill(colliding_.begin(), colliding_.end(), false);
    for (std::size_t k = 0; k < contacts.size(); ++k)
        if (norm(rod_.impulse(k)) > 0) colliding_[contacts[k].segment + 1] = true;
    rod_.input.base.insertion.target += speed_ * uniform_.dt;
    shortest_ = std::min(shortest_, rod_.arc_length());
    pressed_ = std::max(pressed_, rod_.output().insertion_force);
    if (rod_.output().insertion_force > 0.99 * load_) blocked_for_ += uniform_.dt;
    return true;
}

std::vector<Row> run_vessel(const std::vector<VesselModel>& models, const RodOptions& o,
                            const std::filesystem::path& picture) {
    const double load = o.load.value_or(10), friction = o.friction.value_or(0.05);
    std::vector<std::unique_ptr<PushedRod>> runs;
    std::vector<std::vector<double>> times(models.size());
    runs.reserve(models.size());
    for (const VesselModel& m : models)
        runs.push_back(std::make_unique<PushedRod>(m.make, o, load, friction));
    for (bool is_going = true; is_going;) {
        is_going = false;
        for (std::size_t k = 0; k < runs.size(); ++k)
            if (runs[k]->step()) {
                is_going = true;
                times[k].push_back(runs[k]->seconds_of_step());
            }
    }
    std::vector<Row> rows;
    std::vector<plot::BeadString> strings;
    for (std::size_t k = 0; k < runs.size(); ++k) {
        const PushedRod& run = *runs[k];
        RodOptions of = o;
        of.model = models[k].id;
        const std::string label = setting("load", load) + " " + setting("seed", static_cast<double>(o.seed));
        const double percent = 100 * run.shortening(), ms = 1e3 * median(times[k]) * 1e-3 / run.uniform().dt;
        int colliding = 0;
        for (int i = 0; i < run.uniform().nodes; ++i)
            colliding += run.is_colliding(i) ? 1 : 0;
        const auto add = [&](const char* quantity, double value) {
            rows.push_back(plain_row("vessel", of, run.uniform(), quantity, value, label));
        };
        add("compression_percent", percent);
        add("ms_per_simulated_ms", ms);
        add("colliding_nodes", colliding);
        add("push", run.push());
        add("insertion", run.rod().output().insertion + run.uniform().length);
        add("penetration", run.penetration());
        add("blocked", run.is_blocked() ? 1 : 0);
        char title[160];
        // Deeper than this in the wall, it has found a way out: its length says nothing then.
        if (run.penetration() > 1e-3)
            std::snprintf(title, sizeof title, "%s: left the vessel", short_name(of.model).c_str());
        else
            std::snprintf(title, sizeof title, "%s: %.2f %% shorter, %.2f ms a simulated ms",
                          short_name(of.model).c_str(), percent, ms);
        strings.push_back(beads(run, title));
    }
    if (!picture.empty() && !runs.empty())
        plot::draw({runs[0]->axis(), runs[0]->vessel_radius()}, strings, picture);
    return rows;
}

} // namespace calot::bench
