#version 330
uniform vec2 size; // of the window, in the panel's units
in vec2 place;     // from its upper left corner
in vec2 uv;
in vec4 ink;
out vec2 at;
out vec4 tint;

void main() {
    at = uv;
    tint = ink;
    gl_Position = vec4(2.0 * place.x / size.x - 1.0, 1.0 - 2.0 * place.y / size.y, 0.0, 1.0);
}
