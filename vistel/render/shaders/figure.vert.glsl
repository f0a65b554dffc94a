#version 330
// LIGHT_PER_VERTEX: for software GL, where vertices are fewer than pixels and both cost the same. ROUGH: a patch of that roughness.
#ifdef LIGHT_PER_VERTEX
#include "common.glsl"
#include "figure_light.glsl"
#ifdef ROUGH
#include "plain_light.glsl"
uniform float rough;
#endif
out vec3 shadow_at;
out vec3 key;      // times the albedo, where the roof light is seen
out vec3 rest;     // times the albedo, always
out vec3 added;    // sheen along the surface
out float gloss;
out float flesh;
#else
out vec3 p_room;
out vec3 n_room;
#endif
uniform mat4 clip_from_room;
in vec3 position;
in vec3 normal;
in vec2 uv;
in float material;
#ifdef WRINKLED
in uvec4 sets;               // of each channel the set of wrinkles near, 0 none
in vec4 pull;                // how far the cloth moves up
uniform float wrinkle[SETS];  // how much of each set is there; the first is 0
out vec2 fold_at;
out vec4 fold;
#endif
out vec2 at;
#ifndef LIGHT_PER_VERTEX
out float kind;
#endif

void main() {
    at = uv;
#ifdef WRINKLED
    fold = vec4(wrinkle[sets.x], wrinkle[sets.y], wrinkle[sets.z], wrinkle[sets.w]);
    fold_at = uv;            // wrinkles stay at the joint while cloth moves through them
    at.y += dot(fold, pull);
#endif
    gl_Position = clip_from_room * vec4(position, 1.0);
#ifdef LIGHT_PER_VERTEX
    vec3 to_eye = normalize(eye - position);
    float skin = skin_of(material);
#ifdef ROUGH
    vec3 n = normal;
#ifdef BOTH_SIDES
    n = faceforward(n, -to_eye, n);
#endif
    PlainLight l = plain_light_at(rough, n, to_eye, skin);
    vec3 shown = mirrored(vec3(0.04), rough, l);
    key = l.key;
    rest = l.rest;
    added = shown * l.seen;
    gloss = shown.x * l.spot;
#else
    Light l = light_of(normal, to_eye, material);
    key = l.key;
    rest = l.rest + (SHEEN_BASE * (1.0 - skin)) * l.rim;
    added = l.rim * mix(SHEEN_CLOTH, SHEEN_SKIN, skin);
    gloss = l.gloss;
#endif
    flesh = skin;
    shadow_at = shadow_place(position, normal, 0.025);
#else
    kind = material;
    p_room = position;
    n_room = normal;
#endif
}
