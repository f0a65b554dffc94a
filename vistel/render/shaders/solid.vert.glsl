#version 330
uniform mat4 clip_from_room;
uniform mat4 room_from_thing;
in vec3 position;
in vec3 normal;
#ifdef PICTURED
in vec2 uv;
out vec2 place;
#else
in vec4 tint;
#endif
out vec3 p_room;
out vec3 n_room;
out vec4 base_colour;

void main() {
    vec4 p = room_from_thing * vec4(position, 1.0);
    p_room = p.xyz;
    n_room = mat3(room_from_thing) * normal;
#ifdef PICTURED
    place = uv;
    base_colour = vec4(1.0);
#else
    base_colour = tint;
#endif
    gl_Position = clip_from_room * p;
}
