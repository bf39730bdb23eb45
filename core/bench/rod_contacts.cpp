// Reference problems in contact.
#include "bench/lumen.hpp"
#include "bench/references.hpp"
#include "bench/rod_problems.hpp"
#include "bench/rod_vessel.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::bench {

namespace {

constexpr double pi = std::numbers::pi;

} // namespace

// See rod_vessel.hpp.
std::vector<Row> run_compress(const MakeInstance& make, const RodOptions& o) {
    const double load = o.load.value_or(5);
    PushedRod run(make, o, load, o.friction.value_or(0.05));
    while (run.step()) {
    }
    const UniformRod& uniform = run.uniform();
    const std::string label = setting("seed", static_cast<double>(o.seed));
    Row row = absolute_row("compress", o, uniform, "shortening", run.shortening(), 0,
                           std::abs(run.shortening()), 1e-3, label);
    // Never blocked: it was not tried.
    if (!run.is_blocked())
        row.error = std::numeric_limits<double>::infinity(), row.remark = "was never blocked";
    return {
        row,
        absolute_row("compress", o, uniform, "penetration", run.penetration(), 0, run.penetration(),
                     0.5 * uniform.radius, label),
        absolute_row("compress", o, uniform, "push", run.push(), load, std::max(0.0, run.push() / load - 1),
                     0.01, label),
        plain_row("compress", o, uniform, "insertion", run.rod().output().insertion + uniform.length, label)};
}

// In the x-y plane round a cylinder at the origin: along +x below it, `angle` round it, and on along the
// tangent, farther out by what a stiff rod keeps from it. The base is held back by `load`, the tip is drawn
// at 1 cm/s. The cylinder is so large that stiffness and thickness matter little, unless the length says
// otherwise; then the free parts get at least what their bending needs to die away.
std::vector<Row> run_capstan(const MakeInstance& make, const RodOptions& o) {
    const double mu = o.friction.value_or(0.3), angle = o.angle.value_or(pi / 2);
    UniformRod uniform;
    uniform.radius = 1e-3, uniform.bending = 1e-4, uniform.torsion = 1e-4, uniform.mass_per_length = 0.05;
    uniform = UniformRod::of(o, uniform);
    double back = o.load.value_or(std::max(0.1, std::min(5.0, 100 / std::exp(mu * angle))));
    double cylinder = std::max({0.1, 100 * uniform.radius, std::sqrt(400 * uniform.bending / back)}),
           lead = cylinder;
    if (o.length) {
        // Without a load given, one that the rod is soft to.
        if (!o.load) back = std::max(back, uniform.bending * std::pow((6 + 3 * angle) / uniform.length, 2));
        const double dies_away = std::sqrt(uniform.bending / back);
        lead = std::max(0.1 * uniform.length, 3 * dies_away);
        cylinder = std::clamp((uniform.length - 2 * lead) / angle - uniform.radius, uniform.radius, cylinder);
        lead = 0.5 * std::max(0.0, uniform.length - (cylinder + uniform.radius) * angle);
    }
    const double wound = cylinder + uniform.radius, speed = 0.01;
    if (!o.length) uniform.length = 2 * lead + wound * angle;
    const double stiffness = uniform.bending / (back * wound * wound);
    const StiffCapstan right = stiff_capstan(mu, angle, stiffness);

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
    // No more drag than a five-hundredth of the tension.
    const double mass = uniform.mass_per_length * uniform.length;
    s.drag = std::min(20.0, 0.002 * back / (mass * speed));
    s.bending_damping = 1e-5;
    s.max_contacts = static_cast<std::uint32_t>(uniform.nodes);
    BenchRod rod(make, std::move(s));
    rod.load_base({-back, 0, 0}, {});
    const auto [tip, tip_angle] = place(uniform.length);
    const Vec3 pull{std::cos(angle), std::sin(angle), 0}, outwards{std::sin(angle), -std::cos(angle), 0};
    const double off = 0.5 * wound * stiffness / right.ratio;
    const Quat orientation = axis_angle({0, 0, 1}, tip_angle) * along_x;
    std::vector<calot_contact> contacts;
    double tension = 0, drawn = 0;
    const double duration = 2, measured_from = 1;
    int count = 0;
    while (rod.seconds() < duration) {
        contacts.clear();
        for (int i = 1; i < uniform.nodes; ++i) {
            const Vec3 p = rod.position(i), flat{p.x, p.y, 0};
            const double d = norm(flat), gap = d - wound;
            // The turns lie on each other where there is more than one: each node has its own.
            if (gap > 2e-3 || d < 1e-3 * cylinder) continue;
            contacts.push_back(
                node_contact(rod, i, static_cast<std::uint64_t>(i), cylinder / d * flat, flat / d, gap, mu));
        }
        drawn += speed * std::min(1.0, rod.seconds() / 0.2) * uniform.dt;
        rod.clamp_tip(tip + off * std::min(1.0, rod.seconds() / 0.5) * outwards + drawn * pull, orientation);
        rod.step(contacts);
        if (rod.seconds() < measured_from) continue;
        tension += dot(vec3(rod.output().tip.force), pull);
        ++count;
    }
    Row row = relative_row("capstan", o, uniform, "tension_ratio", tension / count / back, right.ratio, 0.05,
                           setting("mu", mu) + " " + setting("angle", angle));
    const double thick = uniform.radius / cylinder, dies_away = std::sqrt(uniform.bending / back);
    if (thick > 0.05) row.remark = setting("r/R", thick) + " is above 0.05: the rod's thickness counts";
    if (!right.holds || stiffness > 0.5 || lead < 2.5 * dies_away)
        row.unsuited("the rod is too stiff to lie on a drum that it is long enough for: give more --load or "
                     "--length, or less --EI");
    return {row};
}

// A rod of 0.2 m, clamped at its base and heavy. When it hangs still, a rigid wall is put across its tip,
// tilted by 0.2 rad so that the rod gives way by bending (a straight rod that can't shorten has nothing to
// give), and the base is driven along the tip's direction until the wall is pressed with `load`.
std::vector<Row> run_hang_on(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform;
    uniform.nodes = 50, uniform.length = 0.2;
    uniform = UniformRod::of(o, uniform);
    // A clamped rod buckles against a wall that holds its tip at 20.19 EI/L2.
    const double buckles = 20.19 * uniform.bending / (uniform.length * uniform.length);
    const double mu = o.friction.value_or(0.3);
    // Friction holds the tip sideways; without it the rod bends away at an eighth of that.
    const bool is_held = mu >= 0.1;
    const double load = o.load.value_or(std::min(4.77, (is_held ? 0.3 : 0.04) * buckles));
    const double w = uniform.lowest_frequency();
    BenchRod::Setup s;
    s.rod = uniform;
    s.position = straight_line(uniform, {}, along_x);
    s.frame = same_frames(uniform, along_x);
    s.drag = 2 * w;
    s.bending_damping = 1e-5;
    s.max_contacts = 1;
    BenchRod rod(make, std::move(s));
    rod.input.gravity[1] = 9.81;
    rod.clamp_base({}, along_x);
    rod.settle(1e-5 * uniform.length * w, 30 / w);
    const int tip = uniform.nodes - 1;
    const Vec3 hung = rod.position(tip), ahead = normalized(hung - rod.position(tip - 1));
    const Vec3 normal = -1.0 * rotate(axis_angle({0, 0, 1}, is_held ? 0.05 : 0.0), ahead);
    const Vec3 wall = hung - (uniform.radius + 1e-4) * normal;

    double at = 0, felt = 0;
    Vec3 pressed{}, held{};
    // The press is felt over 20 ms, or as slowly as the rod is. The base comes at 0.02 lengths a second, and
    // half as fast each time that it came too far, until the rod's stiffness, which nobody knows, suits it.
    const double slow = std::max(0.02, 0.2 / w);
    double pace = 0.02 * uniform.length;
    bool is_beyond = false;
    const double longest = rod.seconds() + std::max(10.0, 200 / w);
    double right_for = 0;
    const auto press = [&] {
        const Vec3 p = rod.position(tip);
        const double gap = dot(p - wall, normal);
        const calot_contact c = node_contact(rod, tip, 1, p - gap * normal, normal, gap - uniform.radius, mu);
        rod.clamp_base(at * ahead, along_x);
        rod.step({&c, 1});
        return rod.impulse(0) / uniform.dt;
    };
    while (rod.seconds() < longest && right_for < std::max(0.2, 3 / w)) {
        const Vec3 force = press();
        felt += (dot(force, normal) - felt) * uniform.dt / (slow + uniform.dt);
        if ((felt > load) != is_beyond) is_beyond = !is_beyond, pace *= 0.5;
        pace = std::max(pace, 1e-6 * uniform.length);
        at += pace * std::clamp((load - felt) / load, -1.0, 1.0) * uniform.dt;
        right_for = std::abs(felt / load - 1) < 0.002 ? right_for + uniform.dt : 0;
    }
    const int count = std::max(50, static_cast<int>(0.2 / uniform.dt));
    for (int k = 0; k < 2 * count; ++k) {
        const Vec3 force = press();
        if (k < count) continue;
        pressed += force, held += vec3(rod.output().base.force);
    }
    pressed *= 1.0 / count, held *= 1.0 / count;
    const Vec3 weight = Vec3{0, 9.81, 0} * (uniform.mass_per_length * uniform.length),
               expected = -(pressed + weight);
    const double error = norm(held - expected) / norm(expected);
    Row row = absolute_row("hang-on", o, uniform, "base_reaction", norm(held), norm(expected), error, 0.01,
                           setting("load", load));
    const double most = (is_held ? 0.9 : 0.11) * buckles, press_reached = dot(pressed, normal);
    if (load > most) row.unsuited("the rod buckles under this load: at most " + setting("N", most));
    // Never pressed: it was not tried.
    if (press_reached < 0.01 * load) row.error = std::numeric_limits<double>::infinity();
    Row press_row = plain_row("hang-on", o, uniform, "press", press_reached, setting("load", load));
    press_row.reference = load, press_row.error = std::abs(press_reached / load - 1);
    return {row, press_row};
}

} // namespace calot::bench
