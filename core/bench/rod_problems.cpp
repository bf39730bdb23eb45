#include "bench/rod_problems.hpp"

#include <cmath>
#include <cstdio>

namespace calot::bench {

namespace {

constexpr RodProblem problems[] = {
    {"rest", "no load, straight and curved by nature: does not move", &run_rest},
    {"cantilever", "clamped, small tip load", &run_cantilever},
    {"elastica", "clamped, large dead tip load", &run_elastica},
    {"heavy", "clamped, under its own weight", &run_heavy},
    {"circle", "end moment 2 pi EI/L closes it", &run_circle},
    {"twist", "end torque T turns the end by T L/GJ", &run_twist},
    {"rotate", "the scene turned gives the result turned", &run_rotate},
    {"energy", "free vibration gains no energy", &run_energy},
    {"refine", "error falls with the number of nodes", &run_refine},
    {"buckle", "twisted between clamps, one sliding: critical torque", &run_buckle},
    {"compress", "pushed into a curved vessel until blocked: does not shorten", &run_compress},
    {"capstan", "pulled round a cylinder: tension ratio exp(mu phi)", &run_capstan},
    {"hang-on", "tip pressed into rigid tissue: base carries it", &run_hang_on},
    {"torque-lag", "turned inside a bent tube: the tip lags, more with friction", &run_torque_lag},
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

std::string setting(const char* name, double value) {
    char text[64];
    std::snprintf(text, sizeof text, "%s=%.6g", name, value);
    return text;
}

} // namespace calot::bench
