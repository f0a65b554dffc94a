#version 330
// LIGHT_PER_VERTEX: for software GL, where vertices are fewer than pixels and both cost the same.
#ifdef LIGHT_PER_VERTEX
#include "common.glsl"
#include "figure_light.glsl"
out vec3 shadow_at;
out vec3 key;
out vec3 rest;
out vec3 rim;
out float gloss;
#else
out vec3 p_room;
out vec3 n_room;
#endif
uniform mat4 clip_from_room;
in vec3 position;
in vec3 normal;
in vec2 uv;
in float material;
out vec2 at;
flat out float kind;

void main() {
    at = uv;
    kind = material;
    gl_Position = clip_from_room * vec4(position, 1.0);
#ifdef LIGHT_PER_VERTEX
    Light l = light_of(normal, normalize(eye - position), material);
    key = l.key;
    rest = l.rest;
    rim = l.rim;
    gloss = l.gloss;
    shadow_at = shadow_place(position, normal, 0.025);
#else
    p_room = position;
    n_room = normal;
#endif
}
