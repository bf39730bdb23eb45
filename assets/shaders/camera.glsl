// From the world to the picture. With FISHEYE the endoscope's lens (see core/rendering/optics.hpp), else a
// perspective camera. The camera's frame: +x left on the screen, +y up, +z forward.
uniform vec3 u_eye;
uniform mat3 u_to_local;
uniform vec4 u_lens;  // scale of x and y, then depth = z + w / distance
uniform vec4 u_radial; // Kannala-Brandt k1..k4
uniform vec4 u_cut;   // plane in the world: what has dot(xyz, p) > w is dropped

vec3 to_local(vec3 world) { return u_to_local * (world - u_eye); }

#ifdef FISHEYE
// w is the distance, so it stays positive behind the camera, and attributes interpolate in perspective.
vec4 to_clip(vec3 p) {
    float s = length(p.xy);
    float d = max(length(p), 1e-7);
    float t = atan(s, p.z);
    float t2 = t * t;
    float r = t * (1.0 + t2 * (u_radial.x + t2 * (u_radial.y + t2 * (u_radial.z + t2 * u_radial.w))));
    vec2 along = s > 1e-9 ? p.xy / s : vec2(0.0);
    return vec4(-along.x * r * u_lens.x * d, along.y * r * u_lens.y * d, u_lens.z * d + u_lens.w, d);
}
// Nothing past 95 degrees from the axis: there a triangle could reach around the camera.
float clip_distance(vec3 world, vec3 p) { return p.z + 0.087 * length(p); }
#else
vec4 to_clip(vec3 p) { return vec4(-p.x * u_lens.x, p.y * u_lens.y, u_lens.z * p.z + u_lens.w, p.z); }
float clip_distance(vec3 world, vec3 p) { return u_cut.w - dot(u_cut.xyz, world); }
#endif
