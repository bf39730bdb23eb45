layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec4 a_colour; // a: 1 for the core, less for the halo around it

#include "camera.glsl"

out vec3 v_local;
out vec3 v_normal;
out vec4 v_colour;

void main() {
    vec3 p = to_local(a_position);
    v_local = p;
    v_normal = u_to_local * a_normal;
    v_colour = a_colour;
    gl_Position = to_clip(p);
    gl_ClipDistance[0] = clip_distance(a_position, p);
}
