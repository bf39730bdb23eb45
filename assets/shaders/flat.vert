// Shapes of the picture itself: masks, backgrounds, fades. Positions are in normalised device coordinates.
layout(location = 0) in vec2 a_position;
layout(location = 1) in vec4 a_colour;

uniform float u_depth;
uniform vec2 u_scale;

out vec4 v_colour;

void main() {
    v_colour = a_colour;
    gl_Position = vec4(a_position * u_scale, u_depth, 1.0);
}
