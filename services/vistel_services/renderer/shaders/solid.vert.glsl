#version 330
uniform mat4 clip_from_room;
uniform mat4 room_from_thing;
in vec3 position;
in vec3 normal;
in vec4 tint;
out vec3 p_room;
out vec3 n_room;
out vec4 base_colour;

void main() {
    vec4 p = room_from_thing * vec4(position, 1.0);
    p_room = p.xyz;
    n_room = mat3(room_from_thing) * normal;
    base_colour = tint;
    gl_Position = clip_from_room * p;
}
