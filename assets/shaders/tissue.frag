// Living tissue: veined, uneven and wet. Colours, worked out once for each vertex, vary smoothly (core/rendering/tissue_look.cpp).
in Vertex {
    vec3 local;
    vec3 normal;
    vec3 rest;
    vec4 outer;
    vec4 inner;
    vec4 gloss;
    vec4 open;
} v;

#include "tone.glsl"
#include "lights.glsl"

uniform sampler3D u_veins;
uniform sampler3D u_film;
uniform mat3 u_rest_to_local;
uniform vec2 u_veil; // opacity face on and at the outline; 1, 1: solid

layout(location = 0) out vec4 o_colour;

// A line where a smooth field passes its middle value; distance and width in units of the field.
float line(float field, float width) { return clamp((width - abs(field - 0.5)) * 40.0, 0.0, 1.0); }

void main() {
    float side = gl_FrontFacing ? 1.0 : -1.0;
    vec3 n = normalize(v.normal) * side;
    vec4 colour = gl_FrontFacing ? v.outer : v.inner;
    float open = gl_FrontFacing ? v.open.x : v.open.y;
    vec4 film = texture(u_film, v.rest * 64.0);

    vec3 albedo = colour.rgb;
    albedo *= 1.0 + (film.a - 0.5) * vec3(0.16, 0.34, 0.38); // fine redder and paler grains
    if (colour.a > 0.02) {
        // Larger trunks, and finer branches in between; both come and go over the surface.
        vec4 veins = texture(u_veins, v.rest * 22.0 + film.arg * 0.024);
        float trunk = line(veins.r, 0.010 + 0.05 * v.open.z * veins.g) * clamp(v.open.z * 5.0 - 1.9, 0.0, 1.0);
        float branch = line(veins.g, 0.030) * clamp(v.open.w * 5.0 - 1.9, 0.0, 1.0) * 0.6;
        albedo *= 1.0 - clamp(trunk + branch, 0.0, 1.0) * colour.a * vec3(0.42, 0.80, 0.78);
    }

    float distance2 = dot(v.local, v.local);
    vec3 to_eye = -v.local * inversesqrt(distance2);
    // The film's unevenness, as long as it is larger than a pixel.
    vec3 slope = u_rest_to_local * (film.rgb - 0.5);
    slope -= n * dot(n, slope);
    vec3 wet_n = normalize(n + slope * (3.0 * v.gloss.z / (1.0 + distance2 * 350.0)));

    Lit lit = illuminate(v.local, n, wet_n, to_eye, v.gloss, open);
    vec3 light = albedo * lit.diffuse + lit.shine;

    float alpha = 1.0;
#ifndef ENDOSCOPE
    float edge = 1.0 - abs(dot(n, to_eye));
    float glint = clamp(0.5 * max(lit.shine.g - 0.25, 0.0), 0.0, 0.5);
    alpha = clamp(mix(u_veil.x, u_veil.y, edge * edge * edge) + glint, 0.0, 1.0);
    float lit_through = 0.7 * step(u_veil.x, 0.99); // a thin wall with light behind it
    light = mix(light, albedo * vec3(1.5, 1.25, 1.2) + lit.shine, lit_through);
#endif
    o_colour = vec4(tone(light * u_exposure), alpha);
}
