// What of a surface is there. SAMPLED: pixels have samples, of which a share is covered; else a place is there or it is not. FILM:
// it is nowhere solid, and mixed with what is behind it.
uniform sampler2D opacity;
uniform float cutoff;

float solid_at(vec2 place) {
    float a = texture(opacity, place).r;
#ifdef FILM
    return a;
#elif defined(SAMPLED)
#ifdef BLEND
    return a;
#else
    // Smaller pictures of it are mixed with what is not there; as sharp as a pixel (Golus 2017).
    vec2 size = vec2(textureSize(opacity, 0));
    vec2 x = dFdx(place) * size, y = dFdy(place) * size;
    a *= 1.0 + 0.25 * max(0.0, 0.5 * log2(max(dot(x, x), dot(y, y))));
    return clamp((a - cutoff) / max(fwidth(a), 1e-4) + 0.5, 0.0, 1.0);
#endif
#else
    return a < cutoff ? 0.0 : 1.0;
#endif
}
