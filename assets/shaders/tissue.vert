layout(location = 0) in vec3 a_position;
layout(location = 1) in vec4 a_normal; // w: how concave the surface is, -1..1
layout(location = 2) in vec4 a_colour;
layout(location = 3) in vec3 a_rest; // where the point was at rest: noise sticks to the tissue
layout(location = 4) in vec3 a_patches; // three smooth fields of noise, 0..1

#include "camera.glsl"

uniform mat3 u_model;
uniform vec3 u_origin;

out Vertex {
    vec3 local; // in the camera's frame, like the normal
    vec3 normal;
    vec3 rest;
    vec4 colour;
    vec4 patches;
} v;

void main() {
    vec3 world = u_model * a_position + u_origin;
    v.normal = u_to_local * (u_model * a_normal.xyz);
    v.rest = a_rest;
    v.colour = a_colour;
    v.patches = vec4(a_patches, a_normal.w);
    vec3 p = to_local(world);
    v.local = p;
#ifndef SUBDIVIDE
    gl_Position = to_clip(p);
    gl_ClipDistance[0] = clip_distance(world, p);
#endif
}
