// Light on a figure's surface, before shadows. kind: 0 cloth and hair, 1 skin, between them at its edge, 2 eye.
struct Light {
    vec3 key;     // of the roof light, where it is seen
    vec3 rest;    // of window, sky and floor
    vec3 rim;     // sheen along the surface
    float gloss;  // the roof light mirrored
};

// What is seen of the rim: of cloth SHEEN_BASE of its colour and SHEEN_CLOTH, of skin SHEEN_SKIN.
const float SHEEN_BASE = 0.22;
const vec3 SHEEN_CLOTH = vec3(0.03), SHEEN_SKIN = vec3(0.16, 0.13, 0.11);
const float FLESH = 0.3;  // how far shadows' edges glow red on skin

Light light_of(vec3 n, vec3 v, float kind) {
    Light l;
    float skin = skin_of(kind);
    // Light that wraps round: flesh scatters, red farthest.
    float c = dot(n, KEY_DIRECTION);
    vec3 wrap = mix(vec3(0.12), vec3(0.34, 0.22, 0.16), skin);
    vec3 wrap_scale = mix(vec3(0.797), vec3(0.557, 0.672, 0.743), skin);  // 1 / (1 + wrap)^2
    l.key = KEY * clamp((c + wrap) * wrap_scale, 0.0, 1.0);
    vec3 up = ambient(n);
    l.rest = FILL * max(0.0, (dot(n, FILL_DIRECTION) + 0.35) / 1.82) + up;

    // Soft gloss: oily skin, sheen of cloth seen along the surface, wet eyes. Powers by squaring: pow() is dear.
    float s8 = max(dot(n, normalize(KEY_DIRECTION + v)), 0.0);
    s8 *= s8; s8 *= s8; s8 *= s8;
    float s32 = s8 * s8; s32 *= s32;
    float s128 = s32 * s32; s128 *= s128;
    l.gloss = kind > 1.5 ? 1.6 * s128 : mix(0.018 * s8, 0.085 * s8 * s8 * s8, skin);
    float edge = 1.0 - max(dot(n, v), 0.0);
    edge *= edge;
    l.rim = (edge * edge) * up;
    return l;
}
