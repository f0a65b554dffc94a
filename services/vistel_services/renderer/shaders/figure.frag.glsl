#version 330
#include "common.glsl"
uniform sampler2D albedo;
in vec3 p_room;
in vec3 n_room;
in vec2 at;
flat in float kind;  // 0 cloth and hair, 1 skin, 2 eye
out vec4 colour;

void main() {
    vec3 base = texture(albedo, at).rgb;
    base *= base;
    vec3 n = normalize(n_room);
    vec3 v = normalize(eye - p_room);
    float skin = kind == 1.0 ? 1.0 : 0.0;
    float visible = key_visible(p_room, n, 0.025);

    // Light that wraps round: flesh scatters, red farthest.
    float c = dot(n, KEY_DIRECTION);
    vec3 wrap = mix(vec3(0.12), vec3(0.42, 0.20, 0.12), skin);
    vec3 wrap_scale = mix(vec3(0.797), vec3(0.496, 0.694, 0.797), skin);  // 1 / (1 + wrap)^2
    vec3 lit = clamp((c + wrap) * wrap_scale, 0.0, 1.0);
    vec3 shade = mix(vec3(visible), vec3(sqrt(visible), visible, visible), 0.5 * skin);
    float f = max(0.0, (dot(n, FILL_DIRECTION) + 0.35) / 1.82);
    vec3 up = ambient(n);
    vec3 light = KEY * lit * shade + FILL * f + up;

    // Soft gloss: oily skin, sheen of cloth seen along the surface, wet eyes. Powers by squaring: pow() is dear.
    float nv = max(dot(n, v), 0.0);
    float s8 = max(dot(n, normalize(KEY_DIRECTION + v)), 0.0);
    s8 *= s8; s8 *= s8; s8 *= s8;
    float s32 = s8 * s8; s32 *= s32;
    float s128 = s32 * s32; s128 *= s128;
    float lobe = kind < 0.5 ? 0.018 * s8 : kind < 1.5 ? 0.085 * s8 * s8 * s8 : 1.6 * s128;
    float edge = 1.0 - nv;
    edge *= edge;
    vec3 rim = (edge * edge) * mix(0.22 * base + 0.03, vec3(0.16, 0.13, 0.11), skin);
    colour = vec4(display(base * light + (lobe * visible) * KEY + rim * up), 1.0);
}
