#version 330
#include "common.glsl"
in vec3 p_room;
in vec3 n_room;
in vec4 base_colour;  // linear colour, and how much ambient light reaches the place
uniform float gloss;
#ifdef PICTURED
in vec2 place;
uniform sampler2D picture;
uniform float metallic;
uniform float glows;  // 1: the picture shines by itself
const float WHITE = 0.9;  // of a picture that does

// Of a page: four places of the pixel, each from the next finer level of its mipmap, so that small letters stay sharp.
vec3 page() {
    vec2 right = 0.25 * dFdx(place), up = 0.25 * dFdy(place);
    return 0.25 * (texture(picture, place + right + up, -1.0).rgb + texture(picture, place + right - up, -1.0).rgb
        + texture(picture, place - right + up, -1.0).rgb + texture(picture, place - right - up, -1.0).rgb);
}
#ifndef FINE
#include "plain_light.glsl"
#endif
#endif
out vec4 colour;
#ifdef FINE
#include "fine_light.glsl"
#endif
#if defined(FINE) || defined(PICTURED)
uniform float rough;
#endif

void main() {
    vec3 n = normalize(n_room);
    vec3 own = base_colour.rgb;
#ifdef PICTURED
    n = gl_FrontFacing ? n : -n;
    own = pow(texture(picture, place).rgb, vec3(2.2));
#endif
#ifdef FINE
#ifdef PICTURED
    Surface s = Surface(own * (1.0 - metallic), 0.04, rough, vec3(0.0), 0.0);
    colour = vec4(display(fine_light_of(s, mix(vec3(0.04), own, metallic), p_room, n, base_colour.a)), 1.0);
#else
    Surface s = Surface(own, 0.04, rough, vec3(0.0), 0.0);
    colour = vec4(display(fine_light(s, p_room, n, base_colour.a)), 1.0);
#endif
#else
    vec3 v = normalize(eye - p_room);
    float c = max(dot(n, KEY_DIRECTION), 0.0);
    float visible = c > 0.0 ? lit_at(shadow_place(p_room, n, 0.008)) : 0.0;
#ifdef PICTURED
    colour = vec4(display(plain_light(own, rough, metallic, n, v, visible, base_colour.a, 0.0)), 1.0);
#else
    float f = max(0.0, (dot(n, FILL_DIRECTION) + 0.25) / 1.56);
    vec3 light = KEY * c * visible + (FILL * f + ambient(n)) * base_colour.a;
    vec3 h = normalize(KEY_DIRECTION + v);
    float edge = 1.0 - max(dot(n, v), 0.0);
    edge *= edge;
    float s16 = max(dot(n, h), 0.0);  // by squaring: pow() is dear
    s16 *= s16; s16 *= s16; s16 *= s16; s16 *= s16;
    vec3 shine = gloss * (KEY * (visible * s16 * s16 * s16) + SKY * (0.10 + 0.6 * edge * edge) * base_colour.a);
    colour = vec4(display(own * light + shine), 1.0);
#endif
#endif
#ifdef PICTURED
    if (glows > 0.5) {
        colour.rgb = WHITE * page();
#ifndef FINE
        colour.a = 0.99;  // its letters have no stairs: gl/antialias.py leaves alone what is not wholly opaque
#endif
    }
#endif
}
