// Cost of the queries, by Google Benchmark: calot_geometry_benchmark [--benchmark_filter=...].
// One stomach-like closed wall of 20,000 triangles (12 x 12 x 24 cm inside, 4 mm thick, folded inside), a
// shaft of 100 segments of 10 mm (radius 6.3 mm) along its folds, and 100 spheres of 6 mm along the same
// wall.
#include "geometry/chain_contacts.hpp"
#include "geometry/test_shapes.hpp"

#include <benchmark/benchmark.h>

using namespace calot::geometry;
using namespace calot::geometry::test;

namespace {

constexpr double radius = 6.3e-3, margin = 2e-3;

// Inner surface: an ellipsoid with folds along it; outer: 4 mm outside. Both 10,000 triangles.
Vec3 inner_point(double polar, double turn) {
    const double folds = 1.0 - 0.02 * std::sin(polar) * std::cos(14 * turn);
    return {0.06 * folds * std::sin(polar) * std::cos(turn), 0.06 * folds * std::sin(polar) * std::sin(turn),
            -0.12 * folds * std::cos(polar)};
}

Shape stomach(std::uint32_t stacks, std::uint32_t slices) {
    const Shape unit = sphere({0, 0, 0}, 1.0, stacks, slices);
    Shape inner = unit.mapped([](Vec3 v) {
        const double polar = std::acos(std::fmax(-1.0, std::fmin(1.0, -v.z)));
        return inner_point(polar, std::atan2(v.y, v.x));
    });
    const Shape outer = unit.mapped([](Vec3 v) { return Vec3{0.064 * v.x, 0.064 * v.y, 0.124 * v.z}; });
    for (std::size_t t = 0; t < unit.triangle_count(); ++t) // the solid lies outside of the lumen
        std::swap(inner.triangles[3 * t + 1], inner.triangles[3 * t + 2]);
    const auto first = static_cast<std::uint32_t>(inner.vertices.size() / 3);
    inner.vertices.insert(inner.vertices.end(), outer.vertices.begin(), outer.vertices.end());
    for (const std::uint32_t v : outer.triangles)
        inner.triangles.push_back(first + v);
    return inner;
}

// A shaft of 1 m wound along the inside of the wall, resting on it at a radius scaled by `inset`.
struct Shaft {
    std::vector<double> block, radii;

    Shaft(std::size_t nodes, double phase) : block(3 * nodes), radii(nodes - 1, radius) {
        double polar = 0.6, turn = phase;
        Vec3 last{};
        for (std::size_t i = 0; i < nodes; ++i) {
            // March along a helix until 10 mm from the node before.
            Vec3 p{};
            do {
                polar += 2e-5;
                turn += 2.2e-4;
                p = inner_point(polar, turn);
                p = (1.0 - (radius + 1e-4) / norm(p)) * p;
            } while (i > 0 && norm(p - last) < 0.010);
            last = p;
            block[i] = p.x;
            block[nodes + i] = p.y;
            block[2 * nodes + i] = p.z;
        }
    }
    Chain chain() const { return Chain::of_block(block, radii); }
};

const TriangleScene& wall() {
    static const TriangleScene scene = stomach(72, 71).scene();
    return scene;
}

void build(benchmark::State& state) {
    const auto side = static_cast<std::uint32_t>(state.range(0));
    const Shape shape = stomach(side, side);
    std::size_t triangles = 0;
    for (auto _ : state)
        triangles = shape.scene().triangles().size();
    state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(build)->Arg(72)->Arg(225)->Unit(benchmark::kMillisecond);

// Nearest point within 6 mm of each of 100 points along the wall.
void spheres_100(benchmark::State& state) {
    const TriangleScene& scene = wall();
    std::vector<Vec3> points;
    const Shaft shaft(100, 0);
    for (std::size_t i = 0; i < 100; ++i)
        points.push_back(shaft.chain().node(i));
    for (auto _ : state)
        for (const Vec3& p : points)
            benchmark::DoNotOptimize(nearest_point(scene, p, 7e-3));
    state.counters["triangles"] = static_cast<double>(scene.triangles().size());
}
BENCHMARK(spheres_100)->Unit(benchmark::kMicrosecond);

// Contacts of 100 capsules that slide along the wall, range(0) um a tick.
void capsules_100(benchmark::State& state) {
    const TriangleScene& scene = wall();
    const double speed = static_cast<double>(state.range(0)) * 1e-6;
    std::vector<Shaft> places;
    for (int i = 0; i < 200; ++i)
        places.emplace_back(101, speed * i / 0.06);
    ChainContacts query(101);
    std::size_t contacts = 0, at = 0;
    int step = 1;
    for (auto _ : state) {
        contacts = query.find(scene, places[at].chain(), margin).size();
        if (at == 199) step = -1;
        if (at == 0) step = 1;
        at += step;
    }
    state.counters["contacts"] = static_cast<double>(contacts);
}
BENCHMARK(capsules_100)->Arg(0)->Arg(30)->Arg(300)->Unit(benchmark::kMicrosecond);

// New boxes for 3,000 moved triangles.
void refit_3000(benchmark::State& state) {
    const Shape shape = stomach(28, 28);
    TriangleScene scene = shape.scene();
    for (auto _ : state)
        benchmark::DoNotOptimize(scene.move_vertices(shape.vertices));
    state.counters["triangles"] = static_cast<double>(scene.triangles().size());
}
BENCHMARK(refit_3000)->Unit(benchmark::kMicrosecond);

void inside(benchmark::State& state) {
    const TriangleScene& scene = wall();
    const Shaft shaft(100, 0);
    for (auto _ : state)
        for (std::size_t i = 0; i < 100; ++i)
            benchmark::DoNotOptimize(organ_containing(scene, shaft.chain().node(i)));
}
BENCHMARK(inside)->Unit(benchmark::kMicrosecond);

} // namespace

BENCHMARK_MAIN();
