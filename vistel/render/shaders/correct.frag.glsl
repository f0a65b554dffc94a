#version 330
uniform vec3 gain;   // of light
uniform vec4 blend;  // part of the picture over which light fades: left, right, bottom, top
in vec2 at;
out vec4 colour;

// Light that rises from 0 to 1 over `part`; two pictures that overlap by it add up to 1 everywhere.
float rise(float from_edge, float part) {
    return part > 0.0 ? clamp(from_edge / part, 0.0, 1.0) : 1.0;
}

void main() {
    float light = rise(at.x, blend.x) * rise(1.0 - at.x, blend.y) * rise(at.y, blend.z) * rise(1.0 - at.y, blend.w);
    colour = vec4(pow(gain * light, vec3(1.0 / 2.2)), 1.0);  // the picture's values are powers of light
}
