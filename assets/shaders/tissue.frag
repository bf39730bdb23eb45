// Living tissue: mottled, veined and wet.
in Vertex {
    vec3 local;
    vec3 normal;
    vec3 rest;
    vec4 colour;
    vec4 patches;
} v;

#include "tone.glsl"
#include "lights.glsl"

uniform sampler3D u_veins;
uniform sampler3D u_film;
uniform mat3 u_rest_to_local;
// [0] the outer side, [1] the inner one
uniform vec3 u_albedo[2];
uniform vec3 u_mottled[2];
uniform vec3 u_crease[2];
uniform vec3 u_vessel[2];
uniform vec4 u_pattern[2]; // mottle, vessels, 1 / period of the vessels' mesh
uniform vec4 u_gloss[2];   // sheen, wet, bump, soft
uniform float u_veil;      // 0 solid, 1 translucent

layout(location = 0) out vec4 o_colour;

// A line where a smooth field passes its middle value; distance and width in units of the field.
float line(float field, float width) { return clamp((width - abs(field - 0.5)) * 40.0, 0.0, 1.0); }

void main() {
    bool outside = gl_FrontFacing;
    float side = outside ? 1.0 : -1.0;
    vec3 n = normalize(v.normal) * side;
    float concave = v.patches.w * side;
    vec4 pattern = outside ? u_pattern[0] : u_pattern[1];
    vec4 gloss = outside ? u_gloss[0] : u_gloss[1];
    vec4 film = texture(u_film, v.rest * 105.0);

    float mottle = clamp((v.patches.x + 0.35 * film.a - 0.37) * 1.8, 0.0, 1.0);
    vec3 albedo = mix(outside ? u_albedo[0] : u_albedo[1], outside ? u_mottled[0] : u_mottled[1], mottle * pattern.x);
    albedo *= 0.90 + 0.20 * film.a;
    if (pattern.y > 0.05) {
        // Larger trunks, and finer branches in between; both come and go over the surface.
        vec4 veins = texture(u_veins, v.rest * pattern.z + film.arg * 0.018);
        float trunk = line(veins.r, 0.05 + 0.03 * v.patches.z) * clamp(v.patches.z * 5.0 - 2.0, 0.0, 1.0);
        float branch = line(veins.g, 0.036) * clamp(v.patches.y * 5.0 - 1.9, 0.0, 1.0) * 0.6;
        albedo = mix(albedo, outside ? u_vessel[0] : u_vessel[1], clamp(trunk + branch, 0.0, 1.0) * pattern.y * 0.75);
    }
    float fold = clamp(concave * 1.2 - 0.08, 0.0, 1.0);
    albedo = mix(albedo, outside ? u_crease[0] : u_crease[1], fold * 0.6);
    albedo *= 1.0 + 0.14 * clamp(-concave, 0.0, 1.0);
    albedo *= v.colour.rgb;
    float open = v.colour.a * (1.0 - 0.4 * fold);

    vec3 slope = u_rest_to_local * (film.rgb - 0.5);
    slope -= n * dot(n, slope);
    vec3 wet_n = normalize(n + slope * (3.0 * gloss.z));

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
