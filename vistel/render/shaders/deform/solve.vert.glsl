#version 330
// A vertex along its normal to F = T (mathematics M6.5), as vistel.implicit.deformation.solve_kernels does it for 64 of them.
#include "deform/plan.glsl"
#include "deform/fields.glsl"
#include "deform/ghosts.glsl"
uniform sampler2D overlap;   // shares with which neighbours collide, LANES per row

in vec4 position;            // rigid; w: what layers add to the offset
in vec4 normal;
in ivec2 place;              // block (-1 none) and lane
in vec4 calibration_a;       // weight, offset, contact, mu
in vec3 calibration_b;       // alpha, room inwards, outwards [m]
#ifdef DISPLACED
in float displacement;       // along the normal [m]
in vec3 laid;                // what a face does, room frame [m]
#endif
out vec4 placed;             // w: 0 untouched, 1 moved; 2 more: no root found

struct Pair { int rule, effect, parameters, first, last; float share, q, ye; };

Pair pair_of(Starts at, int k) {
    ivec4 a = words(at.pairs + 2 * k), b = words(at.pairs + 2 * k + 1);
    float share = a.x == NEIGHBOUR ? texelFetch(overlap, texel(a.y * LANES + place.y), 0).x : 0.0;
    return Pair(a.x, b.x, b.y, a.z, a.w, share, intBitsToFloat(b.z), intBitsToFloat(b.w));
}

bool finite(vec3 v) {
    return !(any(isnan(v)) || any(isinf(v)));
}

void solve() {
    placed = vec4(position.xyz, 0.0);
    if (place.x < 0)
        return;
    Starts at = starts();
    ivec4 mine = words(at.blocks + 2 * place.x), joint = words(at.blocks + 2 * place.x + 1);
    if (joint.w == 0)
        return;
    float weight = calibration_a.x, offset = calibration_a.y + position.w, contact = calibration_a.z, mu = calibration_a.w;
    float inward = calibration_b.y, outward = calibration_b.z;
    vec3 p = position.xyz, n = normal.xyz;
    bool folds = joint.z >= 0;
    // A normal may point into the body.
    if (group_field(at, mine.z, mine.w, p, n, 0.0).y > 0.0)
        n = -n;

    float s = 0.0, low = -inward, high = outward, limit = max(0.25 * (inward + outward), TINY);
    float last_s = 0.0, last_f = 0.0, last_rise = 0.0, shift = 0.0;
    bool known_low = false, known_high = false, open = true, ended = false;
    vec2 phi = vec2(0.0);
    for (int evaluation = 0; evaluation < MAX_EVALUATIONS; evaluation++) {
        vec2 own = group_field(at, mine.z, mine.w, p, n, s), shown = own, df = own;
        Sums acc = NOTHING;
        if (folds) {
            vec2 other = limb_field(at, joint.x, joint.y, p, n, s);
            df = joint_field(own, other, cone(at.spheres + 6 * joint.z, p, n, s), mu);
            add_neighbour(other, contact, 1.0 - mu, acc);
            join_shown(other, shown);
        }
        if (evaluation == 0)
            shift = offset - (1.0 - calibration_b.x) * (weight * df.x + offset - T);
        vec2 self = vec2(weight * df.x + shift, weight * df.y);
        bool forces = false;
        for (int k = mine.x; k < mine.y; k++) {
            Pair pair = pair_of(at, k);
            if (pair.rule == FORCE) {
                self = force(pair.effect, at.parameters, pair.parameters, p, n, s, self);
                forces = true;
                continue;
            }
            vec2 field = group_field(at, pair.first, pair.last, p, n, s);
            if (pair.rule != COLLIDES)
                join_shown(field, shown);  // the same skin
            if (pair.rule == NEIGHBOUR)
                add_neighbour(field, contact, pair.share, acc);
            else if (pair.rule == COLLIDES) {
                if (pair.effect == FADING)
                    fading(number(at.parameters, pair.parameters), field, contact, pair.q, pair.ye, acc);
                else if (pair.effect == PULLED)
                    pulled(at.parameters, pair.parameters, p, n, s, field, contact, pair.q, pair.ye, acc);
                else if (pair.q < 0.0)
                    add_rigid(field, pair.ye, acc);
                else
                    add_soft(field, contact, pair.q, pair.ye, acc);
            }
        }
        if (forces)
            for (int k = mine.x; k < mine.y; k++) {
                Pair pair = pair_of(at, k);
                if (pair.rule == FORCE)
                    shown = force(pair.effect, at.parameters, pair.parameters, p, n, s, shown);
            }
        phi = total_field(self, shown, contact, acc);
        if (evaluation == MAX_EVALUATIONS - 1)
            break;

        float f = phi.x, g = phi.y;
        bool up = f > 0.0, far = abs(f) > TOLERANCE;
        bool outside = up ? s >= high : s <= low;
        ended = ended || (far && outside);
        open = far && !outside;
        if (!open)
            break;
        if (up)
            low = s;
        else
            high = s;
        // Newton, or from the second evaluation on the cubic s(F) through both with both slopes (Hermite).
        float rise = 1.0 / min(g, -SMALL);
        float step_ = g < 0.0 ? -f * rise : up ? limit : -limit;
        float h = last_f - f;
        float u = -f / (abs(h) > SMALL ? h : 1.0);
        float cubic = u * u * (3.0 - u - u) * (last_s - s) + h * u * (1.0 - u) * ((1.0 - u) * rise - u * last_rise);
        if (last_rise < 0.0 && abs(cubic - step_) <= 0.5 * abs(step_))
            step_ = cubic;
        step_ = clamp(step_, -limit, limit);
        float t = s + step_;
        last_s = s;
        last_f = f;
        last_rise = g < 0.0 ? rise : 0.0;
        // An end of the room may be tried once, while its sign is not known; after that, halve.
        known_low = known_low || up;
        known_high = known_high || !up;
        bool halve = (t <= low && known_low) || (t >= high && known_high);
        s = halve ? 0.5 * (low + high) : clamp(t, low, high);
        open = abs(f) > NEAR || abs(step_) > SHORT * limit;
        if (!open)
            break;
    }
    bool solved = abs(phi.x) <= 1.0 && !ended && !open && finite(p + n);
    vec3 to = p + s * n;
    bool moves = s != 0.0 && finite(to);
    if (moves)
        placed.xyz = to;
    placed.w = (moves ? 1.0 : 0.0) + (solved ? 0.0 : 2.0);
}

#ifdef DISPLACED
// The largest field of others where the vertex has come to lie (vistel.implicit.deformation.displace_kernels).
float pressed() {
    if (place.x < 0)
        return 0.0;
    Starts at = starts();
    ivec4 mine = words(at.blocks + 2 * place.x);
    float press = 0.0;
    if (words(at.blocks + 2 * place.x + 1).w != 0)
        for (int k = mine.x; k < mine.y; k++) {
            Pair pair = pair_of(at, k);
            if (pair.rule == COLLIDES && pair.effect != FADING) {
                float field = group_field(at, pair.first, pair.last, placed.xyz, normal.xyz, 0.0).x;
                press = max(press, (pair.q < 0.0 ? 1.0 : calibration_a.z) * field);
            }
        }
    return press;
}
#endif

void main() {
    solve();
#ifdef DISPLACED
    bool creased = displacement != 0.0 && !isnan(displacement) && !isinf(displacement);
    bool moves = laid != vec3(0.0) && finite(laid);
    if (!creased && !moves)
        return;
    if (creased) {
        float u = clamp((pressed() - (T - FLATTEN)) / FLATTEN, 0.0, 1.0);
        placed.xyz += displacement * (1.0 - u * u * (3.0 - 2.0 * u)) * normal.xyz;
    }
    if (moves)
        placed.xyz += laid;
    placed.w += mod(placed.w, 2.0) == 0.0 ? 1.0 : 0.0;
#endif
}
