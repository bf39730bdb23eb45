// Reference problems in contact.
#include "bench/lumen.hpp"
#include "bench/rod_problems.hpp"
#include "bench/rod_vessel.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::bench {

namespace {

constexpr double pi = std::numbers::pi;

calot_guide guide_along_x() {
    calot_guide g{};
    g.present = 1;
    g.direction[0] = 1;
    return g;
}

} // namespace

// See rod_vessel.hpp.
std::vector<Row> run_compress(const MakeInstance& make, const RodOptions& o) {
    PushedRod run(make, o, o.load.value_or(5), o.friction.value_or(0.05));
    while (run.step()) {
    }
    const UniformRod& uniform = run.uniform();
    const std::string label = setting("seed", static_cast<double>(o.seed));
    Row row = absolute_row("compress", o, uniform, "shortening", run.shortening(), 0,
                           std::abs(run.shortening()), 1e-3, label);
    // Never blocked: it was not tried.
    if (!run.is_blocked()) row.error = std::numeric_limits<double>::max();
    return {
        row, plain_row("compress", o, uniform, "push", run.push(), label),
        plain_row("compress", o, uniform, "insertion", run.rod().output().insertion + uniform.length, label),
        plain_row("compress", o, uniform, "penetration", run.penetration(), label)};
}

// In the x-y plane round a cylinder at the origin: along +x below it, `angle` round it, and on along the
// tangent. The base is held back by `load`, the tip is drawn at 1 cm/s.
std::vector<Row> run_capstan(const MakeInstance& make, const RodOptions& o) {
    const double cylinder = 0.1, mu = o.friction.value_or(0.3), angle = o.angle.value_or(pi / 2), lead = 0.1;
    UniformRod uniform;
    uniform.radius = o.radius.value_or(3e-3);
    const double wound = cylinder + uniform.radius;
    uniform.length = 2 * lead + wound * angle;
    uniform.bending = 1e-4, uniform.torsion = 1e-4, uniform.mass_per_length = 0.05;
    RodOptions rest = o;
    rest.length.reset(); // the winding fixes it
    uniform = UniformRod::of(rest, uniform);
    const double back = o.load.value_or(5), speed = 0.01;

    BenchRod::Setup s;
    s.rod = uniform;
    const auto place = [&](double along) {
        const double a = std::clamp((along - lead) / wound, 0.0, angle),
                     on = std::max(0.0, along - lead - wound * angle);
        const Vec3 t{std::cos(a), std::sin(a), 0};
        return std::pair{
            Vec3{wound * std::sin(a) + std::min(along - lead, 0.0), -wound * std::cos(a), 0} + on * t, a};
    };
    const double l = uniform.length / (uniform.nodes - 1);
    for (int i = 0; i < uniform.nodes; ++i) {
        const auto [p, a] = place(i * l);
        s.position.insert(s.position.end(), {p.x, p.y, p.z});
        if (i == uniform.nodes - 1) break;
        const Quat q = axis_angle({0, 0, 1}, place((i + 0.5) * l).second) * along_x;
        s.frame.insert(s.frame.end(), {q.w, q.x, q.y, q.z});
    }
    s.drag = 20;
    s.max_contacts = static_cast<std::uint32_t>(uniform.nodes);
    BenchRod rod(make, std::move(s));
    rod.load_base({-back, 0, 0}, {});
    const auto [tip, tip_angle] = place(uniform.length);
    const Vec3 pull{std::cos(angle), std::sin(angle), 0};
    const Quat orientation = axis_angle({0, 0, 1}, tip_angle) * along_x;
    std::vector<calot_contact> contacts;
    double tension = 0;
    const double duration = 2, measured_from = 1;
    int count = 0;
    while (rod.seconds() < duration) {
        contacts.clear();
        for (int i = 1; i < uniform.nodes; ++i) {
            const Vec3 p = rod.position(i), flat{p.x, p.y, 0};
            const double d = norm(flat), gap = d - wound;
            if (gap > 2e-3) continue;
            contacts.push_back(
                node_contact(rod, i, static_cast<std::uint64_t>(i), cylinder / d * flat, flat / d, gap, mu));
        }
        rod.clamp_tip(tip + (speed * (rod.seconds() + uniform.dt)) * pull, orientation);
        rod.step(contacts);
        if (rod.seconds() < measured_from) continue;
        tension += dot(vec3(rod.output().tip.force), pull);
        ++count;
    }
    return {relative_row("capstan", o, uniform, "tension_ratio", tension / count / back, std::exp(mu * angle),
                         0.05, setting("mu", mu) + " " + setting("angle", angle))};
}

// A rod of 0.2 m, clamped at its base and heavy, whose tip is driven against a wall across it until it
// presses with `load`.
std::vector<Row> run_hang_on(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform;
    uniform.nodes = 50, uniform.length = 0.2;
    uniform = UniformRod::of(o, uniform);
    const double load = o.load.value_or(4.77), mu = o.friction.value_or(0.3),
                 wall = uniform.length + uniform.radius + 1e-3;
    BenchRod::Setup s;
    s.rod = uniform;
    s.position = straight_line(uniform, {}, along_x);
    s.frame = same_frames(uniform, along_x);
    s.drag = 2 * uniform.lowest_frequency();
    s.bending_damping = 1e-5;
    s.max_contacts = 1;
    BenchRod rod(make, std::move(s));
    rod.input.gravity[1] = 9.81;
    double at = 0, felt = 0;
    Vec3 pressed{}, held{};
    const double duration = 4, measured_from = 3.8;
    int count = 0;
    const int tip = uniform.nodes - 1;
    while (rod.seconds() < duration) {
        const Vec3 p = rod.position(tip);
        const calot_contact c =
            node_contact(rod, tip, 1, {wall, p.y, p.z}, {-1, 0, 0}, wall - p.x - uniform.radius, mu);
        rod.clamp_base({at, 0, 0}, along_x);
        rod.step({&c, 1});
        const Vec3 force = rod.impulse(0) / uniform.dt;
        felt += (-force.x - felt) * uniform.dt / 0.02;
        if (rod.seconds() < measured_from - 0.5)
            at += std::clamp(1e-3 * (load - felt) / load, -1e-3, 1e-3) * uniform.dt;
        if (rod.seconds() < measured_from) continue;
        pressed += force, held += vec3(rod.output().base.force);
        ++count;
    }
    pressed *= 1.0 / count, held *= 1.0 / count;
    const Vec3 weight = Vec3{0, 9.81, 0} * (uniform.mass_per_length * uniform.length),
               expected = -(pressed + weight);
    const double error = norm(held - expected) / norm(expected);
    return {absolute_row("hang-on", o, uniform, "base_reaction", norm(held), norm(expected), error, 0.01,
                         setting("load", load)),
            relative_row("hang-on", o, uniform, "press", -pressed.x, load, 0.05, setting("load", load))};
}

// Turned by a full turn inside a tube bent by `angle`, at friction 0, half of `friction` and all of it.
std::vector<Row> run_torque_lag(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform;
    uniform.nodes = 60, uniform.length = 0.6;
    uniform = UniformRod::of(o, uniform);
    const double most = o.friction.value_or(0.4), angle = o.angle.value_or(pi / 2), bend = 0.1;
    const double mouth = 0.1 * uniform.length, rate = pi;
    std::vector<Row> rows;
    double former = -std::numeric_limits<double>::infinity();
    bool is_monotone = true;
    for (const double mu : {0.0, most / 2, most}) {
        const double tube = uniform.radius + 2e-3, lead = 0.3 * uniform.length;
        const auto axis = Lumen::bend(lead, bend, angle, uniform.length);
        Lumen lumen(axis, tube, false, mu);
        BenchRod::Setup s;
        s.rod = uniform;
        // Laid along the tube's axis, the first tenth in the guide.
        const double l = uniform.length / (uniform.nodes - 1);
        const auto place = [&](double along) {
            const double a = std::clamp((along - lead) / bend, 0.0, angle),
                         on = std::max(0.0, along - lead - bend * angle);
            return std::pair{Vec3{std::min(along, lead) + bend * std::sin(a) + on * std::cos(a),
                                  bend * (1 - std::cos(a)) + on * std::sin(a), 0},
                             a};
        };
        for (int i = 0; i < uniform.nodes; ++i) {
            const Vec3 p = place(i * l - mouth).first;
            s.position.insert(s.position.end(), {p.x, p.y, p.z});
            if (i == uniform.nodes - 1) break;
            const Quat q = axis_angle({0, 0, 1}, place((i + 0.5) * l - mouth).second) * along_x;
            s.frame.insert(s.frame.end(), {q.w, q.x, q.y, q.z});
        }
        s.drag = 10;
        s.bending_damping = 1e-5;
        s.guide = guide_along_x();
        s.max_contacts = static_cast<std::uint32_t>(uniform.nodes + 1);
        BenchRod rod(make, std::move(s));
        rod.input.base.mode = CALOT_END_COUPLED;
        rod.input.base.insertion = {-mouth, 0, 5000, 50, 50};
        rod.input.base.rotation = {0, 0, 50, 0.5, 5};
        while (rod.seconds() < 0.5)
            rod.step(lumen.contacts(rod)); // finds its place in the tube
        const double before = end_twist(rod, rod.frame(0));
        while (rod.seconds() < 0.5 + 2 * pi / rate) {
            rod.input.base.rotation.velocity = rate;
            rod.step(lumen.contacts(rod));
            rod.input.base.rotation.target += rate * uniform.dt;
        }
        const double lag = before - end_twist(rod, rod.frame(0));
        rows.push_back(plain_row("torque-lag", o, uniform, "lag", lag,
                                 setting("mu", mu) + " " + setting("angle", angle)));
        is_monotone = is_monotone && lag > former;
        former = lag;
    }
    rows.push_back(
        absolute_row("torque-lag", o, uniform, "monotone", is_monotone ? 1 : 0, 1, is_monotone ? 0 : 1, 0));
    return rows;
}

} // namespace calot::bench
