"""Light that surfaces give back, sixteen pixels at once: ambient, diffuse and specular parts (Blinn's half vector)."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.scanline.along_kernels import LARGE, F, scan_inner
from vistel.implicit.scanline.eye_kernels import DX, DY, OX, OY, OZ, PERSPECTIVE, X0, Y0
from vistel.implicit.scanline.lanes_kernels import WIDTH, exponent, load, mantissa, power_of_two, spread, store_bytes, store_three
from vistel.implicit.scanline.sweep_kernels import kernel
from vistel.jit.lanes import bits, choose, inverse_root, most, store, whole
from vistel.jit.numbers import ONE, ZERO
from vistel.jit.pointers import at, keep, pointer

COLOUR = 0
"""First of three planes."""
AMBIENT = 3
DIFFUSE = 4
SPECULAR = 5
SHININESS = 6
LOOKS = 7
"""Planes of a look: colour, then the parts of `finish` that are used here."""
LAMP_WORDS = 7
"""Numbers of a lamp: position from the program's origin or unit direction, in eye space; 1 for parallel light; colour."""


def _fitted(function: object, degree: int, low: float, high: float) -> tuple[np.float32, ...]:
    """Coefficients, highest first, of the polynomial through `function` at the Chebyshev points."""
    found = np.polynomial.Chebyshev.interpolate(function, degree, domain=[low, high]).convert(kind=np.polynomial.Polynomial)  # type: ignore[arg-type]
    return tuple(np.float32(c) for c in found.coef[::-1])


_ROOT2 = F(2.0**0.5)
_LOG2 = _fitted(lambda t: np.log2(1 + t) / t, 9, 2.0**-0.5 - 1, 2.0**0.5 - 1)
"""log2(1 + t) / t: small numbers without cancellation where the logarithm is, at highlights."""
_EXP2 = _fitted(np.exp2, 6, 0.0, 1.0)


@scan_inner
def power(base, n):
    """base^n of lanes 0 <= base; absolute error below 1e-6 for base up to 1 and n up to some hundreds."""
    x = most(base, F(1e-30))
    m, whole_part = mantissa(x), exponent(x)
    upper = m > _ROOT2
    t = choose(upper, F(0.5) * m, m) - ONE
    log = spread(_LOG2[0])
    for k in range(1, 10):
        log = log * t + _LOG2[k]
    y = most((log * t + choose(upper, whole_part + ONE, whole_part)) * n, F(-126.0))
    floor = whole(y)
    f = y - floor
    out = spread(_EXP2[0])
    for k in range(1, 7):
        out = out * f + _EXP2[k]
    return choose(y > F(-125.0), out * power_of_two(floor), ZERO)


@scan_inner
def _dot(ax, ay, az, bx, by, bz):
    return ax * bx + ay * by + az * bz


@scan_inner
def _unload(light, far, thing, y, first, tail_light, tail_far, tail_thing):
    """The part of the last group that is in the picture."""
    for x in range(first, light.shape[1]):
        k = x - first
        far[y, x], thing[y, x] = tail_far[k], tail_thing[k]
        for c in range(3):
            light[y, x, c] = tail_light[3 * k + c]


@kernel
def shade(depth_, normal_, look_, uniform, view, lamps, background, dirty, light_, far_, thing_):
    """Light (height, width, 3), depth from the eye (height, width) and 1 for a surface, of the dirty groups.

    depth, normal: see `sweep`, the normal of any length and side; look: (LOOKS, height, columns), or (LOOKS, 1, 1) where
    `uniform`; lamps: (m, LAMP_WORDS) float32; background: (3,) float32.
    """
    width = light_.shape[1]
    height, groups = dirty.shape
    columns = groups * WIDTH
    plane = height * columns
    depth, normal, look = pointer(depth_), pointer(normal_), pointer(look_)
    all_light, all_far, all_thing = pointer(light_), pointer(far_), pointer(thing_)
    tail_light, tail_far, tail_thing = np.empty(3 * WIDTH, np.float32), np.empty(WIDTH, np.float32), np.empty(WIDTH, np.int8)
    lanes_ = np.empty(2 * columns, np.float32)
    perspective = view[PERSPECTIVE] != 0.0
    for c in range(columns):
        x = view[X0] + c * view[DX]
        lanes_[c] = F(x * view[OZ] - view[OX]) if perspective else F(x - view[OX])
        lanes_[columns + c] = F(x) if perspective else ZERO
    lanes = pointer(lanes_)
    br, bg, bb = spread(background[0]), spread(background[1]), spread(background[2])
    for y in range(height):
        ey64 = view[Y0] + y * view[DY]
        ay = F(ey64 * view[OZ] - view[OY]) if perspective else F(ey64 - view[OY])
        ey = F(ey64) if perspective else ZERO
        for g in range(groups):
            if not dirty[y, g]:
                continue
            here, to = y * columns + g * WIDTH, y * width + g * WIDTH
            whole_ = (g + 1) * WIDTH <= width
            light, far, thing = at(all_light, 3 * to), at(all_far, to), at(all_thing, to)
            if not whole_:
                light, far, thing = pointer(tail_light), pointer(tail_far), pointer(tail_thing)
            s = load(at(depth, here + 2 * columns))
            seen = s < LARGE
            store_bytes(thing, 0, seen)
            store(far, choose(seen, s + F(view[OZ]), F(np.inf)))
            if bits(seen) == 0:
                store_three(light, 0, br, bg, bb)
                if not whole_:
                    _unload(light_, far_, thing_, y, g * WIDTH, tail_light, tail_far, tail_thing)
                continue
            s = choose(seen, s, ZERO)
            ax, ex = load(at(lanes, g * WIDTH)), load(at(lanes, columns + g * WIDTH))
            px, py, pz = ax + s * ex, ay + s * ey, s
            over = inverse_root(ex * ex + (ey * ey + ONE))
            vx, vy, vz = ex * over, ey * over, over
            nx, ny, nz = load(at(normal, here)), load(at(normal, plane + here)), load(at(normal, 2 * plane + here))
            over = inverse_root(most(_dot(nx, ny, nz, nx, ny, nz), F(1e-30)))
            over = choose(_dot(nx, ny, nz, vx, vy, vz) > ZERO, -over, over)
            nx, ny, nz = nx * over, ny * over, nz * over
            if uniform:
                r, gr, b = spread(look[0]), spread(look[1]), spread(look[2])
                ambient, diffuse = spread(look[AMBIENT]), spread(look[DIFFUSE])
                specular, shininess = spread(look[SPECULAR]), spread(look[SHININESS])
            else:
                own = at(look, here)
                r, gr, b = load(own), load(at(own, plane)), load(at(own, 2 * plane))
                ambient, diffuse = load(at(own, AMBIENT * plane)), load(at(own, DIFFUSE * plane))
                specular, shininess = load(at(own, SPECULAR * plane)), load(at(own, SHININESS * plane))
            lr, lg, lb = ambient * r, ambient * gr, ambient * b
            shines = bits(specular > ZERO) != 0
            for k in range(lamps.shape[0]):
                lamp = lamps[k]
                if lamp[3] != ZERO:
                    tx, ty, tz = spread(lamp[0]), spread(lamp[1]), spread(lamp[2])
                else:
                    tx, ty, tz = lamp[0] - px, lamp[1] - py, lamp[2] - pz
                    over = inverse_root(most(_dot(tx, ty, tz, tx, ty, tz), F(1e-30)))
                    tx, ty, tz = tx * over, ty * over, tz * over
                facing = _dot(nx, ny, nz, tx, ty, tz)
                lit = facing > ZERO
                if bits(lit) == 0:
                    continue
                given = choose(lit, diffuse * facing, ZERO)
                shine = spread(ZERO)
                if shines:
                    tx, ty, tz = tx - vx, ty - vy, tz - vz
                    half = _dot(nx, ny, nz, tx, ty, tz) * inverse_root(most(_dot(tx, ty, tz, tx, ty, tz), F(1e-30)))
                    shine = choose(lit, specular * power(most(half, ZERO), shininess), ZERO)
                lr = lr + (given * r + shine) * lamp[4]
                lg = lg + (given * gr + shine) * lamp[5]
                lb = lb + (given * b + shine) * lamp[6]
            store_three(light, 0, choose(seen, lr, br), choose(seen, lg, bg), choose(seen, lb, bb))
            if not whole_:
                _unload(light_, far_, thing_, y, g * WIDTH, tail_light, tail_far, tail_thing)
    keep(depth_, normal_, look_, light_, far_, thing_, lanes_, tail_light, tail_far, tail_thing)
