// Splits triangles that span a large angle before the lens bends them: a straight edge is a curve there.
layout(triangles) in;
layout(triangle_strip, max_vertices = 24) out;

#include "camera.glsl"

in Vertex {
    vec3 local;
    vec3 normal;
    vec3 rest;
    vec4 outer;
    vec4 inner;
    vec4 gloss;
    vec4 open;
} corner[];

out Vertex {
    vec3 local;
    vec3 normal;
    vec3 rest;
    vec4 outer;
    vec4 inner;
    vec4 gloss;
    vec4 open;
} v;

const float kStep = 0.16; // rad, the largest angle of an unsplit edge
const int kMost = 4;

// Never more than what the clusters are sorted by (SurfaceStore::select), so that an edge shared with an unsplit
// triangle stays whole.
float edge_steps(vec3 a, vec3 b) {
    float angle = length(b - a) / max(min(length(a), length(b)), 1e-5);
    return clamp(ceil(angle / kStep), 1.0, float(kMost));
}

// Steps of the edges 0-1, 1-2, 2-0: both triangles of an edge split it in the same way.
vec3 g_steps;

// The nearest of `steps` places along an edge, and the weight of its other end: both as quotients of whole numbers, so that
// the neighbour, which counts from that other end, finds the same bits.
float snap(float weight, float steps, out float other) {
    float k = round(weight * steps);
    other = (steps - k) / steps;
    return k / steps;
}

void emit(float a, float b) {
    float c = 1.0 - a - b;
    const float kOn = 1e-4;
    if (a < kOn) {
        b = snap(b, g_steps.y, c);
        a = 0.0;
    } else if (b < kOn) {
        a = snap(a, g_steps.x, c);
        b = 0.0;
    } else if (c < kOn) {
        a = snap(a, g_steps.z, b);
        c = 0.0;
    }
    vec3 p = a * corner[0].local + b * corner[2].local + c * corner[1].local;
    v.local = p;
    v.normal = a * corner[0].normal + b * corner[2].normal + c * corner[1].normal;
    v.rest = a * corner[0].rest + b * corner[2].rest + c * corner[1].rest;
    v.outer = a * corner[0].outer + b * corner[2].outer + c * corner[1].outer;
    v.inner = a * corner[0].inner + b * corner[2].inner + c * corner[1].inner;
    v.gloss = a * corner[0].gloss + b * corner[2].gloss + c * corner[1].gloss;
    v.open = a * corner[0].open + b * corner[2].open + c * corner[1].open;
    gl_Position = to_clip(p);
    gl_ClipDistance[0] = clip_distance(p, p);
    EmitVertex();
}

void main() {
    vec3 a = corner[0].local, b = corner[1].local, c = corner[2].local;
    if (max(a.z + 0.3 * length(a), max(b.z + 0.3 * length(b), c.z + 0.3 * length(c))) < 0.0) return;
    g_steps = vec3(edge_steps(a, b), edge_steps(b, c), edge_steps(c, a));
    int n = int(max(g_steps.x, max(g_steps.y, g_steps.z)));
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
