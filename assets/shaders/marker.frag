// Guidance that glows: a bright core, and a halo that fades towards its outline.
in vec3 v_local;
in vec3 v_normal;
in vec4 v_colour;

uniform float u_strength;
uniform int u_halo;

layout(location = 0) out vec4 o_colour;

void main() {
    float shown = u_strength;
#ifdef ENDOSCOPE
    // A path that runs through the lens must not fill the picture.
    shown *= smoothstep(0.013, 0.03, length(v_local));
    if (shown <= 0.0) discard;
#endif
    float facing = abs(dot(normalize(v_normal), normalize(v_local)));
    if (u_halo == 1) {
        float glow = facing * facing * facing * v_colour.a;
        o_colour = vec4(v_colour.rgb * glow * shown, 0.0);
    } else {
        vec3 c = mix(v_colour.rgb * 0.62, min(v_colour.rgb * 1.05 + 0.12, vec3(1.0)), facing);
        o_colour = vec4(pow(c, vec3(1.0 / 2.2)), shown);
    }
}
