#version 330
// The rigid component: vistel.figure.rigid.skinning_kernels.skin_dual_quaternion for one vertex (Kavan 2008, shortest arcs).
#include "deform/plan.glsl"
in vec3 rest;
in vec3 rest_normal;
in ivec4 bone;
in vec4 weight;              // largest first
in vec3 bulge;               // vistel.figure.rigid.bulge: way out,
in vec3 bulging;             // share above and below the joint, hinge or -1
in ivec2 layers;             // vistel.figure.layers.skin: its terms from, to
in float fall;               // of its own field [1/m] where the implicit component shapes the skin, else 0
uniform sampler2D terms;     // along the normal [m], to the normal
uniform isampler2D channels;
out vec4 position;           // w: what the layers add to the offset of its field
out vec4 normal;

vec3 turned(vec3 v, vec3 r, float s) {
    return v + 2.0 * cross(r, cross(r, v) + s * v);
}

void main() {
    int bones = words(0).x;
    int first = bones + BONE_TEXELS * bone.x;
    vec3 shape = rest;
    int hinge = int(bulging.z);
    if (hinge >= 0) {        // amplitudes come after the bones, two for each hinge
        vec4 pair = numbers(bones + BONE_TEXELS * BONES + hinge / 2);
        shape += dot(bulging.xy, hinge % 2 == 0 ? pair.xy : pair.zw) * bulge;
    }
    vec3 n = rest_normal;
    float moved = 0.0;
    for (int k = layers.x; k < layers.y; k++) {  // what the layers do comes after the amplitudes
        vec4 term = number(bones + BONE_TEXELS * (BONES + 1), texelFetch(channels, texel(k), 0).x)
            * texelFetch(terms, texel(k), 0);
        moved += term.x;
        n += term.yzw;
    }
    if (layers.x < layers.y) {
        shape += moved * rest_normal;
        n = normalize(n);
    }
    if (weight.x >= 1.0) {
        vec4 x = numbers(first), y = numbers(first + 1), z = numbers(first + 2);
        vec4 p = vec4(shape, 1.0);
        position = vec4(dot(x, p), dot(y, p), dot(z, p), fall * moved);
        normal = vec4(dot(x.xyz, n), dot(y.xyz, n), dot(z.xyz, n), 0.0);
        return;
    }
    vec4 q = numbers(first + 3);
    vec4 real = weight.x * q, dual = weight.x * numbers(first + 4);
    for (int k = 1; k < 4; k++) {
        int at = bones + BONE_TEXELS * bone[k];
        vec4 o = numbers(at + 3);
        float w = dot(q, o) < 0.0 ? -weight[k] : weight[k];
        real += w * o;
        dual += w * numbers(at + 4);
    }
    float scale = 1.0 / sqrt(dot(real, real));
    real *= scale;
    dual *= scale;
    vec3 r = real.xyz, t = dual.xyz;
    // The imaginary parts r and t: p' = turned p + 2 (s t - e r + r x t).
    position = vec4(turned(shape, r, real.w) + 2.0 * (real.w * t - dual.w * r + cross(r, t)), fall * moved);
    normal = vec4(turned(n, r, real.w), 0.0);
}
