// Light of the room, shared by every surface. Linear colour, room frame, metres.
uniform vec3 eye;
uniform mat4 shadow_from_room;
uniform sampler2DShadow shadow_map;
uniform float shadow_texel;

const vec3 KEY_DIRECTION = vec3(-0.527, 0.773, 0.353);  // towards the roof light
const vec3 KEY = vec3(1.86, 1.74, 1.55);
const vec3 FILL_DIRECTION = vec3(-0.80, 0.30, -0.52);   // towards the window
const vec3 FILL = vec3(0.42, 0.50, 0.62);
const vec3 SKY = vec3(0.50, 0.54, 0.60);
const vec3 GROUND = vec3(0.30, 0.25, 0.20);

vec3 ambient(vec3 n) {
    return mix(GROUND, SKY, 0.5 + 0.5 * n.y);
}

// Where to look in the shadow map for the surface at p with normal n, lifted off itself by `lift` metres.
vec3 shadow_place(vec3 p, vec3 n, float lift) {
    return (shadow_from_room * vec4(p + n * lift, 1.0)).xyz;
}

// Share of the key light that arrives there; bilinear taps. The map's border is lit.
float lit_at(vec3 s) {
#ifdef ONE_TAP
    return texture(shadow_map, s);
#else
    float o = shadow_texel * 0.6;
    return 0.5 * (texture(shadow_map, s + vec3(-o, -o, 0.0)) + texture(shadow_map, s + vec3(o, o, 0.0)));
#endif
}

// Filmic curve (Narkowicz 2015) and the display's gamma, as a square root.
vec3 display(vec3 c) {
    c *= 0.62;
    c = clamp((c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
    return sqrt(c);
}
