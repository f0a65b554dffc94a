#version 330
// A part of a figure whose file says what it is like (UsdPreviewSurface). What it has no picture of is not looked up: FINISH_MAP,
// NORMAL_MAP, GLOW, GLOW_MAP, HOLES, BOTH_SIDES, STRANDS are compiled in as needed.
#include "common.glsl"
#ifdef FINE
#include "fine_light.glsl"
#else
#include "plain_light.glsl"
#endif
uniform sampler2D albedo;
uniform vec4 box;        // of the texture that the patch's pictures span: lowest u and v, one over width and height
uniform float rough;
uniform float metallic;
in vec3 p_room;
in vec3 n_room;
in vec2 at;
#ifdef WRINKLED
uniform sampler2D wrinkle_light;
in vec2 fold_at;
in vec4 fold;
#endif
#ifdef FINISH_MAP
uniform sampler2D finish;  // occlusion, roughness, metallic
#endif
#ifdef NORMAL_MAP
uniform sampler2D tangent_normal;  // red along u, green along v
#endif
#ifdef GLOW
uniform vec3 glow;
#ifdef GLOW_MAP
uniform sampler2D glow_picture;
#endif
#endif
#ifdef HOLES
#include "holes.glsl"
#endif
#ifdef FILM
const float BEHIND_FILM = 0.18;
#endif
in float kind;  // 0 cloth and hair, 1 skin, between them at its edge, 2 eye
out vec4 colour;

#ifdef STRANDS
#include "strands.glsl"
#endif

#ifdef NORMAL_MAP
// The frame of the texture on the surface comes from how both change from pixel to pixel (Schueler 2013).
vec3 bent(vec3 n, vec2 place) {
    vec3 px = dFdx(p_room), py = dFdy(p_room);
    vec2 tx = dFdx(place), ty = dFdy(place);
    vec3 along_x = cross(py, n), along_y = cross(n, px);
    vec3 u = along_x * tx.x + along_y * ty.x, v = along_x * tx.y + along_y * ty.y;
    float size = max(dot(u, u), dot(v, v));
    if (size <= 0.0) return n;
    vec3 m = texture(tangent_normal, place).xyz * (255.0 / 127.0) - 128.0 / 127.0;
    return normalize((u * m.x + v * m.y) * inversesqrt(size) + n * max(m.z, 0.05));
}
#endif

void main() {
    vec2 place = (at - box.xy) * box.zw;
    float alpha = 1.0;
#ifdef HOLES
    alpha = solid_at(place);
    if (alpha <= 0.0) discard;
#endif
    vec3 base = texture(albedo, at).rgb;
    base *= base;
#ifdef WRINKLED
    vec4 lit = 1.0 + fold * (texture(wrinkle_light, fold_at) * 2.0 - 256.0 / 255.0);
    base *= max(lit.x * lit.y * lit.z * lit.w, 0.0);
#endif
#ifdef FILM
    base *= alpha;  // what it mirrors is added whole
#endif
    vec3 n = normalize(n_room);
#ifdef BOTH_SIDES
    n = gl_FrontFacing ? n : -n;
#endif
    vec3 flat_n = n;
#ifdef NORMAL_MAP
    n = bent(n, place);
#endif
    vec3 orm = vec3(1.0, rough, metallic);
#ifdef FINISH_MAP
    orm = texture(finish, place).rgb;
#endif
    orm.y = max(orm.y, SMOOTHEST);
#ifdef FINE
    Surface s = Surface(base * (1.0 - orm.z), 0.04, orm.y, vec3(0.0), skin_of(kind) * (1.0 - orm.z));
    vec3 shown = fine_light_of(s, mix(vec3(0.04), base, orm.z), p_room, n, orm.x);
#else
    float visible = 0.0;
    if (dot(flat_n, KEY_DIRECTION) > -0.35) {
        // Four taps: shadows along the light's way, as of a chin on the neck, show the map's texels else.
        vec3 s = shadow_place(p_room, flat_n, 0.025);
        visible = 0.5 * (lit_at(s + vec3(1.3, -1.3, 0.0) * shadow_texel) + lit_at(s + vec3(-1.3, 1.3, 0.0) * shadow_texel));
    }
    vec3 shown = plain_light(base, orm.y, orm.z, n, normalize(eye - p_room), visible, orm.x, skin_of(kind) * (1.0 - orm.z));
#endif
#ifdef STRANDS
    shown += strand_light(base, texture(albedo, at, 3.0).rgb, strand_along(flat_n, place), n, normalize(eye - p_room), lit_at(shadow_place(p_room, flat_n, 0.025)));
#endif
    if (kind > 1.5) shown += catchlight(flat_n, normalize(eye - p_room)) * KEY;
#ifdef GLOW
    vec3 own = glow;
#ifdef GLOW_MAP
    own *= pow(texture(glow_picture, place).rgb, vec3(2.2));
#endif
    shown += own;
#endif
#ifdef FILM
    // It is added to what is displayed already: as much as it would add to what is of middling brightness.
    colour = vec4(display(shown + BEHIND_FILM) - display(vec3(BEHIND_FILM)), alpha);
#else
    colour = vec4(display(shown), alpha);
#endif
}
