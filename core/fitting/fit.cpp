#include "fitting/fit.hpp"

#include "fitting/three_point_bend.hpp"
#include "host/error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <numeric>

namespace calot::fitting {

namespace {

constexpr int fewest_readings = 3, fewest_peaks = 4;
constexpr double far_out = 6;              // times the usual distance
constexpr double smallest_share = 1e-3;    // of the largest load: a gauge's resolution; less is no outlier
constexpr std::size_t enough_to_judge = 5; // readings, of which some may be set aside

// 97.5 % point of Student's t (Hill, Comm. ACM 13 (1970) 619, the expansion in 1/n; exact for 1 and 2).
double student(int degrees) {
    const double z = 1.959963984540054;
    if (degrees == 1) return 12.7062047;
    if (degrees == 2) return 4.3026527;
    const double n = degrees, z2 = z * z;
    return z * (1 + (z2 + 1) / (4 * n) + ((5 * z2 + 16) * z2 + 3) / (96 * n * n) +
                (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n * n * n));
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

[[noreturn]] void refuse(const std::string& file, const Reading& r, const std::string& column,
                         const std::string& what) {
    throw host::UserError(file, "line " + std::to_string(r.line) + ": " + column, what);
}

// Marks what is far from the median of load/g, where the weight of each is its lever g.
void set_outliers_aside(std::vector<Residual>& all, const std::vector<double>& g) {
    if (all.size() < enough_to_judge) return;
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), 0);
    std::erase_if(order, [&](std::size_t i) { return g[i] == 0; });
    const auto ratio = [&](std::size_t i) { return all[i].reading.load / g[i]; };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return ratio(a) < ratio(b); });
    double half = 0;
    for (const std::size_t i : order)
        half += 0.5 * std::abs(g[i]);
    double figure = 0, so_far = 0;
    for (const std::size_t i : order) {
        so_far += std::abs(g[i]);
        if (so_far >= half) {
            figure = ratio(i);
            break;
        }
    }
    std::vector<double> distance;
    double largest = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        distance.push_back(std::abs(all[i].reading.load - figure * g[i]));
        largest = std::max(largest, std::abs(all[i].reading.load));
    }
    // 1.4826: a normal distribution's deviation over the median distance.
    const double usual = std::max(1.4826 * median(distance), smallest_share * largest);
    for (std::size_t i = 0; i < all.size(); ++i)
        all[i].is_set_aside = distance[i] > far_out * usual;
}

// Least squares over the readings that `uses` picks.
Figure proportion(const std::vector<Residual>& all, const std::vector<double>& g,
                  const std::function<bool(std::size_t)>& uses) {
    double gg = 0, gl = 0;
    int count = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
        if (!all[i].is_set_aside && uses(i)) gg += g[i] * g[i], gl += g[i] * all[i].reading.load, ++count;
    Figure f;
    if (count < fewest_readings || gg == 0) return f;
    f.value = gl / gg;
    double squares = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
        if (!all[i].is_set_aside && uses(i)) {
            const double r = all[i].reading.load - f.value * g[i];
            squares += r * r;
        }
    f.half_width = student(count - 1) * std::sqrt(squares / (count - 1) / gg);
    return f;
}

void summarize(SegmentFit& fit) {
    double squares = 0;
    for (const Residual& r : fit.residuals) {
        if (r.is_set_aside) {
            ++fit.set_aside;
            continue;
        }
        ++fit.used;
        squares += r.residual * r.residual;
        fit.worst = std::max(fit.worst, std::abs(r.residual));
    }
    fit.rms = std::sqrt(squares / std::max(fit.used, 1));
}

void fit_rigidity(SegmentFit& fit, const std::string& file) {
    std::vector<double> g;
    for (const Residual& r : fit.residuals) {
        const Reading& at = r.reading;
        if (fit.test == BenchTest::twist) {
            g.push_back(at.x / at.size);
            continue;
        }
        const double share = at.x / at.size;
        if (std::abs(share) > largest_deflection)
            refuse(
                file, at, "deflection",
                "is more than a fifth of the span, where the load hardly grows with it; bend less, or over a "
                "longer span");
        g.push_back(three_point_load(share) / (at.size * at.size));
    }
    const Reading& first = fit.residuals.front().reading;
    const char* const x = fit.test == BenchTest::bend ? "deflection" : "angle";
    if (static_cast<int>(fit.residuals.size()) < fewest_readings)
        refuse(file, first, "segment",
               "\"" + fit.segment + "\" has fewer than three rows of " + name(fit.test) + "; measure more");
    if (std::all_of(g.begin(), g.end(), [](double v) { return v == 0; }))
        refuse(file, first, x, "is zero in every row of \"" + fit.segment + "\"; measure under load");
    set_outliers_aside(fit.residuals, g);
    fit.rigidity = proportion(fit.residuals, g, [](std::size_t) { return true; });
    if (!(fit.rigidity.value > 0))
        refuse(file, first, fit.test == BenchTest::bend ? "force" : "torque",
               "does not grow with the " + std::string(x) + " in the rows of \"" + fit.segment +
                   "\": stiffness would not be positive; correct the signs");
    if (fit.test == BenchTest::twist) {
        const Figure right = proportion(fit.residuals, g, [&](std::size_t i) { return g[i] > 0; });
        const Figure left = proportion(fit.residuals, g, [&](std::size_t i) { return g[i] < 0; });
        if (right.value > 0 && left.value > 0) fit.right = right, fit.left = left;
    }
    // With both ways round known, each is its own model.
    for (std::size_t i = 0; i < fit.residuals.size(); ++i) {
        Residual& r = fit.residuals[i];
        const bool is_split = !std::isnan(fit.right.value);
        const double k = !is_split ? fit.rigidity.value : g[i] >= 0 ? fit.right.value : fit.left.value;
        r.fitted = k * g[i];
        r.residual = r.reading.load - r.fitted;
    }
    summarize(fit);
}

// A common slope of y over x in several recordings, each with its own intercept.
struct Slope {
    Figure slope;
    std::vector<double> intercept; // by recording
};

Slope common_slope(const std::vector<std::vector<std::array<double, 2>>>& recordings) {
    double xx = 0, xy = 0;
    int count = 0;
    std::vector<std::array<double, 2>> mean;
    for (const auto& recording : recordings) {
        std::array<double, 2> m{};
        for (const auto& p : recording)
            m[0] += p[0], m[1] += p[1];
        const auto n = static_cast<double>(std::max<std::size_t>(recording.size(), 1));
        m[0] /= n, m[1] /= n;
        mean.push_back(m);
        for (const auto& p : recording)
            xx += (p[0] - m[0]) * (p[0] - m[0]), xy += (p[0] - m[0]) * (p[1] - m[1]), ++count;
    }
    Slope s;
    s.slope.value = xx > 0 ? xy / xx : std::numeric_limits<double>::quiet_NaN();
    double squares = 0;
    for (std::size_t k = 0; k < recordings.size(); ++k) {
        s.intercept.push_back(mean[k][1] - s.slope.value * mean[k][0]);
        for (const auto& p : recordings[k]) {
            const double r = p[1] - s.intercept[k] - s.slope.value * p[0];
            squares += r * r;
        }
    }
    const int degrees = count - 1 - static_cast<int>(recordings.size());
    if (degrees > 0 && xx > 0)
        s.slope.half_width = student(degrees) * std::sqrt(squares / degrees / xx);
    else
        s.slope.half_width = std::numeric_limits<double>::infinity();
    return s;
}

void fit_vibration(SegmentFit& fit, const std::string& file) {
    // Peaks of each recording: time over number gives the period, log amplitude over time the decay.
    std::vector<std::vector<std::array<double, 2>>> times, logs;
    std::vector<std::size_t> recording;
    double last = std::numeric_limits<double>::infinity();
    for (const Residual& r : fit.residuals) {
        if (r.reading.x == last) refuse(file, r.reading, "time", "is that of the row before; leave one out");
        if (r.reading.x < last) times.emplace_back(), logs.emplace_back();
        last = r.reading.x;
        times.back().push_back({static_cast<double>(times.back().size()), r.reading.x});
        logs.back().push_back({r.reading.x, std::log(r.reading.load)});
        recording.push_back(logs.size() - 1);
    }
    const Reading& first = fit.residuals.front().reading;
    for (std::size_t k = 0, at = 0; k < logs.size(); at += logs[k].size(), ++k)
        if (static_cast<int>(logs[k].size()) < fewest_peaks)
            refuse(file, fit.residuals[at].reading, "time",
                   "begins a recording of fewer than four peaks; give more of them, in the order of time");
    const Slope decay = common_slope(logs), period = common_slope(times);
    fit.decay = {-decay.slope.value, decay.slope.half_width};
    if (!(fit.decay.value > 0))
        refuse(file, first, "amplitude",
               "does not decay in the rows of \"" + fit.segment + "\"; correct them");
    const double turn = 2 * std::numbers::pi;
    fit.frequency.value = turn / period.slope.value;
    fit.frequency.half_width = fit.frequency.value * period.slope.half_width / period.slope.value;
    const double w2 = fit.frequency.value * fit.frequency.value;
    fit.damping.value = 2 * fit.decay.value / w2;
    fit.damping.half_width =
        fit.damping.value * std::hypot(fit.decay.half_width / fit.decay.value,
                                       2 * fit.frequency.half_width / fit.frequency.value);
    for (std::size_t i = 0; i < fit.residuals.size(); ++i) {
        Residual& r = fit.residuals[i];
        const double fitted = decay.intercept[recording[i]] - fit.decay.value * r.reading.x;
        r.fitted = std::exp(fitted);
        r.residual = std::log(r.reading.load) - fitted;
    }
    summarize(fit);
}

} // namespace

std::vector<SegmentFit> fit(const std::vector<Reading>& readings, const std::string& file) {
    std::vector<SegmentFit> fits;
    std::map<std::pair<std::string, BenchTest>, std::size_t> place;
    for (const Reading& r : readings) {
        const auto [found, is_new] = place.try_emplace({r.segment, r.test}, fits.size());
        if (is_new) {
            SegmentFit f;
            f.segment = r.segment, f.test = r.test;
            fits.push_back(std::move(f));
        }
        Residual residual;
        residual.reading = r;
        fits[found->second].residuals.push_back(std::move(residual));
    }
    for (SegmentFit& f : fits) {
        if (f.test == BenchTest::vibration)
            fit_vibration(f, file);
        else
            fit_rigidity(f, file);
    }
    return fits;
}

} // namespace calot::fitting
