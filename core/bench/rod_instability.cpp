// Reference problems of twist: when a rod leaves its shape.
#include "bench/rod_problems.hpp"
#include "bench/self_contact.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>

namespace calot::bench {

namespace {

constexpr double pi = std::numbers::pi;

// A rod with a small, stated fault, whose load can be set and whose answer to the fault can be read, at rest.
struct Answer {
    double load = 0, size = 0;
};

// R. V. Southwell (1932): close to the critical load the answer to a fault grows as 1 / (critical - load), so
// its inverse, drawn over the load's square (the answer is even in a twist), is a line to the critical
// load's. `hold` sets what makes the load to so much of a unit, waits for rest, and says what the load is and
// how large the answer. Each two answers foretell the critical load; the next goes part of the way there,
// until the answer is eight times what it is without a load.
struct Critical {
    double factor = std::numeric_limits<double>::quiet_NaN(); // of the unit; NaN: none was found
    double load = std::numeric_limits<double>::quiet_NaN();   // where the line ends
    double unloaded = 0;                                      // answer without a load
};

Critical southwell(const std::function<Answer(double factor)>& hold) {
    Answer last = hold(0);
    Critical found;
    found.unloaded = last.size;
    double at = 0, next = 0.4, too_far = HUGE_VAL;
    for (int k = 0; k < 20; ++k) {
        const Answer now = hold(next);
        if (!std::isfinite(now.size)) return {};
        if (now.size > 100 * found.unloaded) { // gone past it: back, and half as far
            too_far = next;
            hold(0);
            next = 0.5 * (at + next);
            continue;
        }
        const double x0 = last.load * last.load, x1 = now.load * now.load;
        const double slope = (1 / now.size - 1 / last.size) / (x1 - x0);
        const double f0 = at * at, f1 = next * next;
        at = next, last = now;
        if (slope < 0 && now.size > 1.05 * found.unloaded) {
            const double end = x1 - 1 / now.size / slope;
            found.load = std::sqrt(end);
            found.factor = std::sqrt(f1 + (f1 - f0) * (end - x1) / (x1 - x0));
            if (now.size > 8 * found.unloaded) break;
            const double share = now.size > 2 * found.unloaded ? 0.7 : 0.5;
            next = std::min(1.5 * at, std::sqrt(f1 + share * (found.factor * found.factor - f1)));
        } else {
            next = 1.5 * at; // nothing is heard of the critical load yet
        }
        if (next >= too_far) next = 0.5 * (at + too_far);
    }
    return found;
}

// The lowest frequency between two clamps is 22.37 sqrt(EI / (rhoA L^4)).
double clamped_frequency(const UniformRod& rod) {
    return 22.37 / 3.516 * rod.lowest_frequency();
}

// Calls `step` for `time`, then for spells of `spell` until `size` stays within 2e-4 from one to the next.
void wait(BenchRod& rod, const std::function<void()>& step, const std::function<double()>& size, double time,
          double spell) {
    const auto run = [&](double s) {
        for (const double end = rod.seconds() + s; rod.seconds() < end;)
            step();
    };
    run(time);
    double before = size();
    int quiet = 0;
    for (int k = 0; k < 150 && quiet < 2; ++k) {
        run(spell);
        const double now = size();
        quiet = std::abs(now - before) < 2e-4 * now ? quiet + 1 : 0;
        before = now;
    }
}

// Past the critical load the rod must go on and on.
bool leaves(BenchRod& rod, const std::function<void()>& step, const std::function<double()>& size,
            double enough, double time) {
    for (const double end = rod.seconds() + time; rod.seconds() < end && size() < enough;)
        step();
    return size() >= enough;
}

// So many that there is no more than a third of a radian of twist from segment to segment.
int enough_nodes(double twist) {
    return static_cast<int>(std::clamp(3 * twist, 60.0, 400.0));
}

// Segments that twist by more than half a radian are too coarse for any model.
void judge_mesh(std::span<Row> rows, const UniformRod& rod, double twist) {
    const double each = twist / (rod.nodes - 1);
    if (each < 0.5) return;
    for (Row& row : rows)
        row.unsuited(setting("rad of twist per segment", each) + ": too coarse, give more --nodes");
}

double smooth(double s) {
    s = std::clamp(s, 0.0, 1.0);
    return s * s * (3 - 2 * s);
}

} // namespace

// The base lies in the guide, turned by the coupling and free to slide; the tip is clamped. The fault: a
// lateral weight that bends the rod by 2e-5 of its length.
std::vector<Row> run_buckle(const MakeInstance& make, const RodOptions& o) {
    const UniformRod part = UniformRod::at_rest(o, {.nodes = 60});
    const double l = part.length / (part.nodes - 1), w = clamped_frequency(part);
    // A few segments stay in the guide and are drawn out as the rod buckles.
    const int spare = std::max(4, part.nodes / 5);
    UniformRod uniform = part;
    uniform.nodes += spare, uniform.length += spare * l;
    BenchRod::Setup s;
    s.rod = uniform;
    s.position = straight_line(uniform, {-spare * l, 0, 0}, along_x);
    s.frame = same_frames(uniform, along_x);
    s.drag = w;
    calot_guide guide{};
    guide.present = 1;
    guide.direction[0] = 1;
    s.guide = guide;
    BenchRod rod(make, std::move(s));
    rod.clamp_tip({part.length, 0, 0}, along_x);
    rod.input.gravity[1] = 384 * 2e-5 * part.bending / std::pow(part.length, 3) / part.mass_per_length;
    rod.input.base.mode = CALOT_END_COUPLED;
    rod.input.base.insertion.limit = 1;
    calot_coupling& turn = rod.input.base.rotation;
    turn = {0, 0, 100 * uniform.torsion / uniform.length, 0.01 * uniform.torsion / uniform.length, 1e6};

    // 2 x with tan x = x (Greenhill 1883).
    const double expected = 2 * 4.493409457909064 * part.bending / part.length;
    const double twist = expected * uniform.length / uniform.torsion;
    const auto size = [&] {
        double far = 0;
        for (int i = spare; i < uniform.nodes; ++i)
            far = std::max(far, std::hypot(rod.position(i).y, rod.position(i).z));
        return far;
    };
    double torque = 0, from = 0, to = 0, begin = 0;
    const double ramp = 6 / w;
    const auto step = [&] {
        const auto target = [&](double t) { return from + (to - from) * smooth((t - begin) / ramp); };
        turn.target = target(rod.seconds());
        turn.velocity = (target(rod.seconds() + uniform.dt) - turn.target) / uniform.dt;
        rod.step();
        torque += (std::abs(rod.output().rotation_torque) - torque) * std::min(1.0, uniform.dt * w);
    };
    const auto turn_to = [&](double angle) { from = to, to = angle, begin = rod.seconds(); };
    const Critical found = southwell([&](double factor) {
        turn_to(factor * twist);
        wait(rod, step, size, ramp, 2 / w);
        return Answer{torque, size()};
    });
    Row row = relative_row("buckle", o, part, "critical_torque", found.load, expected, 0.05);
    turn_to(1.05 * found.factor * twist);
    const bool does = std::isfinite(found.factor) &&
                      leaves(rod, step, size, std::max(200 * found.unloaded, 0.01 * part.length), 400 / w);
    std::vector<Row> rows{row, happens_row("buckle", o, part, "leaves", does, "5 % beyond")};
    judge_mesh(rows, uniform, twist);
    return rows;
}

// Both ends are clamped at one point with one tangent, and turned against each other, half each, so that the
// ring stays where it is. The fault: a natural curvature out of the ring's plane, going as cos 2 theta, that
// bends it by some 1e-4 of its radius; it keeps its direction in space as the rod turns.
std::vector<Row> run_ring(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform = UniformRod::at_rest(o, {.nodes = 60});
    const double expected = 2 * pi * std::sqrt(3.0) * uniform.bending / uniform.torsion;
    if (!o.nodes) uniform.nodes = enough_nodes(expected);
    const int segments = uniform.nodes - 1;
    const double turn = 2 * pi / segments, radius = 0.5 * uniform.length / segments / std::sin(0.5 * turn);
    // A free ring's second mode out of its plane, w^2 = EI / (rhoA R^4) 36 / (4 + EI/GJ) (Love 1944, art.
    // 293); half of it, since the clamp makes the ring move as a whole besides.
    const double w =
        0.5 *
        std::sqrt(36 / (4 + uniform.bending / uniform.torsion) * uniform.bending / uniform.mass_per_length) /
        (radius * radius);
    BenchRod::Setup s;
    s.rod = uniform;
    Vec3 p{};
    s.position.assign(3, 0.0);
    for (int j = 0; j < segments; ++j) {
        const double a = (j + 0.5) * turn;
        const Quat q = axis_angle({0, 0, 1}, a) * along_x;
        p += uniform.length / segments * Vec3{std::cos(a), std::sin(a), 0};
        s.position.insert(s.position.end(), {p.x, p.y, p.z});
        s.frame.insert(s.frame.end(), {q.w, q.x, q.y, q.z});
    }
    s.drag = w;
    BenchRod rod(make, std::move(s));
    double from = 0, to = 0, begin = 0;
    const double ramp = 6 / w, fault = 3e-4 / radius;
    std::vector<double> natural(3 * static_cast<std::size_t>(segments));
    const auto step = [&] {
        const double phi = from + (to - from) * smooth((rod.seconds() + uniform.dt - begin) / ramp);
        rod.clamp_base({}, along_x * axis_angle({0, 0, 1}, -0.5 * phi));
        rod.clamp_tip({}, along_x * axis_angle({0, 0, 1}, 0.5 * phi));
        for (int j = 0; j < segments; ++j) {
            const double at = (j + 0.5) / segments, own = phi * (at - 0.5);
            const double k = fault * std::cos(4 * pi * at);
            natural[3 * static_cast<std::size_t>(j)] = k * std::sin(own);
            natural[3 * static_cast<std::size_t>(j) + 1] = k * std::cos(own);
        }
        rod.input.rest_darboux = {natural.data(), natural.size()};
        rod.step();
    };
    // The part of the second mode in what is out of the plane; turning as a whole has none.
    const auto size = [&] {
        double c = 0, d = 0;
        for (int i = 0; i < segments; ++i) {
            c += rod.position(i).z * std::cos(2 * i * turn) * 2 / segments;
            d += rod.position(i).z * std::sin(2 * i * turn) * 2 / segments;
        }
        return std::hypot(c, d);
    };
    const auto turn_to = [&](double angle) { from = to, to = angle, begin = rod.seconds(); };
    const Critical found = southwell([&](double factor) {
        turn_to(factor * expected);
        wait(rod, step, size, ramp, 2 / w);
        return Answer{factor * expected, size()};
    });
    Row row = relative_row("ring", o, uniform, "critical_twist", found.load, expected, 0.05);
    turn_to(1.05 * found.factor * expected);
    const bool does = std::isfinite(found.factor) &&
                      leaves(rod, step, size, std::max(40 * found.unloaded, 0.005 * radius), 600 / w);
    std::vector<Row> rows{row, happens_row("ring", o, uniform, "leaves", does, "5 % beyond")};
    judge_mesh(rows, uniform, expected);
    // Its second mode has two waves: twelve segments to each.
    if (segments < 24)
        for (Row& r : rows)
            r.unsuited("a ring of less than 24 segments is too coarse, give more --nodes");
    return rows;
}

// Laid in an arch whose direction goes as 1.26 sin(2 pi s / L), which brings the clamps to 0.64 L of each
// other (J0), left to come to rest, and turned at its tip until it lies on itself; then turned back.
std::vector<Row> run_loop(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform = UniformRod::at_rest(o, {.nodes = 60});
    // The greatest torque that a clamped rod carries twists it by 9 EI/GJ; two more turns lay a loop.
    const double most = 4 * pi + 18 * uniform.bending / uniform.torsion;
    if (!o.nodes) uniform.nodes = enough_nodes(most);
    const double w = clamped_frequency(uniform), length = uniform.length;
    const double friction = o.friction.value_or(0.1);
    const auto capacity = 8 * static_cast<std::size_t>(uniform.nodes);
    BenchRod::Setup s;
    s.rod = uniform;
    Vec3 end{};
    s.position.assign(3, 0.0);
    for (int j = 0; j + 1 < uniform.nodes; ++j) {
        const double a = 1.26 * std::sin(2 * pi * (j + 0.5) / (uniform.nodes - 1));
        const Quat q = axis_angle({0, 0, 1}, a) * along_x;
        end += length / (uniform.nodes - 1) * Vec3{std::cos(a), std::sin(a), 0};
        s.position.insert(s.position.end(), {end.x, end.y, end.z});
        s.frame.insert(s.frame.end(), {q.w, q.x, q.y, q.z});
    }
    s.drag = 3 * w;
    s.max_contacts = static_cast<std::uint32_t>(capacity);
    BenchRod rod(make, std::move(s));
    SelfContacts self(uniform, friction);
    rod.clamp_base({}, along_x);

    // A contact may chatter: the rod touches itself as long as no gap of 2 / w is without one.
    double angle = 0, first_touch = -1, last_touch = -1;
    // A rod that snaps goes through itself within a tick: contacts are found anew each half radius.
    std::span<const calot_contact> near;
    const auto find = [&] {
        near = self.contacts(rod, std::max(1.5 * uniform.radius, 4 * uniform.dt * rod.top_speed()), capacity);
        return near;
    };
    const auto step = [&] {
        rod.clamp_tip(end, axis_angle({1, 0, 0}, angle) * along_x);
        rod.step_in_parts(find, 0.5 * uniform.radius);
        if (last_touch >= 0 && rod.seconds() - last_touch > 2 / w) first_touch = last_touch = -1;
        for (std::size_t k = 0; k < near.size(); ++k)
            if (norm(rod.impulse(k)) > 0) last_touch = rod.seconds();
        if (first_touch < 0) first_touch = last_touch;
    };
    const auto touches = [&] { return first_touch >= 0; };
    const auto lasts = [&] { return touches() ? last_touch - first_touch : 0.0; };
    const auto rest = [&](double longest) {
        for (const double end = rod.seconds() + longest;
             rod.seconds() < end &&
             (rod.top_speed() > 1e-5 * length * w || rod.seconds() < end - longest + 5 / w);)
            step();
    };
    rest(60 / w);
    const std::vector<Vec3> arch = rod.positions();

    const double rate = 2 * pi * w / 20 * std::max(1.0, most / (8 * pi));
    double peak = 0;
    while (angle < most && lasts() < 2 / w) {
        angle += rate * uniform.dt;
        step();
        if (!touches()) peak = std::max(peak, rod.output().twist_energy);
    }
    const bool forms = touches();
    const double formed_at = angle;
    rest(60 / w);
    const bool holds = forms && touches();
    const double left = rod.output().twist_energy;

    // The arch may hang to any side, so it is compared by how far its points are along the clamps' line and
    // from it.
    const auto away = [&] {
        double far = 0;
        for (int i = 0; i < uniform.nodes; ++i) {
            const Vec3 p = rod.position(i), q = arch[static_cast<std::size_t>(i)];
            far = std::max(far, std::hypot(p.x - q.x, std::hypot(p.y, p.z) - std::hypot(q.y, q.z)));
        }
        return far / length;
    };
    const auto turn_to = [&](double to) {
        while (std::abs(angle - to) > 1e-12) {
            angle += std::clamp(to - angle, -rate * uniform.dt, rate * uniform.dt);
            step();
        }
        rest(60 / w);
    };
    turn_to(0);
    // A rod that is weak in twist keeps its loop, and has to be turned back farther.
    double back = 0;
    if (touches()) turn_to(back = -most), turn_to(0);
    const std::string label = setting("angle", formed_at);
    std::vector<Row> rows{
        happens_row("loop", o, uniform, "forms", holds, label),
        plain_row("loop", o, uniform, "twist_energy_peak", peak, label),
        plain_row("loop", o, uniform, "twist_energy_looped", left, label),
        happens_row("loop", o, uniform, "twist_energy_drops", holds && left < 0.97 * peak, label),
        absolute_row("loop", o, uniform, "straight_again", away(), 0, forms ? away() : HUGE_VAL, 0.02,
                     setting("turned back to", back))};
    judge_mesh(rows, uniform, most);
    return rows;
}

} // namespace calot::bench
