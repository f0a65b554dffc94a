#version 330
uniform sampler2D text;
uniform float opacity;
in vec2 at;
out vec4 colour;

void main() {
    vec4 t = texture(text, at);
    colour = vec4(t.rgb, t.a * opacity);
}
