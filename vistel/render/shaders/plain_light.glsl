// A surface by its roughness where there is little time: light and what it mirrors of the lamp and of the room, the lamp by Blinn's
// lobe as wide as GGX's, the room as light above and dark below, the blurrier the rougher.
vec3 plain_light(vec3 own, float rough, float metallic, vec3 n, vec3 v, float visible, float open_share) {
    float c = max(dot(n, KEY_DIRECTION), 0.0);
    vec3 h = normalize(KEY_DIRECTION + v);
    float edge = 1.0 - max(dot(n, v), 0.0);
    edge *= edge;
    float f = max(0.0, (dot(n, FILL_DIRECTION) + 0.25) / 1.56);
    vec3 light = KEY * c * visible + (FILL * f + ambient(n)) * open_share;
    float a = max(rough * rough, 0.03), power = 2.0 / (a * a) - 2.0;
    vec3 f0 = mix(vec3(0.04), own, metallic), mirrored = f0 + (max(vec3(1.0 - rough), f0) - f0) * edge * edge;
    float spot = (power + 2.0) * 0.125 * pow(max(dot(n, h), 0.0), power) * c;
    vec3 seen = mix(GROUND, SKY, smoothstep(-0.15 - rough, 0.15 + rough, reflect(-v, n).y)) * open_share;
    vec3 shine = mirrored * (KEY * (visible * min(spot, 6.0)) + seen);
    return own * (1.0 - metallic) * light + shine;
}
