// Cost of the queries, by Google Benchmark: calot_geometry_benchmark [--benchmark_filter=...].
// One stomach-like closed wall of 20,000 triangles (12 x 12 x 24 cm inside, 4 mm thick, folded inside), a
// shaft of 100 segments of 10 mm (radius 6.3 mm) along its folds, and 100 spheres of 6 mm along the same
// wall.
#include "geometry/chain_contacts.hpp"
#include "geometry/distance.hpp"
#include "geometry/self_contacts.hpp"
#include "geometry/test_shapes.hpp"

#include <benchmark/benchmark.h>
#ifdef CALOT_HAS_EMBREE
#include <embree3/rtcore.h>
#endif

#include <algorithm>

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

// The nearest points to 100 points within their spheres: 0 along the wall, where every sphere finds much; 1
// anywhere in the wall's box, where most find nothing.
std::vector<Vec3> centres(std::int64_t where) {
    std::vector<Vec3> points;
    if (where == 0) {
        const Shaft shaft(100, 0);
        for (std::size_t i = 0; i < 100; ++i)
            points.push_back(shaft.chain().node(i));
    } else {
        Random random(41);
        for (int i = 0; i < 100; ++i)
            points.push_back({random.in(-0.064, 0.064), random.in(-0.064, 0.064), random.in(-0.124, 0.124)});
    }
    return points;
}

constexpr double sphere = 6e-3;

void spheres_100(benchmark::State& state) {
    const TriangleScene& scene = wall();
    const std::vector<Vec3> points = centres(state.range(0));
    double sum = 0;
    for (auto _ : state) {
        sum = 0;
        for (const Vec3& p : points)
            sum += nearest_point(scene, p, sphere).distance;
    }
    state.counters["triangles"] = static_cast<double>(scene.triangles().size());
    state.counters["sum_mm"] = 1e3 * sum;
}
BENCHMARK(spheres_100)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

#ifdef CALOT_HAS_EMBREE
// The same by Embree's point queries over the same triangles, distances in double precision in its callback.
struct EmbreeQuery {
    const Shape* shape;
    Vec3 p;
    double best2;
};

bool try_triangle(RTCPointQueryFunctionArguments* arguments) {
    auto& query = *static_cast<EmbreeQuery*>(arguments->userPtr);
    const Shape& shape = *query.shape;
    const std::uint32_t t = arguments->primID;
    const Vec3 q =
        closest_on_triangle(query.p, shape.corner(t, 0), shape.corner(t, 1), shape.corner(t, 2)).point;
    if (norm2(query.p - q) >= query.best2) return false;
    query.best2 = norm2(query.p - q);
    arguments->query->radius = static_cast<float>(std::sqrt(query.best2) * (1 + 1e-6));
    return true;
}

void spheres_100_embree(benchmark::State& state) {
    const Shape shape = stomach(72, 71);
    const std::vector<Vec3> points = centres(state.range(0));
    const RTCDevice device = rtcNewDevice("threads=1");
    const RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, shape.vertices.size() / 3));
    std::copy(shape.vertices.begin(), shape.vertices.end(), vertices);
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, shape.triangle_count()));
    std::copy(shape.triangles.begin(), shape.triangles.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);
    double sum = 0;
    for (auto _ : state) {
        sum = 0;
        for (const Vec3& p : points) {
            EmbreeQuery query{&shape, p, sphere * sphere};
            RTCPointQuery point{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z),
                                0.0f, static_cast<float>(sphere * (1 + 1e-6))};
            RTCPointQueryContext context;
            rtcInitPointQueryContext(&context);
            rtcPointQuery(scene, &point, &context, try_triangle, &query);
            if (query.best2 < sphere * sphere) sum += std::sqrt(query.best2);
        }
    }
    state.counters["sum_mm"] = 1e3 * sum;
    rtcReleaseGeometry(geometry);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
}
BENCHMARK(spheres_100_embree)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
#endif

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

// Contacts with itself of a shaft of 100 segments wound into touching turns.
void self_100(benchmark::State& state) {
    std::vector<double> block(303);
    const std::vector<double> radii(100, radius);
    for (int i = 0; i < 101; ++i) {
        const double angle = i * 0.01 / 0.03;
        block[i] = 0.03 * std::cos(angle);
        block[101 + i] = 0.03 * std::sin(angle);
        block[202 + i] = 2 * radius * angle / 6.283185307179586;
    }
    SelfContacts query(101);
    std::size_t contacts = 0;
    for (auto _ : state)
        contacts = query.find(Chain::of_block(block, radii), margin).size();
    state.counters["contacts"] = static_cast<double>(contacts);
}
BENCHMARK(self_100)->Unit(benchmark::kMicrosecond);

// Inside or outside of any organ, 100 points.
void inside_100(benchmark::State& state) {
    const TriangleScene& scene = wall();
    const Shaft shaft(100, 0);
    for (auto _ : state)
        for (std::size_t i = 0; i < 100; ++i)
            benchmark::DoNotOptimize(organ_containing(scene, shaft.chain().node(i)));
}
BENCHMARK(inside_100)->Unit(benchmark::kMicrosecond);

} // namespace

BENCHMARK_MAIN();
