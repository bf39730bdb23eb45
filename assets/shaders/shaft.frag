// The endoscope itself: black insertion tube with white rings, matt bending rubber, tip with optics.
in vec3 v_local;
in vec3 v_normal;
in vec4 v_place;

#include "tone.glsl"
#include "lights.glsl"

uniform float u_bending; // length of the bending section, m

layout(location = 0) out vec4 o_colour;

float disc(vec2 p, vec2 centre, float radius) {
    float d = length(p - centre) - radius;
    return 1.0 - smoothstep(-0.02, 0.02, d);
}

void main() {
    vec3 n = normalize(v_normal);
    vec3 to_eye = -normalize(v_local);
    float s = v_place.x;
    float angle = v_place.y;
    vec3 albedo = vec3(0.018, 0.019, 0.021);
    vec4 gloss = vec4(0.55, 0.25, 0.0, 0.0);
    vec3 glow = vec3(0.0);
    if (v_place.z > 1.5) { // the face: lens, two light guides, two channels, nozzle; x left, y up
        vec2 q = v_place.w * vec2(cos(angle), sin(angle));
        albedo = vec3(0.05, 0.052, 0.056);
        float lens = disc(q, vec2(0.0, 0.12), 0.24);
        float guides = max(disc(q, vec2(0.56, 0.22), 0.17), disc(q, vec2(-0.56, 0.22), 0.17));
        float channels = max(disc(q, vec2(-0.34, -0.46), 0.27), disc(q, vec2(0.42, -0.42), 0.22));
        albedo = mix(albedo, vec3(0.012, 0.015, 0.03), lens);
        albedo = mix(albedo, vec3(0.003), channels);
        gloss = mix(gloss, vec4(1.0, 1.0, 0.0, 0.0), lens);
        glow = guides * vec3(1.0, 0.97, 0.9) * 4.0 * u_light;
    } else if (v_place.z > 0.5) { // the hard tip
        albedo = vec3(0.10, 0.104, 0.112);
        gloss = vec4(0.8, 0.5, 0.0, 0.0);
    } else if (s < u_bending) { // bending rubber: dull, with the faint pitch of the links below
        albedo = vec3(0.024) * (0.9 + 0.2 * smoothstep(0.3, 0.7, abs(fract(s * 160.0) - 0.5)));
        gloss = vec4(0.22, 0.05, 0.0, 0.0);
    } else { // a white ring each 50 mm, a double one each 100 mm
        float mark = s / 0.05;
        float nearest = floor(mark + 0.5);
        float off = abs(mark - nearest) * 0.05;
        bool tens = mod(nearest, 2.0) < 0.5;
        float ring = tens ? step(abs(off - 0.0018), 0.0009) : step(off, 0.0010);
        albedo = mix(albedo, vec3(0.75), ring);
        // Where the insertion tube meets the bending section: a bound collar.
        float collar = step(s, u_bending + 0.006);
        albedo = mix(albedo, vec3(0.045), collar);
    }
    Lit lit = illuminate(v_local, n, n, to_eye, gloss, 1.0);
    vec3 light = albedo * lit.diffuse + lit.shine * 0.8 + glow;
    o_colour = vec4(tone(light * u_exposure), 1.0);
}
