// From scene light to what a monitor shows: a soft shoulder for each channel (1 - exp(-x), by the first terms of
// the series), then a display gamma of 2. No transcendental functions: without a GPU they cost more than all the rest.
vec3 tone(vec3 light) {
    light = min(light, vec3(30.0));
    return sqrt(1.0 - 1.0 / (1.0 + light * (1.0 + 0.5 * light)));
}
