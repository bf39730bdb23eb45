// The lights of the two views, in the camera's frame.
uniform float u_exposure;
uniform float u_light;      // of the headlight, 0..1
uniform vec2 u_light_shape; // n of cos^n, offset of the two light guides along x

struct Lit {
    vec3 diffuse;
    vec3 shine;
};

// Light that has wandered below the surface comes out red, also a little past the terminator.
vec3 wrapped(float cosine, float soft) {
    vec3 wrap = soft * vec3(0.55, 0.18, 0.10);
    return clamp((cosine + wrap) / (1.0 + wrap), 0.0, 1.0);
}

float fresnel(float cosine) {
    float x = 1.0 - clamp(cosine, 0.0, 1.0);
    float x2 = x * x;
    return 0.03 + 0.97 * x2 * x2 * x;
}

// Normalised Blinn-Phong lobes in units of the diffuse one, with powers that are a few multiplications.
float broad_lobe(float cosine) { // cos^16
    float t = max(cosine, 0.0);
    t *= t, t *= t, t *= t, t *= t;
    return t * 3.0;
}
float sharp_lobe(float cosine) { // cos^128
    float t = max(cosine, 0.0);
    t *= t, t *= t, t *= t, t *= t, t *= t, t *= t, t *= t;
    return t * 17.0;
}
float glint_lobe(float cosine) { // cos^512
    float t = max(cosine, 0.0);
    t *= t, t *= t, t *= t, t *= t, t *= t, t *= t, t *= t, t *= t, t *= t;
    return t * 65.0;
}

#ifdef ENDOSCOPE
const float kReference = 0.03; // m, where the headlight has unit irradiance

Lit illuminate(vec3 p, vec3 n, vec3 wet_n, vec3 to_eye, vec4 gloss, float open) {
    Lit lit;
    float d2 = dot(p, p) + 1e-6;
    float d = sqrt(d2);
    // The light guides sit so close to the lens that for shading they are one light at the lens ...
    float axis = clamp(-to_eye.z, 0.02, 1.0);
    float cone = mix(axis, axis * axis, u_light_shape.x - 1.0); // cos^n for n between 1 and 2
    float power = u_light * cone * kReference * kReference / d2;
    float facing = dot(n, to_eye);
    lit.diffuse = power * wrapped(facing, gloss.w) * (0.55 + 0.45 * open);
    // ... but not for glints, which come in pairs. Half vectors: towards the eye, and aside by half the offset.
    float aside = 0.5 * u_light_shape.y / d;
    float straight = dot(wet_n, to_eye), lengths = 1.0 + aside * aside, skew = 2.0 * aside * to_eye.x;
    float glint = glint_lobe((straight + aside * wet_n.x) * inversesqrt(lengths + skew)) +
                  glint_lobe((straight - aside * wet_n.x) * inversesqrt(lengths - skew));
    lit.shine = vec3(power * (gloss.x * 0.05 * broad_lobe(facing) + gloss.y * 0.026 * glint));
    // What the walls of a hollow organ throw at each other: falls off more slowly, and is redder.
    float bounce = u_light * open * kReference / (d + kReference);
    lit.diffuse += vec3(0.100, 0.052, 0.038) * bounce;
    lit.shine += vec3(0.10, 0.075, 0.065) * bounce * gloss.x * fresnel(facing);
    return lit;
}
#else
Lit illuminate(vec3 p, vec3 n, vec3 wet_n, vec3 to_eye, vec4 gloss, float open) {
    const vec3 key = vec3(0.485, 0.728, -0.485);
    const vec3 fill = vec3(-0.79, 0.15, -0.594);
    const vec3 rim = vec3(-0.30, 0.55, 0.78);
    Lit lit;
    float sky = 0.5 + 0.5 * n.y;
    lit.diffuse = mix(vec3(0.13, 0.10, 0.095), vec3(0.30, 0.31, 0.33), sky) * open;
    lit.diffuse += vec3(1.12, 1.07, 1.0) * wrapped(dot(n, key), gloss.w) * (0.45 + 0.55 * open);
    lit.diffuse += vec3(0.22, 0.25, 0.29) * wrapped(dot(n, fill), gloss.w) * (0.4 + 0.6 * open);
    float facing = dot(n, to_eye);
    float edge = 1.0 - max(facing, 0.0);
    lit.diffuse += vec3(0.45, 0.5, 0.56) * max(dot(n, rim), 0.0) * edge * edge;
    vec3 h = normalize(key + to_eye);
    lit.shine = vec3(1.12, 1.07, 1.0) * fresnel(dot(h, key)) * open *
                (gloss.x * 1.3 * broad_lobe(dot(n, h)) + gloss.y * 2.0 * sharp_lobe(dot(wet_n, h)));
    lit.shine += vec3(0.36, 0.38, 0.42) * fresnel(facing) * gloss.x * 0.5 * sky * open;
    return lit;
}
#endif
