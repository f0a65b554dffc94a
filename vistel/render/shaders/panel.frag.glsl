#version 330
uniform sampler2D picture;
in vec2 at;
in vec4 tint;
out vec4 colour;

void main() {
    colour = tint * texture(picture, at);
}
