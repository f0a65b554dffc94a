#version 330
#include "common.glsl"
in vec3 p_room;
in vec3 n_room;
in vec4 base_colour;  // linear colour, and how much ambient light reaches the place
uniform float gloss;
#ifdef PICTURED
in vec2 place;
uniform sampler2D picture;
uniform float metallic;
#endif
out vec4 colour;
#ifdef FINE
#include "fine_light.glsl"
#endif
#if defined(FINE) || defined(PICTURED)
uniform float rough;
#endif

void main() {
    vec3 n = normalize(n_room);
    vec3 own = base_colour.rgb;
#ifdef PICTURED
    n = gl_FrontFacing ? n : -n;
    own = pow(texture(picture, place).rgb, vec3(2.2));
#endif
#ifdef FINE
#ifdef PICTURED
    Surface s = Surface(own * (1.0 - metallic), 0.04, rough, vec3(0.0), 0.0);
    colour = vec4(display(fine_light_of(s, mix(vec3(0.04), own, metallic), p_room, n, base_colour.a)), 1.0);
#else
    Surface s = Surface(own, 0.04, rough, vec3(0.0), 0.0);
    colour = vec4(display(fine_light(s, p_room, n, base_colour.a)), 1.0);
#endif
#else
    vec3 v = normalize(eye - p_room);
    float c = max(dot(n, KEY_DIRECTION), 0.0);
    float visible = c > 0.0 ? lit_at(shadow_place(p_room, n, 0.008)) : 0.0;
    float f = max(0.0, (dot(n, FILL_DIRECTION) + 0.25) / 1.56);
    vec3 light = KEY * c * visible + (FILL * f + ambient(n)) * base_colour.a;
    vec3 h = normalize(KEY_DIRECTION + v);
    float edge = 1.0 - max(dot(n, v), 0.0);
    edge *= edge;
#ifdef PICTURED
    // Blinn's lobe of the same width as GGX's, and the room mirrored as light above and dark below, the blurrier the rougher.
    float a = max(rough * rough, 0.03), power = 2.0 / (a * a) - 2.0;
    vec3 f0 = mix(vec3(0.04), own, metallic), mirrored = f0 + (max(vec3(1.0 - rough), f0) - f0) * edge * edge;
    float spot = (power + 2.0) * 0.125 * pow(max(dot(n, h), 0.0), power) * c;
    vec3 seen = mix(GROUND, SKY, smoothstep(-0.15 - rough, 0.15 + rough, reflect(-v, n).y)) * base_colour.a;
    vec3 shine = mirrored * (KEY * (visible * min(spot, 6.0)) + seen);
    own *= 1.0 - metallic;
#else
    vec3 shine = gloss * (KEY * visible * pow(max(dot(n, h), 0.0), 48.0) + SKY * (0.10 + 0.6 * edge * edge) * base_colour.a);
#endif
    colour = vec4(display(own * light + shine), 1.0);
#endif
}
