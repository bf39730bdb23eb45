// The lights of the two views, in the camera's frame.
uniform float u_exposure;
uniform float u_light;     // of the headlight, 0..1
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

// Normalised Blinn-Phong lobe, in units of the diffuse one.
float lobe(float cosine, float exponent) {
    return pow(max(cosine, 0.0), exponent) * (exponent + 8.0) * 0.125;
}

#ifdef ENDOSCOPE
const float kReference = 0.03; // m, where the headlight has unit irradiance

Lit illuminate(vec3 p, vec3 n, vec3 wet_n, vec3 to_eye, vec4 gloss, float open) {
    Lit lit = Lit(vec3(0.0), vec3(0.0));
    for (int i = 0; i < 2; ++i) {
        vec3 guide = vec3(i == 0 ? u_light_shape.y : -u_light_shape.y, 0.0, 0.0);
        vec3 to_light = guide - p;
        float d2 = dot(to_light, to_light);
        vec3 l = to_light * inversesqrt(d2);
        float cone = pow(max(-l.z, 0.02), u_light_shape.x);
        float power = 0.5 * u_light * cone * kReference * kReference / (d2 + 1e-6);
        vec3 h = normalize(l + to_eye);
        lit.diffuse += power * wrapped(dot(n, l), gloss.w);
        float f = fresnel(dot(h, l));
        lit.shine += power * f * (gloss.x * 2.0 * lobe(dot(n, h), 22.0) + gloss.y * 5.0 * lobe(dot(wet_n, h), 260.0));
    }
    // What the walls of a hollow organ throw at each other: falls off more slowly, and is redder.
    float d = length(p);
    lit.diffuse += u_light * vec3(0.105, 0.068, 0.052) * open * kReference / (d + kReference);
    lit.diffuse *= 0.55 + 0.45 * open;
    return lit;
}
#else
Lit illuminate(vec3 p, vec3 n, vec3 wet_n, vec3 to_eye, vec4 gloss, float open) {
    const vec3 key = vec3(0.485, 0.728, -0.485);
    const vec3 fill = vec3(-0.79, 0.15, -0.594);
    const vec3 rim = vec3(-0.30, 0.55, 0.78);
    Lit lit = Lit(vec3(0.0), vec3(0.0));
    float sky = 0.5 + 0.5 * n.y;
    lit.diffuse = mix(vec3(0.16, 0.125, 0.12), vec3(0.42, 0.43, 0.46), sky) * open;
    lit.diffuse += vec3(1.25, 1.20, 1.12) * wrapped(dot(n, key), gloss.w) * (0.45 + 0.55 * open);
    lit.diffuse += vec3(0.30, 0.33, 0.38) * wrapped(dot(n, fill), gloss.w) * (0.4 + 0.6 * open);
    float edge = 1.0 - max(dot(n, to_eye), 0.0);
    lit.diffuse += vec3(0.5, 0.55, 0.62) * max(dot(n, rim), 0.0) * edge * edge;
    vec3 h = normalize(key + to_eye);
    float f = fresnel(dot(h, key));
    lit.shine = vec3(1.25, 1.2, 1.12) * f * open *
                (gloss.x * 1.6 * lobe(dot(n, h), 18.0) + gloss.y * 1.6 * lobe(dot(wet_n, h), 130.0));
    lit.shine += vec3(0.42, 0.44, 0.48) * fresnel(dot(n, to_eye)) * gloss.x * 0.5 * sky * open;
    return lit;
}
#endif
