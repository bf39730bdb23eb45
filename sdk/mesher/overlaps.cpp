#include "overlaps.hpp"

#include <algorithm>
#include <cmath>

namespace calot::mesher {
namespace {

Overlap compare(const Organ& a, const Organ& b, double step) {
    Overlap found{a.name, b.name, 0, 0, {}};
    const Box box = a.solid->bounds().common(b.solid->bounds());
    // Points of one grid through the origin, so that a pair's result does not depend on the others.
    const auto first = [&](double low) { return std::ceil(low / step) * step; };
    std::size_t shared = 0;
    for (double z = first(box.low.z); z <= box.high.z; z += step)
        for (double y = first(box.low.y); y <= box.high.y; y += step)
            for (double x = first(box.low.x); x <= box.high.x; x += step) {
                const Vec p{x, y, z};
                const double in_a = -a.solid->value(p);
                if (in_a <= 0) continue;
                const double in_b = -b.solid->value(p);
                if (in_b <= 0) continue;
                ++shared;
                // Midway between the two surfaces both are half the depth away.
                if (const double depth = 2 * std::min(in_a, in_b); depth > found.depth)
                    found.depth = depth, found.deepest = p;
            }
    found.volume = static_cast<double>(shared) * step * step * step / 1000;
    return found;
}

} // namespace

std::vector<Overlap> find_overlaps(const std::vector<Organ>& organs, double step) {
    std::vector<Overlap> all;
    for (std::size_t i = 0; i < organs.size(); ++i)
        for (std::size_t j = i + 1; j < organs.size(); ++j)
            if (Overlap found = compare(organs[i], organs[j], step); found.volume > 0)
                all.push_back(std::move(found));
    std::sort(all.begin(), all.end(), [](const Overlap& a, const Overlap& b) { return a.depth > b.depth; });
    return all;
}

} // namespace calot::mesher
