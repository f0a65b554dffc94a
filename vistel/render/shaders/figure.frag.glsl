#version 330
#include "common.glsl"
#include "figure_light.glsl"
#ifdef FINE
#include "fine_light.glsl"
#endif
uniform sampler2D albedo;
#ifdef LIGHT_PER_VERTEX
in vec3 shadow_at;
in vec3 key;
in vec3 rest;
in vec3 added;
in float gloss;
in float flesh;
#else
in float kind;  // 0 cloth and hair, 1 skin, between them at its edge, 2 eye
in vec3 p_room;
in vec3 n_room;
#endif
in vec2 at;
#ifdef HOLES
#include "holes.glsl"
uniform vec4 box;  // of the texture that the opacity spans: lowest u and v, one over width and height
#endif
#ifdef WRINKLED
uniform sampler2D wrinkle_light;
in vec2 fold_at;
in vec4 fold;
#endif
out vec4 colour;

#ifdef FINE
Surface surface_of(vec3 base, float kind) {
    if (kind > 1.5) return Surface(base, 0.03, 0.10, vec3(0.0), 0.0);            // an eye under its film of tears
    vec3 fuzz = (0.10 * sqrt(base) + 0.006) * (1.0 - kind);                       // of cloth and hair
    return Surface(base, mix(0.035, 0.028, kind), mix(0.80, 0.50, kind), fuzz, kind);
}
#endif

void main() {
    float alpha = 1.0;
#ifdef HOLES
    alpha = solid_at((at - box.xy) * box.zw);
    if (alpha <= 0.0) discard;
#endif
    vec3 base = texture(albedo, at).rgb;
    base *= base;
#ifdef WRINKLED
    vec4 lit = 1.0 + fold * (texture(wrinkle_light, fold_at) * 2.0 - 256.0 / 255.0);
    base *= max(lit.x * lit.y * lit.z * lit.w, 0.0);
#endif
#ifdef FINE
    colour = vec4(display(fine_light(surface_of(base, kind), p_room, normalize(n_room), 1.0)), 1.0);
#elif defined(LIGHT_PER_VERTEX)
    float visible = lit_at(shadow_at);
    vec3 light = key * visible + rest;
    light.r += FLESH * flesh * key.r * (sqrt(visible) - visible);
    colour = vec4(display(from_within(base * light, flesh) + (gloss * visible) * KEY + added), alpha);
#else
    float skin = skin_of(kind);
    vec3 n = normalize(n_room);
    Light l = light_of(n, normalize(eye - p_room), kind);
    float visible = lit_at(shadow_place(p_room, n, 0.025));
    vec3 shade = mix(vec3(visible), vec3(sqrt(visible), visible, visible), FLESH * skin);
    vec3 sheen = l.rim * mix(SHEEN_BASE * base + SHEEN_CLOTH, SHEEN_SKIN, skin);
    float spot = kind > 1.5 ? catchlight(n, normalize(eye - p_room)) : 0.0;
    vec3 within = from_within(base * (l.key * shade + l.rest), skin);
    colour = vec4(display(within + (l.gloss * visible + spot) * KEY + sheen), 1.0);
#endif
}
