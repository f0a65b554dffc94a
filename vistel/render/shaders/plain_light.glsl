// A surface by its roughness where there is little time: light and what it mirrors of the lamp and of the room, the lamp by Blinn's
// lobe as wide as GGX's, the room as light above and dark below, the blurrier the rougher. skin: light goes in and comes out
// elsewhere, red farthest, as in figure_light.glsl.
vec3 plain_light(vec3 own, float rough, float metallic, vec3 n, vec3 v, float visible, float open_share, float skin) {
    float d = dot(n, KEY_DIRECTION), c = max(d, 0.0);
    vec3 reach = mix(vec3(c), clamp((d + vec3(0.34, 0.22, 0.16)) * vec3(0.557, 0.672, 0.743), 0.0, 1.0), skin);
    vec3 arrives = mix(vec3(visible), vec3(sqrt(visible), visible, visible), 0.3 * skin);
    vec3 h = normalize(KEY_DIRECTION + v);
    float edge = 1.0 - max(dot(n, v), 0.0);
    edge *= edge;
    float f = max(0.0, (dot(n, FILL_DIRECTION) + 0.25) / 1.56);
    vec3 light = KEY * reach * arrives + (FILL * f + ambient(n)) * open_share;
    float a = max(rough * rough, 0.03), power = 2.0 / (a * a) - 2.0;
    vec3 f0 = mix(vec3(0.04), own, metallic);
    // Skin is too uneven to mirror much of the room along its edges.
    vec3 mirrored = f0 + (max(vec3(1.0 - rough), f0) - f0) * (edge * edge * (1.0 - 0.7 * skin));
    float spot = (power + 2.0) * 0.125 * pow(max(dot(n, h), 0.0), power) * c;
    vec3 seen = mix(GROUND, SKY, smoothstep(-0.15 - rough, 0.15 + rough, reflect(-v, n).y)) * open_share;
    vec3 shine = mirrored * (KEY * (visible * min(spot, 6.0)) + seen);
    return own * (1.0 - metallic) * light + shine;
}
