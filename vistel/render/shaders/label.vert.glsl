#version 330
uniform vec4 box;    // left, bottom, right, top in clip space
uniform float depth; // clip-space depth / w of the place it names
in vec2 corner;
out vec2 at;

void main() {
    at = corner;
    gl_Position = vec4(mix(box.xy, box.zw, corner), depth, 1.0);
}
