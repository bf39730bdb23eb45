// Closest points between points, segments and triangles, in double precision.
#pragma once

#include "geometry/vec3.hpp"

#include <cstdint>

namespace calot::geometry {

// Which part of a triangle (a, b, c) a point lies on. Edge k runs from vertex k to vertex (k + 1) % 3.
enum class TrianglePart : std::uint8_t { vertex0, vertex1, vertex2, edge0, edge1, edge2, face };

struct PointOnTriangle {
    Vec3 point;
    TrianglePart part;
};

// Point of triangle (a, b, c) closest to p, by the Voronoi regions of its parts (Ericson 2005, 5.1.5). Also
// defined for triangles without area, as the closest point of the segment or point they are.
PointOnTriangle closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c);

struct SegmentPair {
    double s, t; // parameters in [0, 1] on the first and the second segment
    Vec3 on_first, on_second;
    double distance2;
};

// Closest points of segments p0-p1 and q0-q1. Of parallel overlapping segments, the middle of the overlap.
SegmentPair closest_of_segments(Vec3 p0, Vec3 p1, Vec3 q0, Vec3 q1);

struct SegmentTrianglePair {
    double t; // on the segment, [0, 1]
    Vec3 on_segment, on_triangle;
    double distance2; // 0: they intersect
};

// Closest points of segment p0-p1 and triangle (a, b, c). Ties go to the lowest of: intersection, p0, p1,
// edges.
SegmentTrianglePair closest_segment_triangle(Vec3 p0, Vec3 p1, Vec3 a, Vec3 b, Vec3 c);

} // namespace calot::geometry
