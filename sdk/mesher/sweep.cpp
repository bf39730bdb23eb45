#include "sweep.hpp"

namespace calot::mesher {
namespace {

/// Natural cubic spline through (t, y): second derivatives at the knots (tri-diagonal solve).
std::vector<double> spline_moments(const std::vector<double>& t, const std::vector<double>& y) {
    const std::size_t n = t.size();
    std::vector<double> m(n, 0.0), upper(n, 0.0), rhs(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const double h0 = t[i] - t[i - 1], h1 = t[i + 1] - t[i];
        const double d = 2 * (h0 + h1) - h0 * upper[i - 1];
        upper[i] = h1 / d;
        rhs[i] = (6 * ((y[i + 1] - y[i]) / h1 - (y[i] - y[i - 1]) / h0) - h0 * rhs[i - 1]) / d;
    }
    for (std::size_t i = n - 1; i-- > 1;)
        m[i] = rhs[i] - upper[i] * m[i + 1];
    return m;
}

double spline_at(const std::vector<double>& t, const std::vector<double>& y, const std::vector<double>& m,
                 std::size_t i, double at) {
    const double h = t[i + 1] - t[i], a = (t[i + 1] - at) / h, b = 1 - a;
    return a * y[i] + b * y[i + 1] + ((a * a * a - a) * m[i] + (b * b * b - b) * m[i + 1]) * h * h / 6;
}

/// Slopes of the monotone cubic interpolant (Fritsch and Butland 1984): no overshoot between knots.
std::vector<double> monotone_slopes(const std::vector<double>& t, const std::vector<double>& y) {
    const std::size_t n = t.size();
    std::vector<double> d(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const double h0 = t[i] - t[i - 1], h1 = t[i + 1] - t[i];
        const double s0 = (y[i] - y[i - 1]) / h0, s1 = (y[i + 1] - y[i]) / h1;
        if (s0 * s1 > 0) d[i] = 3 * (h0 + h1) / ((2 * h1 + h0) / s0 + (h1 + 2 * h0) / s1);
    }
    return d; // level at both ends, so that a round cap continues the tube without a crease
}

double monotone_at(const std::vector<double>& t, const std::vector<double>& y, const std::vector<double>& d,
                   std::size_t i, double at) {
    const double h = t[i + 1] - t[i], x = (at - t[i]) / h;
    return y[i] * (1 + 2 * x) * (1 - x) * (1 - x) + h * d[i] * x * (1 - x) * (1 - x) +
           y[i + 1] * x * x * (3 - 2 * x) + h * d[i + 1] * x * x * (x - 1);
}

Vec perpendicular(Vec v, Vec tangent) {
    return v - dot(v, tangent) * tangent;
}

} // namespace

Sweep::Sweep(const std::vector<Knot>& knots, bool has_up, Vec up, Cap start, Cap end)
    : start_(start), end_(end) {
    const std::size_t n = knots.size();
    std::vector<double> t(n, 0.0), axis[3], values[5];
    for (std::size_t i = 0; i < n; ++i) {
        const Knot& k = knots[i];
        if (i) t[i] = t[i - 1] + norm(k.at - knots[i - 1].at);
        axis[0].push_back(k.at.x), axis[1].push_back(k.at.y), axis[2].push_back(k.at.z);
        values[0].push_back(k.plus_u), values[1].push_back(k.minus_u), values[2].push_back(k.plus_v);
        values[3].push_back(k.minus_v), values[4].push_back(k.roll);
    }
    std::vector<double> moments[3], slopes[5];
    for (int c = 0; c < 3; ++c)
        moments[c] = spline_moments(t, axis[c]);
    for (int c = 0; c < 5; ++c)
        slopes[c] = monotone_slopes(t, values[c]);

    // Samples dense enough that a segment turns by a few degrees at most; the foot is found on the cubic
    // between them.
    std::vector<double> rolls;
    for (std::size_t i = 0; i + 1 < n; ++i) {
        const double span = t[i + 1] - t[i];
        const int pieces = std::clamp(static_cast<int>(std::ceil(span / 2.5)), 4, 200);
        for (int k = 0; k < pieces + (i + 2 == n); ++k) {
            const double at = t[i] + span * k / pieces;
            Sample s{};
            s.at = {spline_at(t, axis[0], moments[0], i, at), spline_at(t, axis[1], moments[1], i, at),
                    spline_at(t, axis[2], moments[2], i, at)};
            const double h = 1e-4 * span, lo = std::max(at - h, t[i]), hi = std::min(at + h, t[i + 1]);
            Vec d;
            double* out[3] = {&d.x, &d.y, &d.z};
            for (int c = 0; c < 3; ++c)
                *out[c] = spline_at(t, axis[c], moments[c], i, hi) - spline_at(t, axis[c], moments[c], i, lo);
            s.tangent = normalised(d);
            for (int c = 0; c < 4; ++c)
                s.radii[c] = monotone_at(t, values[c], slopes[c], i, at);
            rolls.push_back(monotone_at(t, values[4], slopes[4], i, at));
            samples_.push_back(s);
        }
    }
    const double most_parallel = std::cos(10 * M_PI / 180);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
        Sample& s = samples_[i];
        if (i) s.s = samples_[i - 1].s + norm(s.at - samples_[i - 1].at);
        if (has_up) {
            const Vec v = normalised(up);
            if (std::abs(dot(v, s.tangent)) > most_parallel) frame_ok_ = false;
            s.u = normalised(cross(perpendicular(v, s.tangent), s.tangent));
        } else if (i == 0) {
            const Vec t0 = s.tangent;
            const Vec away = std::abs(t0.z) < 0.9 ? Vec{0, 0, 1} : Vec{1, 0, 0};
            s.u = normalised(cross(perpendicular(away, t0), t0));
        } else {
            s.u = normalised(perpendicular(samples_[i - 1].u, s.tangent));
        }
    }
    for (std::size_t i = 0; i < samples_.size(); ++i) {
        Sample& s = samples_[i];
        const Vec v = cross(s.tangent, s.u);
        s.u = std::cos(rolls[i]) * s.u + std::sin(rolls[i]) * v;
        const std::size_t a = i ? i - 1 : 0, b = std::min(i + 1, samples_.size() - 1);
        const auto mean = [](const Sample& q) {
            return 0.25 * (q.radii[0] + q.radii[1] + q.radii[2] + q.radii[3]);
        };
        s.slope = (mean(samples_[b]) - mean(samples_[a])) / (samples_[b].s - samples_[a].s);
    }
    build_groups();
}

void Sweep::build_groups() {
    constexpr std::size_t group_size = 12;
    bounds_ = Box::around(samples_[0].at, {});
    for (std::size_t first = 0; first + 1 < samples_.size(); first += group_size) {
        Group g{first, std::min(first + group_size, samples_.size() - 1), {}, 0, 0};
        g.centre = 0.5 * (samples_[g.first].at + samples_[g.last].at);
        for (std::size_t i = g.first; i <= g.last; ++i) {
            const Sample& s = samples_[i];
            const double r = *std::max_element(s.radii, s.radii + 4);
            g.radius = std::max(g.radius, norm(s.at - g.centre));
            g.largest = std::max(g.largest, r);
            bounds_ = bounds_.united(Box::around(s.at, {r, r, r}));
        }
        groups_.push_back(g);
    }
}

SweepPlace Sweep::section(const Sample& f, Vec p, double overshoot, Cap cap, bool beyond) const {
    const Vec d = p - f.at, v = cross(f.tangent, f.u);
    const double x = dot(d, f.u), y = dot(d, v);
    const double a = x >= 0 ? f.radii[0] : f.radii[1], b = y >= 0 ? f.radii[2] : f.radii[3];
    const double shortest = std::min(std::min(f.radii[0], f.radii[1]), std::min(f.radii[2], f.radii[3]));
    SweepPlace out{};
    out.s = f.s;
    out.phi = std::atan2(y / b, x / a);
    out.radius = 0.25 * (f.radii[0] + f.radii[1] + f.radii[2] + f.radii[3]);
    const double c = beyond && cap == Cap::round ? shortest : 0, z = c > 0 ? overshoot / c : 0;
    const double gauge = std::sqrt(x / a * (x / a) + y / b * (y / b) + z * z);
    const double ga = x / (a * a), gb = y / (b * b), gc = c > 0 ? z / c : 0;
    const double grad = std::sqrt(ga * ga + gb * gb + gc * gc);
    double value = grad > 1e-12 ? std::max(-shortest, gauge * (gauge - 1) / grad) : -shortest;
    value /= std::sqrt(1 + f.slope * f.slope); // on caps too, or offsets would tear where they begin
    if (cap == Cap::flat) {
        const double plane = beyond ? overshoot : -overshoot; // overshoot: distance past, or else still to go
        value = plane > 0 && value > 0 ? std::sqrt(plane * plane + value * value) : std::max(value, plane);
    }
    out.value = value;
    return out;
}

/// The foot of p on the cubic (Hermite) between samples i and i + 1, where one is known to lie.
SweepPlace Sweep::on_segment(Vec p, std::size_t i) const {
    const Sample &a = samples_[i], &b = samples_[i + 1];
    const double h = b.s - a.s;
    const Vec ta = h * a.tangent, tb = h * b.tangent;
    double low = 0, high = 1, t = 0.5;
    Vec c, d;
    for (int step = 0; step < 8; ++step) {
        const double t2 = t * t, t3 = t2 * t;
        c = (2 * t3 - 3 * t2 + 1) * a.at + (t3 - 2 * t2 + t) * ta + (3 * t2 - 2 * t3) * b.at + (t3 - t2) * tb;
        d = (6 * t2 - 6 * t) * a.at + (3 * t2 - 4 * t + 1) * ta + (6 * t - 6 * t2) * b.at +
            (3 * t2 - 2 * t) * tb;
        const double g = dot(c - p, d);
        (g <= 0 ? low : high) = t;
        const Vec dd = (12 * t - 6) * a.at + (6 * t - 4) * ta + (6 - 12 * t) * b.at + (6 * t - 2) * tb;
        const double slope = dot(d, d) + dot(c - p, dd);
        double next = slope > 0 ? t - g / slope : 0.5 * (low + high);
        if (!(next >= low && next <= high)) next = 0.5 * (low + high);
        if (std::abs(next - t) < 1e-9) break;
        t = next;
    }
    Sample f{};
    f.at = c;
    f.tangent = normalised(d);
    f.u = normalised(perpendicular((1 - t) * a.u + t * b.u, f.tangent));
    f.s = a.s + t * h;
    f.slope = (1 - t) * a.slope + t * b.slope;
    for (int k = 0; k < 4; ++k)
        f.radii[k] = (1 - t) * a.radii[k] + t * b.radii[k];
    const double to_go = length() - f.s;
    if (start_ == Cap::flat && (end_ != Cap::flat || f.s < to_go))
        return section(f, p, f.s, Cap::flat, false);
    if (end_ == Cap::flat) return section(f, p, to_go, Cap::flat, false);
    return section(f, p, 0, Cap::round, false);
}

SweepPlace Sweep::place(Vec p) const {
    SweepPlace best{};
    best.value = std::numeric_limits<double>::infinity();
    const auto consider = [&](const SweepPlace& place) {
        if (place.value < best.value) best = place;
    };
    const Sample &first = samples_.front(), &last = samples_.back();
    if (const double past = -dot(p - first.at, first.tangent); past >= 0)
        consider(section(first, p, past, start_, true));
    if (const double past = dot(p - last.at, last.tangent); past >= 0)
        consider(section(last, p, past, end_, true));
    for (const Group& g : groups_) {
        if (norm(p - g.centre) - g.radius - g.largest > std::max(best.value, 0.0) * 1.5 + 1) continue;
        double before = dot(samples_[g.first].at - p, samples_[g.first].tangent);
        for (std::size_t i = g.first; i < g.last; ++i) {
            const double after = dot(samples_[i + 1].at - p, samples_[i + 1].tangent);
            if (before <= 0 && after > 0)
                consider(on_segment(p, i)); // the distance has a minimum between the two
            before = after;
        }
    }
    if (std::isinf(best.value)) { // rounding hid every foot: take the nearest sample
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < samples_.size(); ++i)
            if (norm(samples_[i].at - p) < norm(samples_[nearest].at - p)) nearest = i;
        best = section(samples_[nearest], p, 0, Cap::round, false);
    }
    return best;
}

Vec Sweep::point(double s) const {
    s = std::clamp(s, 0.0, length());
    std::size_t i = 0;
    while (i + 2 < samples_.size() && samples_[i + 1].s < s)
        ++i;
    const double t = (s - samples_[i].s) / (samples_[i + 1].s - samples_[i].s);
    return (1 - t) * samples_[i].at + t * samples_[i + 1].at;
}

} // namespace calot::mesher
