#version 330
// How much of the light from everywhere is hidden by what is near, from the picture's depth (McGuire et al., "The Alchemy
// screen-space ambient obscurance algorithm", 2011).
uniform sampler2D depth;
uniform mat4 room_from_clip;
uniform vec3 eye;
uniform vec4 part;      // of the depth picture that is looked at: left, bottom, width, height
uniform float pixels;   // that a metre has at a distance of one metre, as part of the width
uniform float aspect;   // of the part: width / height
in vec2 at;
out float open_share;

const float REACH = 0.16;   // metres
const float STRENGTH = 1.5;
const int TAPS = 14;
const float NEIGHBOURHOOD = 0.006;  // metres

// Beside the part lies another eye's picture or another screen's: what is nearest within it stands for what is not seen.
vec3 place(vec2 anywhere) {
    vec2 half_texel = 0.5 / (vec2(textureSize(depth, 0)) * part.zw);
    vec2 uv = clamp(anywhere, half_texel, 1.0 - half_texel);
    vec4 p = room_from_clip * vec4(2.0 * uv - 1.0, 2.0 * textureLod(depth, part.xy + uv * part.zw, 0.0).r - 1.0, 1.0);
    return p.xyz / p.w;
}

// How the surface goes on along a step in the picture.
vec3 slope(vec3 p, vec2 by) {
    vec3 ahead = place(at + by) - p, back = p - place(at - by);
    float a = dot(ahead, ahead), b = dot(back, back);
    if (any(lessThan(at - by, vec2(0.0)))) return ahead;
    if (any(greaterThan(at + by, vec2(1.0)))) return back;
    return a > 4.0 * b ? back : b > 4.0 * a ? ahead : ahead + back;
}

void main() {
    vec3 p = place(at);
    // The normal of the neighbourhood, so that triangles do not show; at edges from the nearer side only.
    float away = length(p - eye);
    vec2 texel = 1.0 / (vec2(textureSize(depth, 0)) * part.zw);
    vec2 beside = max(texel, min(0.02, NEIGHBOURHOOD * pixels / away) * vec2(1.0, aspect));
    vec3 n = cross(slope(p, vec2(beside.x, 0.0)), slope(p, vec2(0.0, beside.y)));
    float size = length(n);
    if (size < 1e-12) {
        open_share = 1.0;
        return;
    }
    n /= size;
    float reach = min(0.25, REACH * pixels / away);
    float turn = 6.2831853 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    float hidden = 0.0;
    for (int k = 0; k < TAPS; ++k) {
        float share = (float(k) + 0.5) / float(TAPS), a = turn + 2.399963 * float(k);
        vec3 d = place(at + reach * share * vec2(cos(a), sin(a) * aspect)) - p;
        float far2 = dot(d, d);
        float fade = max(0.0, 1.0 - far2 / (REACH * REACH));
        // What rises less than ten degrees from the surface is the surface itself, in its triangles.
        hidden += fade * fade * fade * max(0.0, dot(d, n) - 0.18 * sqrt(far2) - 0.003) / (far2 + 1e-4);
    }
    open_share = max(0.0, 1.0 - STRENGTH * REACH * hidden / float(TAPS));
}
