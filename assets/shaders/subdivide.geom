// Splits triangles that span a large angle before the lens bends them: a straight edge is a curve there.
layout(triangles) in;
layout(triangle_strip, max_vertices = 48) out;

#include "camera.glsl"

in Vertex {
    vec3 local;
    vec3 normal;
    vec3 rest;
    vec4 colour;
    float concave;
} corner[];

out Vertex {
    vec3 local;
    vec3 normal;
    vec3 rest;
    vec4 colour;
    float concave;
} v;

const float kStep = 0.16; // rad, the largest angle of an unsplit edge
const int kMost = 6;

float edge_angle(vec3 a, vec3 b) {
    float nearest = max(min(length(a), length(b)) - 0.5 * length(b - a), 0.25 * length(b - a));
    return length(b - a) / max(nearest, 1e-5);
}

void emit(float a, float b) {
    float c = 1.0 - a - b;
    vec3 p = a * corner[0].local + b * corner[2].local + c * corner[1].local;
    v.local = p;
    v.normal = a * corner[0].normal + b * corner[2].normal + c * corner[1].normal;
    v.rest = a * corner[0].rest + b * corner[2].rest + c * corner[1].rest;
    v.colour = a * corner[0].colour + b * corner[2].colour + c * corner[1].colour;
    v.concave = a * corner[0].concave + b * corner[2].concave + c * corner[1].concave;
    gl_Position = to_clip(p);
    gl_ClipDistance[0] = clip_distance(p, p);
    EmitVertex();
}

void main() {
    vec3 a = corner[0].local, b = corner[1].local, c = corner[2].local;
    if (max(a.z + 0.3 * length(a), max(b.z + 0.3 * length(b), c.z + 0.3 * length(c))) < 0.0) return;
    float angle = max(edge_angle(a, b), max(edge_angle(b, c), edge_angle(c, a)));
    int n = clamp(int(ceil(angle / kStep)), 1, kMost);
    float s = 1.0 / float(n);
    for (int row = 0; row < n; ++row) {
        // The strip between the lines a = row s and a = (row + 1) s, counter-clockwise like its triangle.
        float low = float(row) * s, high = float(row + 1) * s;
        for (int i = 0; i < n - row; ++i) {
            emit(high, (float(i)) * s);
            emit(low, (float(i)) * s);
        }
        emit(low, (float(n - row)) * s);
        EndPrimitive();
    }
}
