#version 330
// FINISHED: the texture is what is seen. KEY_SHADOWED: the key light falls here. GLOSS: how much the varnish mirrors.
#include "common.glsl"
uniform sampler2D baked;  // what is seen, or square root of colour (rgb) and of baked light (a)
in vec2 at;
#if defined(FINE) || defined(GLOSS)
in vec3 p_room;
in vec3 n_room;
#endif
#if defined(KEY_SHADOWED) && !defined(FINE)
in vec3 shadow_at;
in float facing;
#endif
out vec4 colour;

#ifdef FINISHED
void main() {
#ifdef SURROUNDINGS
    colour = vec4(from_display(texture(baked, at).rgb), 1.0);
#else
    colour = texture(baked, at);
#endif
}
#else
void main() {
    vec4 t = texture(baked, at);
    t *= t;
    vec3 light = vec3(1.63, 1.60, 1.54) * t.a;
#if defined(KEY_SHADOWED) && defined(FINE)
    light += KEY * (max(dot(n_room, KEY_DIRECTION), 0.0) * lit_softly(p_room, n_room));
#elif defined(KEY_SHADOWED)
    light += KEY * (facing * lit_at(shadow_at));
#endif
    vec3 c = t.rgb * light;
#ifdef GLOSS
    // Varnish: the bright window side mirrored, stronger along the surface.
    vec3 r = reflect(normalize(p_room - eye), n_room);
    float edge = 1.0 - max(dot(r, n_room), 0.0);
    edge *= edge;
    float window = smoothstep(0.25, 0.95, dot(r, vec3(-0.906, 0.423, 0.0)));
    c += GLOSS * t.a * (0.04 + 0.5 * edge * edge) * (0.35 + 2.6 * window) * vec3(0.86, 0.93, 1.0);
#endif
#ifdef SURROUNDINGS
    colour = vec4(c, 1.0);
#else
    colour = vec4(display(c), 1.0);
#endif
}
#endif
