#version 330
uniform mat4 clip_from_room;
uniform mat4 room_from_thing;
uniform vec3 eye;
uniform vec2 aside;     // how far the silhouette is moved in clip space
uniform float nearer;   // how far it is moved towards the eye, so that what the thing stands on does not hide it [m]
in vec3 position;

void main() {
    vec3 p = (room_from_thing * vec4(position, 1.0)).xyz;
    vec4 at = clip_from_room * vec4(p, 1.0);
    vec4 before = clip_from_room * vec4(p + nearer * normalize(eye - p), 1.0);
    gl_Position = vec4(at.xy + aside * at.w, before.z / before.w * at.w, at.w);
}
