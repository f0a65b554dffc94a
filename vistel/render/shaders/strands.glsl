// What strands mirror of lamp and window: bands across them, a pale one and, nearer the tips, one in their own colour (Kajiya and
// Kay 1989, Marschner et al. 2003).
const float PALE = 0.04, OWN = 0.7;         // how bright the two are
const float PALE_SHIFT = 0.10, OWN_SHIFT = -0.12;  // how far towards the root, as tilt of the strand
const float UNEVEN = 0.25;                   // how far light and dark strands have theirs apart

// Unit, towards the root, which is where v is highest.
vec3 strand_along(vec3 n, vec2 place) {
    vec3 px = dFdx(p_room), py = dFdy(p_room);
    vec3 way = cross(py, n) * dFdx(place).y + cross(n, px) * dFdy(place).y;
    float size = dot(way, way);
    return size > 0.0 ? way * inversesqrt(size) : vec3(0.0, 1.0, 0.0);
}

float strand_lobe(vec3 t, vec3 h, float power) {
    float c = dot(t, h);
    return pow(max(1.0 - c * c, 0.0), 0.5 * power);
}

vec3 strand_lamp(vec3 base, float uneven, vec3 t, vec3 n, vec3 v, vec3 lamp) {
    vec3 h = normalize(lamp + v);
    float pale = strand_lobe(normalize(t + (PALE_SHIFT + uneven) * n), h, 90.0);
    float own = strand_lobe(normalize(t + (OWN_SHIFT + uneven) * n), h, 18.0);
    return (PALE * pale + OWN * own * base) * clamp(0.2 + dot(n, lamp), 0.0, 1.0);
}

// base: linear colour; about: sRGB colour of the strands about it; t: unit, along the strand; visible: share of the lamp.
vec3 strand_light(vec3 base, vec3 about, vec3 t, vec3 n, vec3 v, float visible) {
    float light = dot(base, vec3(0.333)), mean = dot(about * about, vec3(0.333));
    float uneven = UNEVEN * clamp((light - mean) / (light + mean + 1e-4), -0.5, 0.5);
    return strand_lamp(base, uneven, t, n, v, KEY_DIRECTION) * KEY * visible + strand_lamp(base, uneven, t, n, v, FILL_DIRECTION) * FILL;
}
