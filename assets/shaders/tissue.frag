// Living tissue: mottled, veined and wet.
in Vertex {
    vec3 local;
    vec3 normal;
    vec3 rest;
    vec4 colour;
    float concave;
} v;

#include "tone.glsl"
#include "lights.glsl"

uniform sampler3D u_tint;
uniform sampler3D u_film;
uniform mat3 u_rest_to_local;
// [0] the outer side, [1] the inner one
uniform vec3 u_albedo[2];
uniform vec3 u_mottled[2];
uniform vec3 u_crease[2];
uniform vec3 u_vessel[2];
uniform vec4 u_pattern[2]; // mottle, 1 / period of patches, vessels, 1 / period of the vessels' mesh
uniform vec4 u_gloss[2];   // sheen, wet, bump, soft
uniform float u_veil;      // 0 solid, 1 translucent

layout(location = 0) out vec4 o_colour;

// A line where the smooth field passes its middle value, `width` wide in units of the field.
float line_of(float field, float width) {
    float soft = fwidth(field) + 0.012;
    return 1.0 - smoothstep(width, width + soft, abs(field - 0.5));
}

void main() {
    int side = gl_FrontFacing ? 0 : 1;
    float facing = gl_FrontFacing ? 1.0 : -1.0;
    vec3 n = normalize(v.normal) * facing;
    float concave = v.concave * facing;
    vec4 pattern = u_pattern[side];
    vec4 gloss = u_gloss[side];

    vec4 broad = texture(u_tint, v.rest * pattern.y);
    vec4 fine = texture(u_tint, v.rest * (pattern.y * 3.7) + broad.rrr * 0.15);
    vec4 veins = texture(u_tint, v.rest * pattern.w + fine.ara * 0.05);
    vec4 film = texture(u_film, v.rest * 105.0);

    float mottle = clamp(broad.r * 0.75 + fine.a * 0.5 - 0.125, 0.0, 1.0);
    vec3 albedo = mix(u_albedo[side], u_mottled[side], smoothstep(0.3, 0.75, mottle) * pattern.x);
    albedo *= 0.94 + 0.12 * fine.r;
    // Larger trunks, and finer branches in between; both come and go over the surface.
    float trunk = line_of(veins.g, 0.012 + 0.03 * veins.a) * smoothstep(0.42, 0.62, broad.b);
    float branch = line_of(veins.b, 0.008) * smoothstep(0.38, 0.6, broad.g) * 0.6;
    albedo = mix(albedo, u_vessel[side], clamp(trunk + branch, 0.0, 1.0) * pattern.z * 0.8);
    albedo = mix(albedo, u_crease[side], smoothstep(0.05, 0.9, concave) * 0.75);
    albedo = mix(albedo, min(albedo * 1.16 + 0.02, vec3(1.0)), smoothstep(0.1, 0.9, -concave) * 0.6);
    albedo *= v.colour.rgb;
    float open = v.colour.a * (1.0 - 0.45 * smoothstep(0.0, 1.0, concave));

    vec3 slope = u_rest_to_local * ((film.rgb - 0.5) * 2.0);
    slope -= n * dot(n, slope);
    vec3 wet_n = normalize(n + slope * (1.5 * gloss.z));

    vec3 to_eye = -normalize(v.local);
    Lit lit = illuminate(v.local, n, wet_n, to_eye, gloss, open);
    vec3 light = albedo * lit.diffuse + lit.shine;

    float alpha = 1.0;
#ifndef ENDOSCOPE
    float edge = 1.0 - abs(dot(n, to_eye));
    float veil = clamp(0.13 + 0.75 * edge * edge * edge + 0.5 * max(lit.shine.g - 0.25, 0.0), 0.0, 0.92);
    alpha = mix(1.0, veil, u_veil);
#endif
    o_colour = vec4(tone(light * u_exposure), alpha);
}
