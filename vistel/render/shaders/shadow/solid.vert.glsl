#version 330
uniform mat4 shadow_from_room;
uniform mat4 room_from_thing;
in vec3 position;

void main() {
    gl_Position = shadow_from_room * room_from_thing * vec4(position, 1.0);
}
