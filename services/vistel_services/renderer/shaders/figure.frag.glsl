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
    float eyeball = kind == 2.0 ? 1.0 : 0.0;
    float visible = key_visible(p_room, n, 0.025);

    // Light that wraps round: flesh scatters, red farthest.
    float c = dot(n, KEY_DIRECTION);
    vec3 wrap = mix(vec3(0.12), vec3(0.42, 0.20, 0.12), skin);
    vec3 lit = clamp((c + wrap) / ((1.0 + wrap) * (1.0 + wrap)), 0.0, 1.0);
    vec3 shade = mix(vec3(visible), sqrt(vec3(visible, visible * visible, visible * visible)), 0.5 * skin);
    float f = max(0.0, (dot(n, FILL_DIRECTION) + 0.35) / 1.82);
    vec3 light = KEY * lit * shade + FILL * f + ambient(n);

    // Soft gloss: oily skin, sheen of cloth seen along the surface, wet eyes.
    vec3 h = normalize(KEY_DIRECTION + v);
    vec3 h2 = normalize(FILL_DIRECTION + v);
    float nv = max(dot(n, v), 0.0);
    float edge = 1.0 - nv;
    edge *= edge;
    float power = mix(mix(9.0, 22.0, skin), 180.0, eyeball);
    float gloss = mix(mix(0.018, 0.085, skin), 1.6, eyeball);
    vec3 shine = gloss * (KEY * visible * pow(max(dot(n, h), 0.0), power) + FILL * pow(max(dot(n, h2), 0.0), power));
    vec3 rim = ambient(n) * edge * edge * mix(0.22 * base + 0.03, vec3(0.16, 0.13, 0.11), skin);
    colour = vec4(display(base * light + shine + rim), 1.0);
}
