// From scene light to what a monitor shows: a soft shoulder for each channel, then the display's gamma.
vec3 tone(vec3 light) { return pow(1.0 - exp(-light), vec3(1.0 / 2.2)); }
