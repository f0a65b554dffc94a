#version 330
// A drawn corner: its vertex's place, and the normal of the triangles round it where any of them moved
// (vistel.implicit.deformation.normals_kernels).
#include "deform/plan.glsl"
uniform sampler2D placed;
uniform sampler2D rigid_normals;
uniform isampler2D fans;
in ivec3 fan;                // the vertex; its fan from, to
out vec3 position;
out vec3 normal;

void main() {
    vec4 here = texelFetch(placed, texel(fan.x), 0);
    position = here.xyz;
    normal = texelFetch(rigid_normals, texel(fan.x), 0).xyz;
    if (!anything_acts())
        return;
    float moved = mod(here.w, 2.0);
    vec3 sum = vec3(0.0), before = vec3(0.0);
    for (int k = fan.y; k < fan.z; k++) {
        int v = texelFetch(fans, texel(k), 0).x;
        if (v == GAP) {
            before = vec3(0.0);
            continue;
        }
        vec4 there = texelFetch(placed, texel(v), 0);
        moved += mod(there.w, 2.0);
        sum += cross(before, there.xyz - here.xyz);
        before = there.xyz - here.xyz;
    }
    float square = dot(sum, sum);
    if (moved > 0.0 && square > LEAST_SQUARE)
        normal = sum / sqrt(square);
}
