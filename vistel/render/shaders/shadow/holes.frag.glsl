#version 330
#include "holes.glsl"
in vec2 place;

void main() {
    if (solid_at(place) <= 0.0) discard;
}
