#version 330
// Darkens the picture by the mean of 4 x 4 texels of the same surface, which takes the taps' noise away.
uniform sampler2D open_share;
uniform sampler2D depth;
uniform vec4 part;
in vec2 at;
out vec4 colour;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(open_share, 0));
    float own = textureLod(depth, part.xy + at * part.zw, 0.0).r, sum = 0.0, weights = 0.0;
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            vec2 near = clamp(at + (vec2(x, y) - 1.5) * texel, 0.5 * texel, 1.0 - 0.5 * texel);
            float other = textureLod(depth, part.xy + near * part.zw, 0.0).r;
            float w = step(abs(other - own), 0.02 * (1.0 - own) + 1e-5);
            sum += w * textureLod(open_share, near, 0.0).r;
            weights += w;
        }
    float light = weights > 0.0 ? sum / weights : 1.0;
    // What hides light throws back some of its own, which is warmer than the sky's; the picture's values are roots of light.
    colour = vec4(pow(vec3(mix(1.0, light, 0.85)), vec3(0.36, 0.50, 0.56)), 1.0);
}
