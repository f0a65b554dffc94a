#version 330
// KEY_SHADOWED, GLOSS, FINE: as in the fragment shader. Panels are flat: what is linear in the place is computed at their corners.
uniform mat4 clip_from_room;
in vec3 position;
in vec3 normal;
in vec2 uv;
out vec2 at;
#if defined(FINE) || defined(GLOSS)
out vec3 p_room;
out vec3 n_room;
#endif
#if defined(KEY_SHADOWED) && !defined(FINE)
#include "common.glsl"
out vec3 shadow_at;
out float facing;  // cosine of the normal to the key light
#endif

void main() {
    at = uv;
#if defined(FINE) || defined(GLOSS)
    p_room = position;
    n_room = normal;
#endif
#if defined(KEY_SHADOWED) && !defined(FINE)
    shadow_at = shadow_place(position, normal, 0.008);
    facing = max(dot(normal, KEY_DIRECTION), 0.0);
#endif
    gl_Position = clip_from_room * vec4(position, 1.0);
}
