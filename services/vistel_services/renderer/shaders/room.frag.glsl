#version 330
#include "common.glsl"
uniform sampler2D baked;  // square root of colour (rgb) and of baked light (a)
uniform float key_share;  // 1 where the key light falls (floor, table), 0 for walls
uniform float gloss;
in vec3 p_room;
in vec3 n_room;
in vec2 at;
out vec4 colour;

void main() {
    vec4 t = texture(baked, at);
    t *= t;
    vec3 light = vec3(1.02, 1.0, 0.96) * t.a * 1.6;
    vec3 c;
    if (key_share > 0.0) {
        float k = max(dot(n_room, KEY_DIRECTION), 0.0) * key_visible(p_room, n_room, 0.008);
        c = t.rgb * (light + KEY * k);
    } else {
        c = t.rgb * light;
    }
    if (gloss > 0.0) {  // varnish: the bright window side mirrored, stronger along the surface
        vec3 r = reflect(normalize(p_room - eye), n_room);
        float edge = 1.0 - max(dot(r, n_room), 0.0);
        float window = smoothstep(0.25, 0.95, dot(r, normalize(vec3(-0.9, 0.42, 0.0))));
        c += gloss * t.a * (0.04 + 0.5 * edge * edge * edge * edge) * (0.35 + 2.6 * window) * vec3(0.86, 0.93, 1.0);
    }
    colour = vec4(display(c), 1.0);
}
