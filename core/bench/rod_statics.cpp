// Reference problems at rest.
#include "bench/references.hpp"
#include "bench/rod_problems.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace calot::bench {

namespace {

constexpr double pi = std::numbers::pi;

// A clamped rod along +x with drag close to critical for its lowest mode, so that it comes to rest soonest.
BenchRod::Setup settling(const UniformRod& rod) {
    BenchRod::Setup s;
    s.rod = rod;
    s.position = straight_line(rod, {}, along_x);
    s.frame = same_frames(rod, along_x);
    s.drag = 2 * rod.lowest_frequency();
    return s;
}

// At rest to `precision` times the way it goes: what still moves decays at least with half the lowest
// frequency, and a load that straightens the rod only makes it stiffer. The remark, if it did not come to
// rest.
std::string come_to_rest(BenchRod& rod, double way, double precision) {
    const double w = rod.rod().lowest_frequency();
    if (rod.settle(precision * way * w, 60 / w)) return {};
    char text[160];
    std::snprintf(text, sizeof text, "still moving at %.1e m/s after %.4g s", rod.top_speed(), rod.seconds());
    return text;
}

struct Loaded {
    double tip_force = 0, gravity = 0; // N, m/s2
    PlanarTip right;
    double precision = 1e-6;
};

struct TipAtRest {
    PlanarTip got;
    std::string remark;
    std::vector<double> angle; // of each segment against the clamp's direction, rad
};

// From straight, or from the shape of a rod of fewer segments.
TipAtRest loaded_tip(const MakeInstance& make, const UniformRod& uniform, const Loaded& load,
                     std::span<const double> from = {}) {
    BenchRod::Setup setup = settling(uniform);
    if (!from.empty()) {
        setup.position.assign(3, 0.0), setup.frame.clear();
        const int segments = uniform.nodes - 1, last = static_cast<int>(from.size()) - 1;
        const double l = uniform.length / segments;
        Vec3 p{};
        for (int j = 0; j < segments; ++j) {
            const double at = (j + 0.5) / segments * (last + 1) - 0.5;
            const int k = std::clamp(static_cast<int>(std::floor(at)), 0, last - 1);
            const auto i = static_cast<std::size_t>(k);
            const double a = std::max(0.0, from[i] + (at - k) * (from[i + 1] - from[i]));
            const Quat q = axis_angle({0, 0, 1}, a) * along_x;
            p += l * Vec3{std::cos(a), std::sin(a), 0};
            setup.position.insert(setup.position.end(), {p.x, p.y, p.z});
            setup.frame.insert(setup.frame.end(), {q.w, q.x, q.y, q.z});
        }
    }
    BenchRod rod(make, std::move(setup));
    rod.clamp_base({}, along_x);
    rod.input.gravity[1] = load.gravity;
    if (load.tip_force != 0) rod.load_tip({0, load.tip_force, 0}, {});
    TipAtRest out;
    out.remark = come_to_rest(rod, load.right.drop * uniform.length, load.precision);
    const Vec3 tip = rod.position(uniform.nodes - 1);
    out.got = {tip.y / uniform.length, 1 - tip.x / uniform.length, 0};
    for (int j = 0; j + 1 < uniform.nodes; ++j) {
        const Vec3 d = rod.position(j + 1) - rod.position(j);
        out.angle.push_back(std::atan2(d.y, d.x));
    }
    return out;
}

// A load of so many EI/L2 bends the rod within L / sqrt(load): no mesh of longer segments shows that.
void judge_mesh(std::span<Row> rows, const UniformRod& rod, double load) {
    if (std::sqrt(load) < 2.0 * (rod.nodes - 1)) return;
    for (Row& r : rows)
        r.unsuited("the load bends the rod within half a segment: give less --load or more --nodes");
}

// A segment takes no more than this of an arc, or of twist.
constexpr double most_turn = 0.6; // rad

std::vector<Row> tip_rows(const char* problem, const RodOptions& o, const UniformRod& rod,
                          const TipAtRest& tip, const PlanarTip& right, double load,
                          const std::string& label) {
    constexpr double bound = 0.005;
    std::vector<Row> rows{
        relative_row(problem, o, rod, "tip_drop", tip.got.drop, right.drop, bound, label),
        relative_row(problem, o, rod, "tip_shortening", tip.got.shortening, right.shortening, bound, label)};
    rows[0].remark = tip.remark;
    judge_mesh(rows, rod, load);
    return rows;
}

} // namespace

std::vector<Row> run_rest(const MakeInstance& make, const RodOptions& o) {
    const UniformRod uniform = UniformRod::at_rest(o);
    std::vector<Row> rows;
    for (const bool curved : {false, true}) {
        BenchRod::Setup s = settling(uniform);
        // Half a circle. Models measure curvature between two frames in different ways, equal to second order
        // in the spacing, so the curved rod settles first, and its drag is taken away before the steps that
        // count.
        const double curvature = pi / uniform.length;
        if (curved) {
            for (int j = 0; j + 1 < uniform.nodes; ++j)
                s.rest_darboux.insert(s.rest_darboux.end(), {curvature, 0, 0});
            const double l = uniform.length / (uniform.nodes - 1), turn = 2 * std::asin(l * curvature / 2);
            s.frame.clear();
            Vec3 p{};
            s.position.assign(3, 0.0);
            for (int j = 0; j + 1 < uniform.nodes; ++j) {
                const Quat q = along_x * axis_angle({1, 0, 0}, (j + 0.5) * turn);
                s.frame.insert(s.frame.end(), {q.w, q.x, q.y, q.z});
                p += rotate(q, {0, 0, l});
                s.position.insert(s.position.end(), {p.x, p.y, p.z});
            }
        }
        BenchRod rod(make, std::move(s));
        if (curved) {
            rod.settle(1e-13 * uniform.length, 40 / uniform.lowest_frequency());
            rod.set_drag(0);
        }
        const std::vector<Vec3> start = rod.positions();
        for (int k = 0; k < 1000; ++k)
            rod.step();
        double drift = 0;
        for (int i = 0; i < uniform.nodes; ++i)
            drift = std::max(drift, norm(rod.position(i) - start[static_cast<std::size_t>(i)]));
        drift /= uniform.length;
        rows.push_back(absolute_row("rest", o, uniform, "drift", drift, 0, drift, 1e-9,
                                    curved ? "half circle" : "straight"));
    }
    return rows;
}

std::vector<Row> run_cantilever(const MakeInstance& make, const RodOptions& o) {
    const UniformRod rod = UniformRod::at_rest(o);
    const double unit = rod.bending / (rod.length * rod.length), load = o.load.value_or(0.2 * unit);
    const PlanarTip right = planar_tip(load / unit, 0);
    const TipAtRest tip = loaded_tip(make, rod, {.tip_force = load, .right = right});
    Row row = relative_row("cantilever", o, rod, "tip_drop", tip.got.drop, right.drop, 0.005,
                           setting("PL2/EI", load / unit));
    row.remark = tip.remark;
    judge_mesh({&row, 1}, rod, load / unit);
    return {row};
}

std::vector<Row> run_elastica(const MakeInstance& make, const RodOptions& o) {
    const UniformRod rod = UniformRod::at_rest(o);
    const double unit = rod.bending / (rod.length * rod.length);
    std::vector<double> loads{unit, 2 * unit, 5 * unit, 10 * unit};
    if (o.is_short) loads = {unit, 10 * unit};
    if (o.load) loads = {*o.load};
    std::vector<Row> rows;
    for (const double load : loads) {
        const PlanarTip right = planar_tip(load / unit, 0);
        const auto more =
            tip_rows("elastica", o, rod, loaded_tip(make, rod, {.tip_force = load, .right = right}), right,
                     load / unit, setting("PL2/EI", load / unit));
        rows.insert(rows.end(), more.begin(), more.end());
    }
    return rows;
}

// The load is the whole weight, w L.
std::vector<Row> run_heavy(const MakeInstance& make, const RodOptions& o) {
    const UniformRod rod = UniformRod::at_rest(o);
    const double unit = rod.bending / (rod.length * rod.length), mass = rod.mass_per_length * rod.length;
    const double weight = o.load.value_or(o.mass_per_length ? 9.81 * mass : 5 * unit);
    const PlanarTip right = planar_tip(0, weight / unit);
    return tip_rows("heavy", o, rod, loaded_tip(make, rod, {.gravity = weight / mass, .right = right}), right,
                    weight / unit, setting("wL3/EI", weight / unit));
}

std::vector<Row> run_circle(const MakeInstance& make, const RodOptions& o) {
    const UniformRod uniform = UniformRod::at_rest(o);
    const double moment = o.load.value_or(2 * pi * uniform.bending / uniform.length);
    // A moment about an axis fixed in space is not conservative, and a rod that is weak in twist escapes out
    // of the plane anyway: the closed circle leaves its plane in the end, out of rounding errors. So the rod
    // lies along the world's third axis, where most of those are exact zeros, and is looked at when its
    // motion in the plane has died down.
    BenchRod::Setup s = settling(uniform);
    s.position = straight_line(uniform, {}, {});
    s.frame = same_frames(uniform, {});
    BenchRod rod(make, std::move(s));
    rod.clamp_base({}, {});
    rod.load_tip({}, {0, moment, 0});
    const double w = uniform.lowest_frequency();
    rod.settle(1e-4 * uniform.length * w, 14 / w + 2 * uniform.length);
    const double gap = norm(rod.position(uniform.nodes - 1) - rod.position(0)) / uniform.length;
    // The chord of an arc of angle M L / EI.
    const double angle = moment * uniform.length / uniform.bending,
                 right = std::abs(2 / angle * std::sin(angle / 2));
    Row row = absolute_row("circle", o, uniform, "end_gap", gap, right, std::abs(gap - right), 0.01,
                           setting("ML/EI", angle));
    if (const double turn = angle / (uniform.nodes - 1); turn > most_turn)
        row.unsuited(setting("rad of bend per segment", turn) + ": too coarse, give more --nodes");
    return {row};
}

std::vector<Row> run_twist(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform = UniformRod::of(o);
    const double torque = o.load.value_or(0.5 * uniform.torsion / uniform.length);
    // Torsional waves are hundreds of times faster than bending ones. Angular frequency of the slowest:
    const double polar = 0.5 * uniform.mass_per_length * uniform.radius * uniform.radius;
    const double w = pi / 2 / uniform.length * std::sqrt(uniform.torsion / polar);
    if (!o.dt) uniform.dt = std::round(1e9 * std::clamp(1 / w, 1e-4, 1e-3)) * 1e-9;
    BenchRod::Setup s = settling(uniform);
    s.drag = 2 * w;
    BenchRod rod(make, std::move(s));
    rod.clamp_base({}, along_x);
    // Turned on over ten of its periods, so that a model without damping of its own hardly swings; the mean
    // over the last ten.
    const double time = std::max(20 * pi / w, 100 * uniform.dt);
    double angle = 0;
    int count = 0;
    while (rod.seconds() < 3 * time) {
        const double on = std::min(1.0, rod.seconds() / time);
        rod.load_tip({}, {torque * on * on * (3 - 2 * on), 0, 0});
        rod.step();
        if (rod.seconds() < 2 * time) continue;
        angle += end_twist(rod, along_x);
        ++count;
    }
    const double right = torque * uniform.length / uniform.torsion;
    Row row =
        relative_row("twist", o, uniform, "tip_angle", angle / count, right, 0.005, setting("T", torque));
    if (const double turn = right / (uniform.nodes - 1); turn > most_turn)
        row.unsuited(setting("rad of twist per segment", turn) + ": too coarse, give more --nodes");
    return {row};
}

std::vector<Row> run_refine(const MakeInstance& make, const RodOptions& o) {
    constexpr int levels[] = {25, 50, 100, 200, 400};
    const int most = std::clamp(o.nodes.value_or(200), 50, 400);
    std::vector<Row> rows;
    for (const bool heavy : {false, true}) {
        UniformRod rod = UniformRod::at_rest(o);
        const double unit = rod.bending / (rod.length * rod.length), load = o.load.value_or(5 * unit);
        const PlanarTip right = heavy ? planar_tip(0, load / unit) : planar_tip(load / unit, 0);
        Loaded how{.right = right};
        if (heavy)
            how.gravity = load / (rod.mass_per_length * rod.length);
        else
            how.tip_force = load;
        const char* const label = heavy ? "heavy" : "elastica";
        // Slope of log(error) over log(spacing) by least squares. Each number of nodes starts from the shape
        // that the one before came to.
        double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
        std::vector<double> shape;
        for (const int nodes : levels) {
            if (nodes > most) break;
            rod.nodes = nodes;
            how.precision = 1e-4 / (nodes * nodes);
            TipAtRest tip = loaded_tip(make, rod, how, shape);
            shape = std::move(tip.angle);
            const double error = std::abs(tip.got.drop / right.drop - 1);
            rows.push_back(plain_row("refine", o, rod, "tip_drop", tip.got.drop, label));
            rows.back().reference = right.drop, rows.back().error = error, rows.back().remark = tip.remark;
            const double x = std::log(1.0 / (nodes - 1)), y = std::log(error);
            n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
        }
        const double order = (n * sxy - sx * sy) / (n * sxx - sx * sx);
        rows.push_back(
            absolute_row("refine", o, rod, "order", order, 2, std::max(0.0, 2 - order), 0.2, label));
    }
    return rows;
}

} // namespace calot::bench
