#include "rendering/optics.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace calot::rendering {
namespace {
constexpr double kDegree = std::numbers::pi / 180;
// The drawn cone reaches a little past the mask, so that triangles across its edge are complete.
constexpr double kConeMargin = 25 * kDegree;
} // namespace

double fisheye_radius(const Optics& o, double theta) {
    const double t2 = theta * theta;
    return theta * (1 + t2 * (o.k[0] + t2 * (o.k[1] + t2 * (o.k[2] + t2 * o.k[3]))));
}

double fisheye_angle(const Optics& o, double radius) {
    double low = 0, high = o.field_of_view / 2;
    if (radius >= fisheye_radius(o, high)) return high;
    for (int i = 0; i < 60; ++i) {
        const double mid = (low + high) / 2;
        (fisheye_radius(o, mid) < radius ? low : high) = mid;
    }
    return (low + high) / 2;
}

void check(const Optics& o) {
    if (!(o.field_of_view >= 10 * kDegree && o.field_of_view <= 200 * kDegree))
        throw std::invalid_argument("optics: field_of_view must lie in 10..200 degrees");
    for (double k : o.k)
        if (!std::isfinite(k)) throw std::invalid_argument("optics: k1..k4 must be finite numbers");
    if (!(o.near > 0 && o.far > o.near && std::isfinite(o.far)))
        throw std::invalid_argument("optics: need 0 < near < far");
    if (!(o.light_exponent >= 0 && o.light_exponent <= 64))
        throw std::invalid_argument("optics: light_exponent must lie in 0..64");
    const double end = o.field_of_view / 2 + kConeMargin;
    double last = 0;
    for (int i = 1; i <= 256; ++i) {
        const double r = fisheye_radius(o, end * i / 256);
        if (!(r > last))
            throw std::invalid_argument(
                "optics: with these k1..k4 the image radius does not grow with the angle");
        last = r;
    }
}

double mask_half_side(const Optics& o) {
    return fisheye_radius(o, o.field_of_view / 2) / std::sqrt(1 + kMaskCorner * kMaskCorner);
}

bool project(const Optics& o, const std::array<double, 3>& p, double& x, double& y) {
    const double s = std::hypot(p[0], p[1]);
    const double theta = std::atan2(s, p[2]);
    if (theta > o.field_of_view / 2 + kConeMargin) return false;
    const double r = fisheye_radius(o, theta) / mask_half_side(o);
    x = s > 0 ? -p[0] / s * r : 0;
    y = s > 0 ? -p[1] / s * r : 0;
    return true;
}

} // namespace calot::rendering
