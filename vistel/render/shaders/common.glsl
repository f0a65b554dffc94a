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

// How far a figure's surface is skin. kind: 0 cloth and hair, 1 skin, between them at its edge, 2 eye.
float skin_of(float kind) {
    return kind > 1.5 ? 0.0 : kind;
}

vec3 ambient(vec3 n) {
    return mix(GROUND, SKY, 0.5 + 0.5 * n.y);
}

// Light that comes from within skin, as a camera set for faces has it: the lightest is held down as a whole, so that it keeps its
// colour where the filmic curve would make it white. Dark skin stays as it is, and what is mirrored does not count.
const float HELD_DOWN = 0.75;
vec3 from_within(vec3 c, float skin) {
    return c / (1.0 + HELD_DOWN * skin * c.g);
}

// The lamps of the room in an eye, times KEY: they are above the viewer and towards the roof light, wherever one looks from.
float catchlight(vec3 n, vec3 v) {
    return 0.45 * smoothstep(0.9962, 0.9988, dot(n, normalize(v + 0.36 * KEY_DIRECTION)));
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

#ifdef FINE
uniform sampler2D shadow_depth;  // the same map, as depth
const float SHADOW_METRES = 3.5;  // that it is wide and high; and deep
const float LAMP = 0.03;          // tangent of half the angle at which the lamp is seen

// The same with shadows that grow soft with their distance from what throws them (Fernando 2005), by taps on a spiral turned
// from pixel to pixel.
float lit_softly(vec3 p, vec3 n) {
    vec3 s = shadow_place(p, n, 0.012);
    float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    float widest = LAMP * 1.2 / SHADOW_METRES, behind = 0.0, blockers = 0.0;
    for (int k = 0; k < 12; ++k) {
        float a = turn + 2.399963 * float(k);
        vec2 at = s.xy + widest * sqrt((float(k) + 0.5) / 12.0) * vec2(cos(a), sin(a));
        float d = textureLod(shadow_depth, at, 0.0).r;
        float before = step(d, s.z - 0.001);
        blockers += before;
        behind += before * (s.z - d);
    }
    if (blockers < 0.5) return 1.0;
    float soft = clamp(LAMP * behind / blockers, 0.7 * shadow_texel, widest);
    float lit = 0.0;
    for (int k = 0; k < 20; ++k) {
        float a = turn + 2.399963 * float(k);
        float r = soft * sqrt((float(k) + 0.5) / 20.0);
        lit += texture(shadow_map, vec3(s.xy + r * vec2(cos(a), sin(a)), s.z - 0.4 * r));
    }
    return lit / 20.0;
}
#define LIT(p, n, lift) lit_softly(p, n)
#else
#define LIT(p, n, lift) lit_at(shadow_place(p, n, lift))
#endif

// Filmic curve (Narkowicz 2015) and the display's gamma, as a square root.
vec3 display(vec3 c) {
    c *= 0.62;
    c = clamp((c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
    return sqrt(c);
}

// Back from the display to light.
vec3 from_display(vec3 d) {
    vec3 y = d * d, a = 2.51 - 2.43 * y, b = 0.03 - 0.59 * y;
    return (sqrt(max(b * b + 0.56 * a * y, 0.0)) - b) / (2.0 * a) / 0.62;
}
