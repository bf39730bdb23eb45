#include "bench/embree_spheres.hpp"

#ifdef CALOT_HAS_EMBREE
#include "geometry/distance.hpp"

#include <algorithm>
#include <cmath>
#include <embree3/rtcore.h>
#endif

namespace calot::bench {

#ifdef CALOT_HAS_EMBREE

namespace {

using geometry::Vec3;

struct Query {
    const Surface* surface;
    Vec3 p;
    double best2;
};

// Embree proposes triangles by float boxes; the distance is ours, so that both find the same.
bool try_triangle(RTCPointQueryFunctionArguments* arguments) {
    auto& query = *static_cast<Query*>(arguments->userPtr);
    const std::uint32_t t = arguments->primID;
    const Vec3 q = geometry::closest_on_triangle(query.p, query.surface->corner(t, 0),
                                                 query.surface->corner(t, 1), query.surface->corner(t, 2))
                       .point;
    const double distance2 = norm2(query.p - q);
    if (distance2 >= query.best2) return false;
    query.best2 = distance2;
    arguments->query->radius = static_cast<float>(std::sqrt(distance2) * (1 + 1e-6));
    return true;
}

class Spheres : public EmbreeSpheres {
  public:
    explicit Spheres(const Surface& surface) : surface_(surface) {
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
        const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, surface.vertices.size() / 3));
        std::transform(surface.vertices.begin(), surface.vertices.end(), vertices,
                       [](double v) { return static_cast<float>(v); });
        auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, surface.triangle_count()));
        std::copy(surface.triangles.begin(), surface.triangles.end(), indices);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene_);
    }
    ~Spheres() override {
        rtcReleaseScene(scene_);
        rtcReleaseDevice(device_);
    }
    Spheres(const Spheres&) = delete;
    Spheres& operator=(const Spheres&) = delete;

    double distances(std::span<const Vec3> centres, double reach) const override {
        double sum = 0;
        for (const Vec3& p : centres) {
            Query query{&surface_, p, reach * reach};
            RTCPointQuery point{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z),
                                0.0f, static_cast<float>(reach * (1 + 1e-6))};
            RTCPointQueryContext context;
            rtcInitPointQueryContext(&context);
            rtcPointQuery(scene_, &point, &context, try_triangle, &query);
            if (query.best2 < reach * reach) sum += std::sqrt(query.best2);
        }
        return sum;
    }

  private:
    const Surface& surface_;
    RTCDevice device_ = rtcNewDevice("threads=1");
    RTCScene scene_ = rtcNewScene(device_);
};

} // namespace

std::unique_ptr<EmbreeSpheres> EmbreeSpheres::make(const Surface& surface) {
    return std::make_unique<Spheres>(surface);
}

#else

std::unique_ptr<EmbreeSpheres> EmbreeSpheres::make(const Surface&) {
    return nullptr;
}

#endif

} // namespace calot::bench
