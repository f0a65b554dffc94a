#version 330
uniform mat4 shadow_from_room;
uniform vec4 box;  // of the texture that the opacity spans: lowest u and v, one over width and height
in vec3 position;
in vec2 uv;
out vec2 place;

void main() {
    place = (uv - box.xy) * box.zw;
    gl_Position = shadow_from_room * vec4(position, 1.0);
}
