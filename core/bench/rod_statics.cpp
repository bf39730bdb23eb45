// Reference problems at rest.
#include "bench/references.hpp"
#include "bench/rod_problems.hpp"

#include <algorithm>
#include <cmath>
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

// At rest to a part in 10^7 of the length: what still moves decays at least with half the lowest frequency,
// and a load that straightens the rod only makes it stiffer.
void come_to_rest(BenchRod& rod) {
    const double w = rod.rod().lowest_frequency();
    rod.settle(1e-7 * rod.rod().length * w, 60 / w);
}

PlanarTip loaded_tip(const MakeInstance& make, const UniformRod& uniform, double tip_force, double gravity) {
    BenchRod rod(make, settling(uniform));
    rod.clamp_base({}, along_x);
    rod.input.gravity[1] = gravity;
    if (tip_force != 0) rod.load_tip({0, tip_force, 0}, {});
    come_to_rest(rod);
    const Vec3 tip = rod.position(uniform.nodes - 1);
    return {tip.y / uniform.length, 1 - tip.x / uniform.length, 0};
}

std::vector<Row> tip_rows(const char* problem, const RodOptions& o, const UniformRod& rod,
                          const PlanarTip& got, const PlanarTip& right, double bound,
                          const std::string& label) {
    return {relative_row(problem, o, rod, "tip_drop", got.drop, right.drop, bound, label),
            relative_row(problem, o, rod, "tip_shortening", got.shortening, right.shortening, bound, label)};
}

} // namespace

std::vector<Row> run_rest(const MakeInstance& make, const RodOptions& o) {
    const UniformRod uniform = UniformRod::of(o);
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
        std::vector<Vec3> start;
        for (int i = 0; i < uniform.nodes; ++i)
            start.push_back(rod.position(i));
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
    const UniformRod rod = UniformRod::of(o);
    const double unit = rod.bending / (rod.length * rod.length), load = o.load.value_or(0.2 * unit);
    const PlanarTip right = planar_tip(load / unit, 0);
    const PlanarTip got = loaded_tip(make, rod, load, 0);
    return {relative_row("cantilever", o, rod, "tip_drop", got.drop, right.drop, 0.005,
                         setting("PL2/EI", load / unit))};
}

std::vector<Row> run_elastica(const MakeInstance& make, const RodOptions& o) {
    const UniformRod rod = UniformRod::of(o);
    const double unit = rod.bending / (rod.length * rod.length);
    std::vector<double> loads{unit, 2 * unit, 5 * unit, 10 * unit};
    if (o.load) loads = {*o.load};
    std::vector<Row> rows;
    for (const double load : loads) {
        const auto more = tip_rows("elastica", o, rod, loaded_tip(make, rod, load, 0),
                                   planar_tip(load / unit, 0), 0.005, setting("PL2/EI", load / unit));
        rows.insert(rows.end(), more.begin(), more.end());
    }
    return rows;
}

// The load is the whole weight, w L.
std::vector<Row> run_heavy(const MakeInstance& make, const RodOptions& o) {
    const UniformRod rod = UniformRod::of(o);
    const double unit = rod.bending / (rod.length * rod.length), weight = o.load.value_or(5 * unit);
    const double gravity = weight / (rod.mass_per_length * rod.length);
    return tip_rows("heavy", o, rod, loaded_tip(make, rod, 0, gravity), planar_tip(0, weight / unit), 0.005,
                    setting("wL3/EI", weight / unit));
}

std::vector<Row> run_circle(const MakeInstance& make, const RodOptions& o) {
    const UniformRod uniform = UniformRod::of(o);
    const double moment = o.load.value_or(2 * pi * uniform.bending / uniform.length);
    BenchRod rod(make, settling(uniform));
    rod.clamp_base({}, along_x);
    rod.load_tip({}, {0, 0, moment});
    // A moment about an axis fixed in space is not conservative: the closed circle leaves its plane in the
    // end, out of rounding errors (after some 20 of these times). It is looked at when its motion in the
    // plane has died down.
    const double w = uniform.lowest_frequency();
    rod.settle(1e-4 * uniform.length * w, 14 / w);
    const double gap = norm(rod.position(uniform.nodes - 1) - rod.position(0)) / uniform.length;
    // The chord of an arc of angle M L / EI.
    const double angle = moment * uniform.length / uniform.bending,
                 right = std::abs(2 / angle * std::sin(angle / 2));
    return {absolute_row("circle", o, uniform, "end_gap", gap, right, std::abs(gap - right), 0.01,
                         setting("ML/EI", angle))};
}

std::vector<Row> run_twist(const MakeInstance& make, const RodOptions& o) {
    const UniformRod uniform = UniformRod::of(o);
    const double torque = o.load.value_or(0.5 * uniform.torsion / uniform.length);
    BenchRod::Setup s = settling(uniform);
    // Torsional waves are hundreds of times faster than bending ones.
    const double polar = 0.5 * uniform.mass_per_length * uniform.radius * uniform.radius;
    s.drag = pi / uniform.length * std::sqrt(uniform.torsion / polar);
    BenchRod rod(make, std::move(s));
    rod.clamp_base({}, along_x);
    rod.load_tip({}, {torque, 0, 0});
    for (int k = 0; static_cast<double>(k) * uniform.dt < 0.2 + 40 / (0.5 * s.drag); ++k)
        rod.step();
    return {relative_row("twist", o, uniform, "tip_angle", end_twist(rod, along_x),
                         torque * uniform.length / uniform.torsion, 0.005, setting("T", torque))};
}

std::vector<Row> run_refine(const MakeInstance& make, const RodOptions& o) {
    const int most = std::clamp(o.nodes.value_or(200), 50, 400);
    std::vector<Row> rows;
    for (const bool heavy : {false, true}) {
        UniformRod rod = UniformRod::of(o);
        const double unit = rod.bending / (rod.length * rod.length), load = o.load.value_or(5 * unit);
        const PlanarTip right = heavy ? planar_tip(0, load / unit) : planar_tip(load / unit, 0);
        const char* const label = heavy ? "heavy" : "elastica";
        // Slope of log(error) over log(spacing) by least squares.
        double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
        for (int nodes = 25; nodes <= most; nodes *= 2) {
            rod.nodes = nodes;
            const PlanarTip got = heavy ? loaded_tip(make, rod, 0, load / (rod.mass_per_length * rod.length))
                                        : loaded_tip(make, rod, load, 0);
            const double error = std::abs(got.drop / right.drop - 1);
            rows.push_back(plain_row("refine", o, rod, "tip_drop", got.drop, label));
            rows.back().reference = right.drop, rows.back().error = error;
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
