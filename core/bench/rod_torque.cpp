// Reference problem of turning in a bent tube.
#include "bench/lumen.hpp"
#include "bench/rod_problems.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace calot::bench {

namespace {

constexpr double pi = std::numbers::pi;

struct Turning {
    double lag = 0;        ///< rad: of the tip behind the base, when it no longer grows
    double stick = 0;      ///< rad: turn of the base until the tip follows at half its rate
    double tip_rate = 0;   ///< of the tip over that of the base, over the last quarter turn
    double gain = 0;       ///< the most by which energy rose beyond the work done at the base, over that work
    double dissipated = 0; ///< by friction at the contacts, over the work done at the base
    bool is_steady = false;
};

// A rod of 0.6 m, a tenth of it in the guide, laid in a tube of 2 mm play that is straight, bent with a
// radius of 0.1 m (a sixth of the length), and straight again.
Turning turned(const MakeInstance& make, const UniformRod& uniform, double mu, double angle) {
    const double mouth = 0.1 * uniform.length, lead = 0.3 * uniform.length;
    // What is bent must fit between the straight parts.
    const double bend = std::min(uniform.length / 6, 0.5 * uniform.length / angle), rate = pi;
    Lumen lumen(Lumen::bend(lead, bend, angle, uniform.length), uniform.radius + 2e-3, false, mu);
    BenchRod::Setup s;
    s.rod = uniform;
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
    s.bending_damping = s.torsion_damping = 1e-5;
    calot_guide guide{};
    guide.present = 1;
    guide.direction[0] = 1;
    s.guide = guide;
    s.max_contacts = static_cast<std::uint32_t>(uniform.nodes + 1);
    BenchRod rod(make, std::move(s));
    rod.input.base.mode = CALOT_END_COUPLED;
    rod.input.base.insertion = {-mouth, 0, 5000, 50, 50};
    rod.input.base.rotation = {0, 0, 100 * uniform.torsion / uniform.length, uniform.torsion / uniform.length,
                               1e3};

    double work = 0, friction = 0;
    const auto step = [&] {
        const double before = rod.output().rotation, in_before = rod.output().insertion;
        const auto& contacts = lumen.contacts(rod);
        rod.step(contacts);
        work += rod.output().rotation_torque * (rod.output().rotation - before) +
                rod.output().insertion_force * (rod.output().insertion - in_before);
        for (std::size_t k = 0; k < contacts.size(); ++k) {
            const calot_contact& c = contacts[k];
            const int i = static_cast<int>(c.segment);
            const Vec3 arm = -uniform.radius * vec3(c.normal);
            const Vec3 n = vec3(c.normal), v = rod.velocity(i + 1) + cross(rod.angular_velocity(i), arm);
            friction -= dot(rod.impulse(k), v - dot(v, n) * n);
        }
    };
    // Finds its place in the tube.
    const double time = std::max(0.5, 3 / uniform.lowest_frequency());
    while (rod.seconds() < std::min(time, 2.0))
        step();
    const double straight = end_twist(rod, rod.frame(0)), start = rod.energy();
    work = friction = 0;

    Turning out;
    double turn = 0, next = pi / 2, lag_before = 0, turn_before = 0, tip_before = 0, highest = 0;
    const int lately = std::max(1, static_cast<int>(0.02 / uniform.dt));
    std::vector<double> tip;
    rod.input.base.rotation.velocity = rate;
    const double from = rod.output().rotation;
    while (turn < 12 * pi && !out.is_steady) {
        step();
        rod.input.base.rotation.target += rate * uniform.dt;
        turn = rod.output().rotation - from;
        out.lag = straight - end_twist(rod, rod.frame(0));
        tip.push_back(turn - out.lag);
        highest = std::max(highest, rod.energy() - start - work);
        if (out.stick == 0 && static_cast<int>(tip.size()) > lately &&
            tip.back() - tip[tip.size() - 1 - static_cast<std::size_t>(lately)] >
                0.5 * rate * lately * uniform.dt)
            out.stick = turn;
        if (turn < next) continue;
        next += pi / 2;
        out.tip_rate = (tip.back() - tip_before) / (turn - turn_before);
        out.is_steady = turn > 1.9 * pi && std::abs(out.lag - lag_before) < 0.05 * std::abs(out.lag) + 1e-3;
        lag_before = out.lag, turn_before = turn, tip_before = tip.back();
    }
    out.gain = std::max(0.0, highest) / std::max(work, 1e-12);
    out.dissipated = friction / std::max(work, 1e-12);
    return out;
}

} // namespace

std::vector<Row> run_torque_lag(const MakeInstance& make, const RodOptions& o) {
    UniformRod uniform;
    uniform.nodes = 60, uniform.length = 0.6;
    uniform = UniformRod::of(o, uniform);
    const double most = o.friction.value_or(0.4), angle = o.angle.value_or(pi / 2);
    std::vector<Row> rows;
    double gain = 0;
    const auto turn = [&](const UniformRod& rod, double mu, double by) {
        const Turning t = turned(make, rod, mu, by);
        const std::string label =
            setting("mu", mu) + " " + setting("angle", by) + " " + setting("GJ", rod.torsion);
        rows.push_back(plain_row("torque-lag", o, rod, "lag", t.lag, label));
        if (!t.is_steady) rows.back().remark = "lag still grows after six turns at " + label;
        gain = std::max(gain, t.gain);
        return t;
    };
    const Turning smooth = turn(uniform, 0, angle), half = turn(uniform, most / 2, angle),
                  full = turn(uniform, most, angle), less_bent = turn(uniform, most, angle / 8);
    // So weak in twist that the lag is about a radian.
    UniformRod weak = uniform;
    weak.torsion *= std::clamp(full.lag, 1e-3, 0.1);
    const Turning whipping = turn(weak, most, angle);
    if (most > 0) {
        rows.push_back(happens_row("torque-lag", o, uniform, "grows_with_friction",
                                   smooth.lag < half.lag && half.lag < full.lag));
        rows.push_back(happens_row("torque-lag", o, uniform, "grows_with_angle", less_bent.lag < full.lag));
    }
    const auto follows = [&](const char* label, const Turning& t) {
        rows.push_back(absolute_row("torque-lag", o, uniform, "tip_rate", t.tip_rate, 1,
                                    std::abs(t.tip_rate - 1), 0.1, label));
    };
    follows("in the end", full), follows("in the end, low GJ", whipping);
    if (most > 0) {
        rows.push_back(plain_row("torque-lag", o, uniform, "stick", full.stick));
        rows.push_back(plain_row("torque-lag", o, uniform, "stick", whipping.stick, "low GJ"));
        rows.push_back(happens_row("torque-lag", o, uniform, "sticks_then_slips",
                                   whipping.stick > 2 * full.stick && whipping.tip_rate > 0.9, "low GJ"));
    }
    rows.push_back(absolute_row("torque-lag", o, uniform, "energy_gain", gain, 0, gain, 1e-2));
    rows.push_back(absolute_row("torque-lag", o, uniform, "friction_over_work", full.dissipated, 1,
                                std::max(0.0, full.dissipated - 1), 2e-2));
    return rows;
}

} // namespace calot::bench
