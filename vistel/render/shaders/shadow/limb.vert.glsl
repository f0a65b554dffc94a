#version 330
// A limb's cone-sphere from a unit sphere whose halves are drawn apart; it lies inside the skin it stands for.
uniform mat4 shadow_from_room;
in vec3 direction;   // on the unit sphere, z along the limb; z >= 0 belongs to end b
in float end;        // 0: a, 1: b
in vec4 limb_a;      // xyz and radius [m]
in vec4 limb_b;

void main() {
    vec3 along = limb_b.xyz - limb_a.xyz;
    float len = length(along);
    vec3 w = len > 1e-6 ? along / len : vec3(0.0, 1.0, 0.0);
    vec3 u = normalize(cross(w, abs(w.x) < 0.8 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
    vec3 n = mat3(u, cross(w, u), w) * direction;
    vec4 c = mix(limb_a, limb_b, end);
    gl_Position = shadow_from_room * vec4(c.xyz + n * c.w, 1.0);
}
