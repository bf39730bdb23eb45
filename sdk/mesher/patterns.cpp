#include "patterns.hpp"

#include "noise.hpp"

#include <utility>

namespace calot::mesher {
namespace {

constexpr double pi = 3.14159265358979323846;

/// Around and along a sweep as a cylinder in noise space: `count` lattice cells round it, one cell per
/// `length`.
Vec around(const SweepPlace& at, double count, double length) {
    const double r = count / (2 * pi);
    return {r * std::cos(at.phi), r * std::sin(at.phi), at.s / length};
}

double of(const pattern::Rugae& r, Vec p) {
    const SweepPlace at = r.along->place(p);
    // Folds lie between the zeros of a phase that turns `count` times round the sweep and wanders along it;
    // noise stretched along the sweep makes them merge and part.
    const Vec slow = around(at, 0.4 * r.count, r.length);
    const double phase = std::round(0.5 * r.count) * at.phi + 2.4 * gradient_noise(slow, r.seed);
    const double n =
        0.55 * std::sin(phase) + 0.9 * gradient_noise(around(at, 0.8 * r.count, 0.7 * r.length), r.seed + 7);
    const double w = 0.5 * r.groove;
    return 1 - std::exp(-(n / w) * (n / w));
}

double of(const pattern::Folds& f, Vec p) {
    const SweepPlace at = f.along->place(p);
    const double wander = gradient_noise(around(at, 0.5 * f.count, f.length), f.seed);
    return std::cos(f.count * at.phi + 1.6 * wander);
}

/// Where a place lies among the thirds of the circumference between taeniae, and among their folds.
struct HaustrumPlace {
    std::int64_t third, fold; ///< which third, and which of its folds is the nearest
    double in_third;          ///< 0 and 1 on the taeniae
    double from_fold;         ///< of the spacing
};

HaustrumPlace haustrum(const SweepPlace& at, double first_band, double spacing, double slant,
                       std::uint32_t seed) {
    double turn = (at.phi - first_band * pi / 180) / (2 * pi) * 3;
    turn -= std::floor(turn / 3) * 3;
    HaustrumPlace out{static_cast<std::int64_t>(turn), 0, 0, 1e9};
    out.in_third = turn - static_cast<double>(out.third);
    // Folds of each third are shifted and jittered, so they alternate round the gut.
    const double shifted =
        at.s / spacing + 0.5 * hashed(out.third, 0, seed) + 0.33 * static_cast<double>(out.third);
    const auto i = static_cast<std::int64_t>(std::floor(shifted));
    for (std::int64_t k = i - 1; k <= i + 2; ++k) {
        const double tilt = slant == 0 ? 0 : slant * (2 * hashed(k, out.third + 4, seed) - 1);
        const double from = std::abs(shifted - static_cast<double>(k) -
                                     0.35 * hashed(k, out.third + 1, seed) - tilt * (out.in_third - 0.5));
        if (from < out.from_fold) out.from_fold = from, out.fold = k;
    }
    return out;
}

double of(const pattern::Haustra& h, Vec p) {
    const HaustrumPlace at = haustrum(h.along->place(p), h.first_band, h.spacing, 0, h.seed);
    const double from_band = std::min(at.in_third, 1 - at.in_third) * 120; // degrees
    const double off_band = smooth_step(0.4 * h.band, 1.6 * h.band, from_band);
    const double d = at.from_fold * h.spacing / h.crease;
    const double off_fold = 1 - std::exp(-d * d);
    // Between two folds the wall bulges rather than running flat.
    const double bulge = 0.75 + 0.25 * std::sin(pi * std::min(1.0, at.from_fold * 2));
    return off_band * off_fold * bulge;
}

double of(const pattern::Semilunar& f, Vec p) {
    const HaustrumPlace at = haustrum(f.along->place(p), f.first_band, f.spacing, 0.3, f.seed);
    // Depth of the chord of 120 degrees below its circle, over the depth in its middle.
    const double chord = 2 - 1 / std::cos((at.in_third - 0.5) * 2 * pi / 3);
    const double d = at.from_fold * f.spacing / f.width;
    const double crest = 0.85 * std::exp(-d * d) + 0.15 * std::exp(-d * d / 12); // on a broader foot
    return (0.7 + 0.3 * hashed(at.fold, at.third + 7, f.seed)) * chord * crest;
}

double of(const pattern::Rings& r, Vec p) {
    const SweepPlace at = r.along->place(p);
    const double along = at.s / r.spacing + r.pitch * at.phi / (2 * pi) +
                         0.25 * gradient_noise(around(at, 3, 2 * r.spacing), r.seed);
    const double ring = std::floor(along + 0.5);
    const double d = (along - ring) * r.spacing / r.width;
    double cover = 1;
    if (r.arc < 1) {
        const double middle = 2 * pi * hashed(static_cast<std::int64_t>(ring), 3, r.seed) - pi;
        double off = std::abs(at.phi - middle);
        off = std::min(off, 2 * pi - off) / pi;
        cover = 1 - smooth_step(0.85 * r.arc, 1.15 * r.arc, off);
    }
    return std::exp(-d * d) * cover;
}

double of(const pattern::Lobules& l, Vec p) {
    const Cell c = cell_noise({p.x / l.size.x, p.y / l.size.y, p.z / l.size.z}, l.seed);
    const double groove = 1 - std::exp(-c.edge * c.edge / 0.02);
    return groove * (0.6 + 0.4 * std::max(0.0, 1 - c.nearest * c.nearest));
}

double of(const pattern::Noise& n, Vec p) {
    return layered_noise({p.x / n.wavelength.x, p.y / n.wavelength.y, p.z / n.wavelength.z}, n.octaves,
                         n.seed);
}

double of(const pattern::Wave& w, Vec p) {
    return std::sin(2 * pi * dot(p, w.direction) / w.wavelength + w.phase * pi / 180);
}

class Displaced final : public Shape {
  public:
    Displaced(ShapePtr of, Pattern pattern, double height, Mask mask)
        : of_(std::move(of)), pattern_(std::move(pattern)), height_(height), mask_(std::move(mask)) {
        bounds_ = of_->bounds().grown(std::abs(height));
    }
    double value(Vec p) const override {
        const double v = of_->value(p);
        // A relief far from the surface moves nothing; it costs the most of all fields.
        if (std::abs(v) > 4 * std::abs(height_) + 6) return v;
        double weight = 1;
        if (mask_.only) weight *= smooth_step(0, mask_.fade, -mask_.only->value(p));
        if (weight > 0 && mask_.except) weight *= smooth_step(0, mask_.fade, mask_.except->value(p));
        if (weight <= 0) return v;
        return v - weight * height_ * relief(pattern_, p);
    }

  private:
    ShapePtr of_;
    Pattern pattern_;
    double height_;
    Mask mask_;
};

class Warped final : public Shape {
  public:
    Warped(ShapePtr of, Vec amplitude, double wavelength, int octaves, std::uint32_t seed)
        : of_(std::move(of)), amplitude_(amplitude), wavelength_(wavelength), octaves_(octaves), seed_(seed) {
        bounds_ = of_->bounds().grown(1.5 * std::max({amplitude.x, amplitude.y, amplitude.z}));
    }
    double value(Vec p) const override {
        const Vec q = (1 / wavelength_) * p;
        return of_->value(p + Vec{amplitude_.x * layered_noise(q, octaves_, seed_),
                                  amplitude_.y * layered_noise(q, octaves_, seed_ + 101),
                                  amplitude_.z * layered_noise(q, octaves_, seed_ + 202)});
    }

  private:
    ShapePtr of_;
    Vec amplitude_;
    double wavelength_;
    int octaves_;
    std::uint32_t seed_;
};

} // namespace

double relief(const Pattern& pattern, Vec p) {
    return std::visit([&](const auto& each) { return of(each, p); }, pattern);
}

ShapePtr make_displaced(ShapePtr of, Pattern pattern, double height, Mask mask) {
    return std::make_shared<Displaced>(std::move(of), std::move(pattern), height, std::move(mask));
}

ShapePtr make_warped(ShapePtr of, Vec amplitude, double wavelength, int octaves, std::uint32_t seed) {
    return std::make_shared<Warped>(std::move(of), amplitude, wavelength, octaves, seed);
}

} // namespace calot::mesher
