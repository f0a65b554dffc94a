// Light on a surface of some roughness where there is little time, and what it mirrors of the lamp and of the room: the lamp by
// Blinn's lobe as wide as GGX's, the room as light above and dark below, the blurrier the rougher.
struct PlainLight {
    vec3 key;    // of the roof light, where it is seen
    vec3 rest;   // of window, sky and floor
    vec3 seen;   // of the room, in a mirror
    float spot;  // of the roof light in a mirror, times KEY
    float edge;  // how far the surface is seen along itself, for Fresnel
};

// skin: light goes in and comes out elsewhere, red farthest, as in figure_light.glsl.
PlainLight plain_light_at(float rough, vec3 n, vec3 v, float skin) {
    PlainLight l;
    float d = dot(n, KEY_DIRECTION), c = max(d, 0.0);
    l.key = KEY * mix(vec3(c), clamp((d + vec3(0.34, 0.22, 0.16)) * vec3(0.557, 0.672, 0.743), 0.0, 1.0), skin);
    l.rest = FILL * max(0.0, (dot(n, FILL_DIRECTION) + 0.25) / 1.56) + ambient(n);
    l.seen = mix(GROUND, SKY, smoothstep(-0.15 - rough, 0.15 + rough, reflect(-v, n).y));
    float a = max(rough * rough, 0.03), power = 2.0 / (a * a) - 2.0;
    vec3 h = normalize(KEY_DIRECTION + v);
    l.spot = min((power + 2.0) * 0.125 * pow(max(dot(n, h), 0.0), power) * c, 6.0);
    float edge = 1.0 - max(dot(n, v), 0.0);
    edge *= edge;
    l.edge = edge * edge * (1.0 - 0.7 * skin);  // skin is too uneven to mirror much of the room along its edges
#if defined(STRANDS) || (defined(HOLES) && defined(BOTH_SIDES) && !defined(FILM))
    l.edge *= 0.15;  // cards stand for hairs, of which few are seen along themselves where the card is
#endif
    return l;
}

// How much is mirrored; f0: of what comes straight on.
vec3 mirrored(vec3 f0, float rough, PlainLight l) {
    return f0 + (max(vec3(1.0 - rough), f0) - f0) * l.edge;
}

// The whole. visible: share of the roof light; open_share: of the rest.
vec3 plain_light(vec3 own, float rough, float metallic, vec3 n, vec3 v, float visible, float open_share, float skin) {
    PlainLight l = plain_light_at(rough, n, v, skin);
    vec3 arrives = mix(vec3(visible), vec3(sqrt(visible), visible, visible), 0.3 * skin);
    vec3 shine = mirrored(mix(vec3(0.04), own, metallic), rough, l) * (KEY * (visible * l.spot) + l.seen * open_share);
    return from_within(own * (1.0 - metallic) * (l.key * arrives + l.rest * open_share), skin) + shine;
}
