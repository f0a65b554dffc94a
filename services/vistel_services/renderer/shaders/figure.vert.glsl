#version 330
uniform mat4 clip_from_room;
in vec3 position;
in vec3 normal;
in vec2 uv;
in float material;
out vec3 p_room;
out vec3 n_room;
out vec2 at;
flat out float kind;

void main() {
    p_room = position;
    n_room = normal;
    at = uv;
    kind = material;
    gl_Position = clip_from_room * vec4(position, 1.0);
}
