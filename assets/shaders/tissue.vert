layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec4 a_outer; // colour of the outer side, as its root; a: how much its vessels show
layout(location = 3) in vec4 a_inner; // likewise of the inner side
layout(location = 4) in vec4 a_gloss; // sheen, wet, bump, soft
layout(location = 5) in vec4 a_open;  // ambient openness of outer and inner side; where trunks and branches of vessels are
layout(location = 6) in vec3 a_rest;  // where the point was at rest: noise sticks to the tissue

#include "camera.glsl"

uniform mat3 u_model;
uniform vec3 u_origin;

out Vertex {
    vec3 local; // in the camera's frame, like the normal
    vec3 normal;
    vec3 rest;
    vec4 outer;
    vec4 inner;
    vec4 gloss;
    vec4 open;
} v;

void main() {
    vec3 world = u_model * a_position + u_origin;
    v.normal = u_to_local * (u_model * a_normal);
    v.rest = a_rest;
    v.outer = vec4(a_outer.rgb * a_outer.rgb, a_outer.a);
    v.inner = vec4(a_inner.rgb * a_inner.rgb, a_inner.a);
    v.gloss = a_gloss;
    v.open = a_open;
    vec3 p = to_local(world);
    v.local = p;
#ifndef SUBDIVIDE
    gl_Position = to_clip(p);
    gl_ClipDistance[0] = clip_distance(world, p);
#endif
}
