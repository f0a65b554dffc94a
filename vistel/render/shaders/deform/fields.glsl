// Fields of primitives along a vertex's normal: P(s) = p + s n. Everything returns (F, dF/ds); each function is one of
// vistel.implicit.deformation.field_kernels or meet_kernels, for one vertex instead of 64.

vec2 cone(int row, vec3 p, vec3 n, float s) {
    vec4 r0 = numbers(row), r1 = numbers(row + 1), r2 = numbers(row + 2);
    vec3 u = vec3(r0.w, r1.xy), w = p - r0.xyz;
    float length_ = r1.z, ra = r1.w, k = r2.x, weight = r2.y;
    float wn = dot(w, n), nu = dot(n, u);
    float along = wn + s;
    float x = dot(w, u) + s * nu;
    float m = dot(w, w) + s * (along + wn);
    float rho = max(m - x * x, 0.0);
    float a = clamp(x + k * rho / max(ra + k * x, TINY), 0.0, length_);
    float dx = x - a;
    float inverse = 1.0 / (ra + k * a);
    inverse *= inverse;
    float q = max(1.0 - (dx * dx + rho) * inverse, 0.0);
    return vec2(weight * q * q, -4.0 * weight * q * (along - a * nu) * inverse);
}

float power(float x, float e) {  // |x|^e, 0 for x = 0 whatever e
    return abs(x) > TINY ? pow(abs(x), e) : 0.0;
}

float half_slope(float x, float e) {  // (e / 2) d|x|^(2/e)/dx
    float v = power(x, 2.0 / e - 1.0);
    return x >= 0.0 ? v : -v;
}

// P and n in the frame of a primitive other than a cone-sphere.
void local(int row, inout vec3 p, inout vec3 n) {
    vec4 r0 = numbers(row), r1 = numbers(row + 1), r2 = numbers(row + 2);
    vec3 x = r0.xyz, y = vec3(r0.w, r1.xy), z = vec3(r1.zw, r2.x);
    p -= r2.yzw;
    p = vec3(dot(x, p), dot(y, p), dot(z, p));
    n = vec3(dot(x, n), dot(y, n), dot(z, n));
}

vec2 superellipsoid(int row, vec3 p, vec3 n, float s) {
    vec4 r3 = numbers(row + 3), r4 = numbers(row + 4);
    float e1 = r3.w, e2 = r4.x, weight = r4.y;
    n /= r3.xyz;
    p = p / r3.xyz + s * n;
    if (max(max(abs(p.x), abs(p.y)), abs(p.z)) >= 1.0)
        return vec2(0.0);
    float inner = power(p.x, 2.0 / e2) + power(p.y, 2.0 / e2);
    float h = power(inner, e2 / e1) + power(p.z, 2.0 / e1);
    float q = max(1.0 - power(h, e1), 0.0);
    float bend = power(inner, e2 / e1 - 1.0);
    float dh = bend * (half_slope(p.x, e2) * n.x + half_slope(p.y, e2) * n.y) + half_slope(p.z, e1) * n.z;
    return vec2(weight * q * q, -4.0 * weight * q * power(h, e1 - 1.0) * dh);
}

vec2 supertoroid(int row, vec3 p, vec3 n, float s) {
    vec4 r3 = numbers(row + 3), r4 = numbers(row + 4);
    float alpha = r3.w, e1 = r4.x, e2 = r4.y, weight = r4.z, reach = r4.w;
    vec3 size = vec3(r3.xy, r3.z * reach);
    n /= size;
    p = p / size + s * n;
    float around = power(p.x, 2.0 / e2) + power(p.y, 2.0 / e2);
    float v = (power(around, 0.5 * e2) - alpha) / reach;
    if (abs(v) >= 1.0 || abs(p.z) >= 1.0)
        return vec2(0.0);
    float h = power(v, 2.0 / e1) + power(p.z, 2.0 / e1);
    float q = max(1.0 - power(h, e1), 0.0);
    float dv = power(around, 0.5 * e2 - 1.0) * (half_slope(p.x, e2) * n.x + half_slope(p.y, e2) * n.y) / reach;
    float dh = half_slope(v, e1) * dv + half_slope(p.z, e1) * n.z;
    return vec2(weight * q * q, -4.0 * weight * q * power(h, e1 - 1.0) * dh);
}

vec2 rounded_polygon(int row, int corners, vec3 p, vec3 n, float s) {
    vec4 r3 = numbers(row + 3);
    float inverse = 1.0 / (r3.x * r3.x), weight = r3.y;
    int first = corners + int(r3.z), count = int(r3.w);
    p += s * n;
    float best = HUGE;
    vec2 from = vec2(0.0);
    bool inside = true;
    for (int j = 0; j < count; j++) {
        vec2 c = numbers(first + j).xy;
        vec2 e = numbers(first + (j + 1 < count ? j + 1 : 0)).xy - c, w = p.xy - c;
        inside = inside && e.x * w.y - e.y * w.x >= 0.0;
        vec2 d = w - clamp(dot(e, w) / max(dot(e, e), SMALL), 0.0, 1.0) * e;
        if (dot(d, d) < best) {
            best = dot(d, d);
            from = d;
        }
    }
    if (inside)
        from = vec2(0.0);
    float q = max(1.0 - (dot(from, from) + p.z * p.z) * inverse, 0.0);
    return vec2(weight * q * q, -4.0 * weight * q * (dot(from, n.xy) + p.z * n.z) * inverse);
}

vec2 primitive(int kind, int row, int corners, vec3 p, vec3 n, float s) {
    if (kind == CONE_SPHERE)
        return cone(row, p, n, s);
    local(row, p, n);
    if (kind == SUPERELLIPSOID)
        return superellipsoid(row, p, n, s);
    if (kind == ROUNDED_POLYGON)
        return rounded_polygon(row, corners, p, n, s);
    return supertoroid(row, p, n, s);
}

// Ricci union of power 4 from the sums of F^4 and F^3 dF.
vec2 union_end(vec2 total) {
    float t = max(total.x, SMALL);
    float half_ = 1.0 / sqrt(t);
    float root = t * half_;
    float quarter = 1.0 / sqrt(root);
    return vec2(root * quarter, total.y * half_ * quarter);
}

void union_add(vec2 f, inout vec2 total) {
    total += f.x * f.x * f.x * f;
}

// The union of the primitives in members first .. last.
vec2 group_field(Starts at, int first, int last, vec3 p, vec3 n, float s) {
    vec2 total = vec2(0.0), f = vec2(0.0);
    for (int k = first; k < last; k++) {
        ivec4 member = words(at.members + k);
        f = primitive(member.y, at.rows + 6 * member.x, at.corners, p, n, s);
        union_add(f, total);
    }
    return last - first == 1 ? f : union_end(total);
}

// The union of the cone-spheres in rows first .. last.
vec2 limb_field(Starts at, int first, int last, vec3 p, vec3 n, float s) {
    vec2 total = vec2(0.0), f = vec2(0.0);
    for (int k = first; k < last; k++) {
        f = cone(at.rows + 6 * k, p, n, s);
        union_add(f, total);
    }
    return last - first == 1 ? f : union_end(total);
}
