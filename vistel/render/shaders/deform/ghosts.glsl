// The min rule (vistel.implicit.deformation.min_rule_kernels, effect_kernels): what every sort of body adds to a vertex's sums. Pairs
// are a value and its slope d/ds.

struct Sums { vec2 raised, least, cut, soft; };

const Sums NOTHING = Sums(vec2(0.0), vec2(HUGE, 0.0), vec2(HUGE, 0.0), vec2(HUGE, 0.0));

void lower(vec2 value, inout vec2 least) {
    if (value.x < least.x)
        least = value;
}

// p(y; ye) = y (1 - y/ye)^2 outside (y > 0), with its slope; y: deficit and slope.
vec2 propagation(vec2 y, float inverse) {
    float outside = max(y.x, 0.0);
    float p = max(1.0 - outside * inverse, 0.0);
    return vec2(outside * p * p, y.x > 0.0 ? y.y * p * (1.0 - 3.0 * outside * inverse) : 0.0);
}

void add_soft(vec2 field, float contact, float q, float ye, inout Sums acc) {
    acc.raised += q * propagation(vec2(T - contact * field.x, -contact * field.y), 1.0 / max(ye, TINY));
    lower(vec2(q * (T - field.x), -q * field.y), acc.soft);
}

void add_rigid(vec2 field, float ye, inout Sums acc) {
    vec2 y = vec2(T - field.x, -field.y);
    acc.raised += propagation(y, 1.0 / max(ye, TINY));
    lower(y, acc.cut);
}

void add_neighbour(vec2 field, float contact, float m, inout Sums acc) {
    float y = T - contact * field.x;
    float share = y < 0.0 ? m : 1.0 / max(m, SMALL);
    lower(vec2(share * y, -share * contact * field.y), acc.least);
}

void join_shown(vec2 field, inout vec2 shown) {
    if (field.x > shown.x)
        shown = field;
}

// DF of a joint's vertex: F_joint + mu DIFF(F_own, F_other) + (1 - mu) F_own.
vec2 joint_field(vec2 own, vec2 other, vec2 sphere, float mu) {
    float x = own.x * own.x - other.x * other.x;
    float dx = 2.0 * (own.x * own.y - other.x * other.y);
    float r = x * x + SOFT2;
    float half_ = 1.0 / sqrt(r);
    float root = 1.0 / sqrt(r * half_);
    float slope = dx * root * (1.0 - 0.5 * x * x * half_ * half_);
    return sphere + mu * vec2(x * root, slope) + (1.0 - mu) * own;
}

vec2 total_field(vec2 own, vec2 shown, float contact, Sums acc) {
    float raised = min(acc.raised.x, CAP);
    vec2 phi = vec2(own.x - T + min(raised, acc.least.x), own.y + (acc.least.x < raised ? acc.least.y : acc.raised.y));
    lower(acc.cut, phi);
    lower(contact * vec2(shown.x - T + acc.soft.x, shown.y + acc.soft.y), phi);
    return phi;
}

// -- effects beside the collision; their parameters begin at texel `list` with number `k` ---------------------------

void fading(float gain, vec2 field, float contact, float q, float ye, inout Sums acc) {
    vec2 y = vec2(T - contact * field.x, -contact * field.y);
    acc.raised += gain * q * propagation(y, 1.0 / max(ye, LEAST_DIVISOR));
    if (y.x < 0.0) // outside it holds nothing back: its maker is not there
        lower(gain * q * y, acc.least);
}

vec3 triple(int list, int k) {
    return vec3(number(list, k), number(list, k + 1), number(list, k + 2));
}

void pulled(int list, int k, vec3 p, vec3 n, float s, vec2 field, float contact, float q, float ye, inout Sums acc) {
    float hold = number(list, k), h = T - hold;
    int pulls = int(number(list, k + 1));
    vec3 at = p + s * n;
    vec2 reach = vec2(0.0);
    for (int i = 0; i < pulls; i++) {
        int b = k + 2 + 9 * i;
        vec3 direction = triple(list, b + 3);
        float scale = number(list, b + 6), plateau = number(list, b + 7), strength = number(list, b + 8);
        vec3 d = at - triple(list, b);
        float along = dot(d, direction), rate = dot(n, direction);
        float ahead = along > 0.0 ? 1.0 : 0.0;
        along *= ahead;
        rate *= ahead;
        d -= along * direction;
        float u = dot(d, d) * scale;
        float du = 2.0 * (dot(d, n) - dot(d, direction) * rate) * scale;
        if (plateau > 0.0) {
            float r = sqrt(u), far = max(0.0, (r - plateau) / (1.0 - plateau));
            du = du * far / (max(r, LEAST_DIVISOR) * (1.0 - plateau));
            u = far * far;
        }
        float w = max(1.0 - u, 0.0);
        vec2 value = vec2(strength * w * w, -2.0 * strength * w * du);
        if (value.x > reach.x)
            reach = value;
    }
    float inverse = 1.0 / max(ye, LEAST_DIVISOR);
    float y = T - contact * field.x, dy = -contact * field.y;
    float outside = max(y, 0.0);
    float bump = max(1.0 - outside * inverse, 0.0);
    float skin = outside * bump * bump, dskin = bump * (1.0 - 3.0 * outside * inverse);
    float v = clamp((outside - hold) / h, 0.0, 1.0);
    bool near = outside <= hold;
    float held = near ? outside : (1.0 - v) * (1.0 - v) * (hold * (1.0 + 2.0 * v) + h * v);
    float dheld = near ? 1.0 : (1.0 - v) / h * (h - 3.0 * v * (2.0 * hold + h));
    float rise = q * (((1.0 - reach.x) * dskin + reach.x * dheld) * dy + reach.y * (held - skin));
    acc.raised += vec2(q * ((1.0 - reach.x) * skin + reach.x * held), y > 0.0 ? rise : 0.0);
    lower(vec2(q * (T - field.x), -q * field.y), acc.soft);
}

vec2 times(vec2 own, float factor, float slope) {
    return vec2(own.x * (1.0 + factor), own.y * (1.0 + factor) + own.x * slope);
}

vec2 force(int effect, int list, int k, vec3 p, vec3 n, float s, vec2 own) {
    if (effect == DIRECTIONAL) {
        vec3 axis = triple(list, k + 6);
        float c = number(list, k + 10), along = dot(n, axis);
        float u = c * (dot(p, axis) - number(list, k + 9) + s * along);
        float factor = clamp(u, -MOST_CHANGE, MOST_CHANGE);
        return times(own, factor, factor == u ? c * along : 0.0);
    }
    if (effect == SHEAR) {
        vec3 u = triple(list, k + 6), v = triple(list, k + 10), at = p + s * n;
        float a = dot(at, u) - number(list, k + 9), b = dot(at, v) - number(list, k + 13), c = number(list, k + 14);
        float factor = clamp(c * a * b, -MOST_CHANGE, MOST_CHANGE);
        return times(own, factor, factor == c * a * b ? c * (a * dot(n, v) + b * dot(n, u)) : 0.0);
    }
    if (effect == RADIAL) {
        vec3 d = p + s * n - triple(list, k + 6);
        float scale = number(list, k + 9), c = number(list, k + 10);
        float w = max(1.0 - dot(d, d) * scale, 0.0);
        return times(own, c * w * w, -2.0 * c * w * 2.0 * dot(d, n) * scale);
    }
    return own;
}
