// The frame's table (vistel.implicit.deformation.deform_plan): texels of four words, floats by their bits.
uniform isampler2D plan;

ivec2 texel(int i) {
    return ivec2(i % TABLE_WIDTH, i / TABLE_WIDTH);
}

ivec4 words(int i) {
    return texelFetch(plan, texel(i), 0);
}

vec4 numbers(int i) {
    return intBitsToFloat(words(i));
}

float number(int i, int k) {  // the k-th of a packed list that begins at texel i
    return numbers(i + (k >> 2))[k & 3];
}

struct Starts { int bones, blocks, rows, spheres, pairs, members, corners, parameters; };

Starts starts() {
    ivec4 a = words(0), b = words(1);
    return Starts(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w);
}

bool anything_acts() {
    return words(2).x != 0;
}
