// Reference problem of the contact law: a tip against a deformable body.
#include "bench/press_body.hpp"
#include "bench/rod_problems.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace calot::bench {

namespace {

struct Press {
    double deviation = 0; ///< the tip's greatest way from the reference, over its stroke
    double growth =
        0; ///< by how much it swings more in the later half of a hold than in the earlier, over the stroke
    double held_force = 0; ///< N, at the end of the first hold
    double most_force = 0; ///< N, the reference's greatest in a tick
    double farthest = 0;   ///< m, the reference's stroke
};

Press press(const MakeInstance& make, const UniformRod& uniform, const PressScene& scene, double out) {
    // Queries are a tick old: where the tip touches is that of one step ago.
    BenchRod::Setup s;
    s.rod = uniform;
    s.position = straight_line(uniform, {out - uniform.length, 0, 0}, along_x);
    s.frame = same_frames(uniform, along_x);
    s.bending_damping = 1e-5;
    calot_guide guide{};
    guide.present = 1;
    guide.direction[0] = 1;
    s.guide = guide;
    s.max_contacts = 1;
    BenchRod rod(make, std::move(s));
    const int tip = uniform.nodes - 1;
    const double base = out - uniform.length, dt = uniform.dt, rest = out + uniform.radius + scene.gap;
    rod.input.base.mode = CALOT_END_COUPLED;
    rod.input.base.rotation = {0, 0, 1, 0.01, 1};
    PressBody body(scene, dt);
    const PressReference right = press_reference(scene, 1 / dt);

    Press result;
    Vec3 tip_seen = rod.position(tip);
    struct Range {
        double low = HUGE_VAL, high = -HUGE_VAL;
        void add(double v) { low = std::min(low, v), high = std::max(high, v); }
        double size() const { return std::max(0.0, high - low); }
    };
    Range halves[2][2]; // of each hold
    int count = 0;
    for (std::size_t k = 0; k + 1 < right.tool.size(); ++k) {
        const double t = static_cast<double>(k) * dt;
        rod.input.base.insertion = {base + scene.target(t), (scene.target(t + dt) - scene.target(t)) / dt,
                                    scene.drive_stiffness, scene.drive_damping, scene.drive_limit};
        calot_contact c{};
        c.id = 1;
        c.segment = static_cast<std::uint32_t>(tip - 1), c.t = 1;
        store(tip_seen, c.axis_point);
        store(Vec3{rest + body.surface(), tip_seen.y, tip_seen.z}, c.point);
        store(Vec3{rest + body.free_surface(), tip_seen.y, tip_seen.z}, c.free_position);
        c.normal[0] = -1;
        c.gap = rest + body.surface() - tip_seen.x - uniform.radius;
        c.compliance[0] = body.compliance();
        tip_seen = rod.position(tip);
        rod.step({&c, 1});
        const double impulse = -rod.impulse(0).x;
        body.end_tick(impulse);

        const double at = rod.position(tip).x - out, time = t + dt;
        result.farthest = std::max(result.farthest, right.tool[k + 1]);
        result.most_force = std::max(result.most_force, right.force[k + 1]);
        result.deviation = std::max(result.deviation, std::abs(at - right.tool[k + 1]));
        for (int hold = 0; hold < 2; ++hold) {
            const double since = time - (hold == 0 ? 0.4 : 1.5);
            if (since >= 0 && since < 0.4) halves[hold][since < 0.2 ? 0 : 1].add(at);
        }
        if (time > 0.7 && time <= 0.8) result.held_force += impulse / dt, ++count;
    }
    const double stroke = result.farthest;
    result.deviation /= stroke;
    for (const auto& half : halves)
        result.growth = std::max(result.growth, (half[1].size() - half[0].size()) / stroke);
    result.held_force /= std::max(1, count);
    return result;
}

} // namespace

// The rod lies in the guide, a few centimetres of it beyond, so that it stays straight, and is driven through
// the coupling. Bodies of 20 g: soft, 200 N/m, and stiff, 5 kN/m, both damped to a tenth of critical. The
// drive, 2 kN/m, aims as deep as makes the load at rest.
std::vector<Row> run_press(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform;
    uniform.nodes = 40, uniform.length = 0.2;
    uniform = UniformRod::of(o, uniform);
    // What is beyond the guide is so short as not to buckle under four times the load (below): four segments
    // at least, or it is no rod.
    const double four = 4 * uniform.length / (uniform.nodes - 1);
    const double most = 2.47 * uniform.bending / (4 * four * four);
    const double load = o.load.value_or(std::min(4.77, most));
    std::vector<Row> rows;
    std::vector<double> masses{0.05, 0.5};
    if (o.mass_per_length) masses = {*o.mass_per_length};
    for (const double mass : masses)
        for (const double stiffness : {200.0, 5000.0}) {
            UniformRod rod = uniform;
            rod.mass_per_length = mass;
            // What is beyond the guide must not buckle, even under four times the load: a clamped rod with a
            // free end does at 2.47 EI/l2. Bodies and drive are as stiff as keeps the way within that.
            const double reach = std::min(std::sqrt(2.47 * rod.bending / (4 * load)), 0.35 * rod.length);
            const double out = 0.2 * reach;
            PressScene scene;
            scene.tool_mass = mass * rod.length;
            scene.drive_stiffness = std::max(2000.0, 10 * load / reach);
            scene.drive_damping = 1.4 * std::sqrt(scene.drive_stiffness * scene.tool_mass);
            scene.drive_limit = 10 * load;
            scene.body_mass = 0.02;
            scene.body_stiffness = std::max(stiffness, 2 * load / reach);
            if (stiffness == 200 && scene.body_stiffness >= 5000) continue; // the stiff one is as stiff
            scene.body_damping = 0.2 * std::sqrt(scene.body_stiffness * scene.body_mass);
            // The way out and in at 5 Hz asks for at most twice the load, so that the drive keeps the tool on
            // it.
            const double swing = std::numbers::pi * 10;
            scene.gap = std::min({5e-3, 0.1 * reach, 4 * load / (scene.tool_mass * swing * swing)});
            scene.depth = load / scene.body_stiffness + load / scene.drive_stiffness;
            const Press p = press(make, rod, scene, out);
            const std::string label =
                setting("kg", scene.tool_mass) + " " + setting("N/m", scene.body_stiffness);
            const std::size_t first = rows.size();
            rows.push_back(
                absolute_row("press", o, rod, "deviation", p.deviation, 0, p.deviation, 0.05, label));
            rows.push_back(relative_row("press", o, rod, "held_force", p.held_force, load, 0.05, label));
            rows.push_back(
                absolute_row("press", o, rod, "growth", p.growth, 0, std::max(0.0, p.growth), 1e-4, label));
            const double beyond = out + p.farthest, buckling = 2.47 * rod.bending / (beyond * beyond);
            std::string why;
            if (load > 2 * most)
                why =
                    "what is short enough not to buckle under this load is shorter than three segments: give "
                    "less than " +
                    setting("N", most) + ", or more --nodes";
            else if (p.most_force > buckling)
                why = "what is beyond the guide buckles at " + setting("N", buckling) +
                      ", and the body is hit with " + setting("N", p.most_force) +
                      ": give less --mass-per-length or more --EI";
            if (why.empty()) continue;
            for (Row& row : std::span(rows).subspan(first))
                row.unsuited(why);
        }
    return rows;
}

} // namespace calot::bench
