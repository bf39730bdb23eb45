#include "bench/rod_problems.hpp"

#include <cmath>
#include <cstdio>

namespace calot::bench {

namespace {

constexpr Takes nothing{};
constexpr Takes a_load{.load = true};

constexpr RodProblem problems[] = {
    {"rest", "no load, straight and curved by nature: does not move", &run_rest, nothing,
     "A rod clamped at one end, no gravity, no load: straight, and a half circle by nature. After 1,000 "
     "steps drift is how far any node has moved, over the length.",
     "rest --nodes 40"},
    {"cantilever", "clamped, small tip load", &run_cantilever, a_load,
     "Clamped and horizontal, no gravity, a dead load across the tip. --load: N, 0.2 EI/L2 unless given. "
     "tip_drop over the length, against the elastica under that load (shooting), whatever the load.",
     "cantilever --load 0.005 --EI 0.03 --length 0.8"},
    {"elastica", "clamped, large dead tip load", &run_elastica, a_load,
     "As cantilever, under large loads. --load: N; unless given 1, 2, 5 and 10 EI/L2 (Mattiasson 1981). "
     "tip_drop and tip_shortening over the length.",
     "elastica --load 0.1"},
    {"heavy", "clamped, under its own weight", &run_heavy, a_load,
     "Clamped and horizontal, bent by its own weight. --load: the whole weight w L, N, 5 EI/L2 unless given; "
     "with --mass-per-length and no load gravity is 9.81 m/s2. tip_drop and tip_shortening over the length, "
     "against EI theta'' = -w (L - s) cos theta (shooting).",
     "heavy --mass-per-length 0.15 --EI 0.2943"},
    {"circle", "end moment 2 pi EI/L closes it", &run_circle, a_load,
     "A moment on the free end bends the rod into an arc. --load: N m, 2 pi EI/L unless given. end_gap: the "
     "distance of the ends over the length, against the chord of the arc.",
     "circle --EI 0.01 --nodes 60"},
    {"twist", "end torque T turns the end by T L/GJ", &run_twist, a_load,
     "A torque on the free end, along the rod. --load: N m, 0.5 GJ/L unless given. tip_angle: rad, against T "
     "L/GJ.",
     "twist --GJ 0.5 --load 0.2"},
    {"rotate",
     "the scene turned gives the result turned",
     &run_rotate,
     {.load = true, .seed = true},
     "A rod swings under its weight and a moment on its tip, once as it is and once with the whole scene "
     "turned as --seed says. --load: the moment, N m, 1.5 EI/L unless given. deviation over the length.",
     "rotate --seed 7"},
    {"energy", "free vibration gains no energy", &run_energy, a_load,
     "Bent by a load on the tip and its weight, then the load is let go. --load: N, EI/L2 unless given. "
     "Total energy over the greatest kinetic energy: above its start, and the rise of its maxima from "
     "period to period; damping_ratio is printed.",
     "energy --nodes 50"},
    {"refine", "error falls with the number of nodes", &run_refine, a_load,
     "heavy and elastica at 25, 50, 100 ... nodes, up to --nodes (from 50 to 400). --load: N, 5 EI/L2 unless "
     "given. order: slope of log(error) of tip_drop over log(spacing), 2 expected.",
     "refine --nodes 200"},
    {"buckle", "twisted between clamps, one sliding: critical torque", &run_buckle, nothing,
     "A straight rod between two clamps, one of which turns and slides, no axial force, with a lateral "
     "weight that bends it by 2e-5 of its length. How much more it bends under more torque tells "
     "critical_torque (N m; Southwell's plot), against 8.987 EI/L (Greenhill 1883, clamped); 5 % beyond, "
     "the rod leaves.",
     "buckle --EI 0.02 --GJ 0.3"},
    {"ring", "a straight rod held in a ring and twisted: critical twist", &run_ring, nothing,
     "A naturally straight rod, both ends held at one point and tangent, twisted at its ends, with a fault "
     "of 1e-4 of its radius. critical_twist (rad, Southwell's plot) at which it leaves its plane, against 2 "
     "pi sqrt(3) EI/GJ (Michell 1889); 5 % beyond, it does.",
     "ring --EI 0.03 --GJ 0.03"},
    {"loop",
     "slack between clamps and twisted on: forms a loop",
     &run_loop,
     {.friction = true},
     "A rod between clamps that are nearer by a third than it is long, twisted until it lies on itself, "
     "with self-contact, then twisted back. --friction: of the rod on itself, 0.1. It must form a loop, "
     "lose twist energy by it, and be back in its first shape in the end.",
     "loop --GJ 0.1"},
    {"compress",
     "pushed into a curved vessel until blocked: does not shorten",
     &run_compress,
     {.load = true, .friction = true, .seed = true},
     "A catheter is pushed at 0.2 m/s into a rigid, random, curved vessel of 3 mm radius (a rod thicker "
     "than 1 mm: the whole scene in proportion) until it is blocked. --load: the greatest push, N, 5 unless "
     "given; --friction 0.05; --seed: of the vessel. shortening: 1 - length under push over length; "
     "penetration (m) under half a radius.",
     "compress --seed 3"},
    {"capstan",
     "pulled round a cylinder: tension ratio exp(mu phi), less what stiffness takes",
     &run_capstan,
     {.load = true, .friction = true, .angle = true},
     "Pulled slowly round a cylinder, no gravity. --load: the tension that holds back, N, 5 unless given; "
     "--friction 0.3; --angle: between the tangents, rad, pi/2; --length: of all, which fixes the "
     "cylinder's radius. tension_ratio against exp(mu phi) between where a rope of stiffness EI leaves the "
     "cylinder; from EI/(TR2) = 0.5 on no rod is judged.",
     "capstan --friction 0.2 --angle 3.14"},
    {"hang-on",
     "tip pressed into rigid tissue: base carries it",
     &run_hang_on,
     {.load = true, .friction = true},
     "A heavy clamped rod of 0.2 m is driven with its tip against a rigid wall. --load: the press, N, 4.77 "
     "unless given (less if the rod would buckle); --friction 0.3. base_reaction (N, size of the vector) at "
     "rest, against contact force plus weight.",
     "hang-on --load 3"},
    {"press", "tip driven in and out of a deformable body: settles, as the two together do", &run_press,
     a_load,
     "A rod in its guide is driven with its tip into a soft and a stiff body (200 and 5,000 N/m, 20 g, a "
     "tissue of three ticks a step), held, driven out and in at 5 Hz, held, withdrawn; light and heavy "
     "(0.05 and 0.5 kg/m, or --mass-per-length). --load: N at rest, 4.77 (less if the rod would buckle) "
     "unless given. deviation of the tip from the coupled solution of two masses (2 us steps) over its "
     "stroke; held_force, N; growth of what still swings while it is held.",
     "press --load 2 --mass-per-length 0.2"},
    {"torque-lag",
     "turned inside a bent tube: the tip lags, more with friction",
     &run_torque_lag,
     {.friction = true, .angle = true},
     "Turned inside a bent tube until the tip follows. --friction: the greatest, 0.4; --angle: of the bend, "
     "rad, pi/2. lag of the tip behind the base, rad, grows with friction and with angle; at a low GJ the "
     "tip sticks longer, then slips; neither energy's rise nor what friction takes is more than the work "
     "done at the base.",
     "torque-lag --friction 0.3 --angle 2"},
    {"push-soak",
     "in anatomy, pushed, turned and steered at random at the devices' limits: stays in the lumen",
     &run_push_soak,
     {.load = true, .friction = true, .angle = true, .seed = true, .duration = true},
     "A whole endoscope in an anatomy, its handle moved at random, smoothly and abruptly, at up to 0.3 m/s, "
     "360 degrees/s, wheels 180 degrees/s. --duration: s, 10 unless given; --anatomy: reference or colon; "
     "--endoscope: a datasheet, to which EI, GJ, length, radius and mass per length then apply. --load: the "
     "greatest push, N, 50; --friction: of every organ; --angle: the farthest turn of shaft and wheels, "
     "rad. A step is always the tick of 1 ms. Penetration over 1 mm at most 10 ms on end, never over half a "
     "radius, no node outside the lumen.",
     "push-soak --anatomy colon --seed 3 --duration 60"},
};

Row row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
        double measured, std::string setting) {
    Row r;
    r.problem = problem, r.model = options.model, r.nodes = rod.nodes, r.dt = rod.dt, r.quantity = quantity;
    r.measured = measured, r.setting = std::move(setting);
    return r;
}

// A measurement that is no number meets no bound.
double judged(double error) {
    return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

} // namespace

std::span<const RodProblem> rod_problems() {
    return problems;
}

const RodProblem* find_rod_problem(std::string_view id) {
    for (const RodProblem& p : problems)
        if (p.id == id) return &p;
    return nullptr;
}

Row relative_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
                 double measured, double reference, double bound, std::string setting) {
    return absolute_row(problem, options, rod, quantity, measured, reference,
                        std::abs(measured / reference - 1), bound, std::move(setting));
}

Row absolute_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
                 double measured, double reference, double error, double bound, std::string setting) {
    Row r = row(problem, options, rod, quantity, measured, std::move(setting));
    r.reference = reference, r.error = judged(error), r.bound = bound;
    return r;
}

Row plain_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
              double measured, std::string setting) {
    return row(problem, options, rod, quantity, measured, std::move(setting));
}

Row happens_row(const char* problem, const RodOptions& options, const UniformRod& rod, const char* quantity,
                bool does, std::string setting) {
    return absolute_row(problem, options, rod, quantity, does ? 1 : 0, 1, does ? 0 : 1, 0,
                        std::move(setting));
}

std::string setting(const char* name, double value) {
    char text[64];
    std::snprintf(text, sizeof text, "%s=%.6g", name, value);
    return text;
}

} // namespace calot::bench
