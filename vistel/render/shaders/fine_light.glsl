// Light where there is time for it: surfaces mirror the room by their roughness, shadows grow soft with distance.
// (GGX: Walter et al. 2007; Smith joint visibility: Heitz 2014; sheen: Estevez and Kulla 2017; surroundings: Karis 2013.)
uniform sampler2D mirrored;    // the room as MIRRORS surfaces of growing roughness show it: maps of the sphere, one above the other
uniform vec3 irradiance[9];    // its diffuse light in spherical harmonics, as radiance of a white surface

const float MIRRORS = 5.0;
const float PI = 3.14159265;

struct Surface {
    vec3 base;      // diffuse colour
    float f0;       // mirrored straight on
    float rough;    // 0..1
    vec3 sheen;     // colour of the fuzz of cloth
    float skin;     // 1: light goes in and comes out elsewhere, red farthest
};

vec3 around(vec3 n) {
    return max(vec3(0.0),
        irradiance[0] + irradiance[1] * n.y + irradiance[2] * n.z + irradiance[3] * n.x
        + irradiance[4] * (n.x * n.y) + irradiance[5] * (n.y * n.z) + irradiance[6] * (3.0 * n.z * n.z - 1.0)
        + irradiance[7] * (n.x * n.z) + irradiance[8] * (n.x * n.x - n.y * n.y));
}

vec3 mirror(vec3 r, float rough) {
    vec2 at = vec2(atan(r.z, r.x) / (2.0 * PI) + 0.5, acos(clamp(r.y, -1.0, 1.0)) / PI);
    float level = rough * (MIRRORS - 1.0);
    float low = floor(level), part = level - low;
    at.y = clamp(at.y, 0.02, 0.98);  // half a texel from the next map
    vec3 a = textureLod(mirrored, vec2(at.x, (at.y + low) / MIRRORS), 0.0).rgb;
    vec3 b = textureLod(mirrored, vec2(at.x, (at.y + min(low + 1.0, MIRRORS - 1.0)) / MIRRORS), 0.0).rgb;
    return mix(a, b, part);
}

// What a surface of roughness `rough` mirrors of a light at half vector h, without Fresnel.
float lobe(float nl, float nv, float nh, float rough) {
    float a = rough * rough, a2 = a * a;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float smith = nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2);
    return a2 / (PI * d * d) * 0.5 / max(smith, 1e-4);
}

vec3 fresnel(vec3 f0, float c) {
    float k = 1.0 - c, k2 = k * k;
    return f0 + (1.0 - f0) * k2 * k2 * k;
}

// Share of the surroundings that is mirrored, after their mean light was taken for the lobe (Karis' fit).
vec3 mirrored_share(vec3 f0, float rough, float nv) {
    vec4 r = rough * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    return f0 * (-1.04 * a + r.z) + (1.04 * a + r.w);
}

// f0: what is mirrored straight on; metals mirror in their colour.
vec3 fine_light_of(Surface s, vec3 f0, vec3 p, vec3 n, float open_share) {
    vec3 v = normalize(eye - p), l = normalize(KEY_DIRECTION), h = normalize(l + v);
    float c = dot(n, l), nl = max(c, 0.0), nv = max(abs(dot(n, v)), 1e-3), nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
    float visible = lit_softly(p, n);
    vec3 wrap = s.skin * vec3(0.34, 0.22, 0.16);
    vec3 reach = clamp((c + wrap) / ((1.0 + wrap) * (1.0 + wrap)), 0.0, 1.0);
    vec3 seen = mix(vec3(visible), vec3(sqrt(visible), visible, visible), 0.3 * s.skin);
    vec3 out_diffuse = from_within(s.base * (KEY * reach * seen + around(n) * open_share), s.skin);

    vec3 bright = nl * fresnel(f0, vh) * mix(lobe(nl, nv, nh, s.rough), lobe(nl, nv, nh, 0.55 * s.rough), 0.15 * s.skin);
    // The key light is a lamp of some size, seen in the mirror of smooth surfaces: KEY is what it lights, times pi its own light.
    vec3 mirror_key = KEY * (min(bright, vec3(6.0)) * PI * visible);
    vec3 r = reflect(-v, n);
    vec3 mirror_room = mirror(r, s.rough) * (mirrored_share(f0, s.rough, nv) * open_share * clamp(1.0 + 1.2 * r.y + 0.6, 0.0, 1.0));

    // Fuzz: brightest along the surface, from every side (Estevez and Kulla's distribution, roughness 0.5).
    float sine = sqrt(max(0.0, 1.0 - nh * nh));
    float fuzz = (2.0 + 2.0) * sine * sine / (2.0 * PI) / max(4.0 * (nl + nv - nl * nv), 0.05);
    float edge = 1.0 - nv;
    vec3 sheen = s.sheen * (KEY * (PI * nl * fuzz * visible) + around(n) * (edge * edge * open_share));
    return out_diffuse + mirror_key + mirror_room + sheen;
}

vec3 fine_light(Surface s, vec3 p, vec3 n, float open_share) {
    return fine_light_of(s, vec3(s.f0), p, n, open_share);
}
