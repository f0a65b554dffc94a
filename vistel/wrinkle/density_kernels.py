"""Offset density round wrinkles (Singh §5.2.2; mathematics M9.1), rasterised segment by segment.

The nearest point Q of a branch gives its intensity i_Q and radius r_Q, blended by the Hermite cubic between control points,
so that they are level at each of them. Beside the curve a layer adds i_Q f(|P - Q| / r); beyond an end that tapers,
i_Q f(d_x) f(d_y) with the intercepts X(y) = l h(|y| / r), Y(x) = r h(x / l), where h is the Hermite blend. Both agree, with
their first derivatives, where the cap begins (mathematics M9.2): Y(0) = r, Y'(0) = 0 and i_Q is level there.
Of the branches of one wrinkle the highest counts, and the deepest.
"""

# pyright: basic

import math

import numpy as np

from vistel.geometry.smoothstep_kernels import ease
from vistel.jit.kernel_jit import fast, fast_inner

FAR = np.float32(1e30)


@fast_inner
def quartic(x):
    """f(x) = (1 - x^2)^2 on [0, 1], then 0."""
    u = x * x
    return (1.0 - u) * (1.0 - u) if u < 1.0 else 0.0


@fast
def hermite(x):
    """h(x) = 1 - 3 x^2 + 2 x^3 on [0, 1], then 0."""
    return 1.0 - ease(x) if x < 1.0 else 0.0


@fast
def cross_section(layers, y, x, cap):
    """Sum of a profile's layers at y [radii, left of the curve] and x [radii, beyond an end; 0 beside the curve]. cap:
    length [radii] of a tapering end, 0 for a half disc, where y is the distance from the end."""
    total = 0.0
    for k in range(len(layers)):
        off = y - layers[k, 1]
        width = layers[k, 2] * (1.0 + layers[k, 3] if off > 0.0 else 1.0 - layers[k, 3])
        off = abs(off)
        if off >= width:
            continue
        if x <= 0.0 or cap <= 0.0:
            total += layers[k, 0] * quartic(off / width)
            continue
        along, across = cap * hermite(off / width), width * hermite(x / cap)
        if x < along and off < across:
            total += layers[k, 0] * quartic(x / along) * quartic(off / across)
    return total


@fast
def bend(line, k):
    """Tangent of half the angle between segment k and the next, at most 4."""
    ax, ay = line[k, 2] - line[k, 0], line[k, 3] - line[k, 1]
    bx, by = line[k + 1, 2] - line[k + 1, 0], line[k + 1, 3] - line[k + 1, 1]
    across, along = abs(ax * by - ay * bx), ax * bx + ay * by
    return min(4.0, math.tan(0.5 * math.atan2(across, along)))


@fast
def within(at, rate, low, high):
    """The x between which low <= at + rate x <= high."""
    if abs(rate) < 1e-12:
        return (-1e30, 1e30) if low <= at <= high else (1e30, -1e30)
    a, b = (low - at) / rate, (high - at) / rate
    return min(a, b), max(a, b)


@fast
def lay(out, step, line, span, values, first, cap, layers, reach, wraps):
    """Add one wrinkle to a map. out: (H, W) heights, first row at the top, in place; step: size of a texel [m]; the rest
    as `vistel.wrinkle.instance.Strokes`. wraps: whether the map's left and right edges are one line. The map's lower
    left corner is the plane's origin."""
    height, width = out.shape
    # The texels the wrinkle can reach; columns go on beyond the map where it wraps.
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for b in range(len(first) - 1):
        for k in range(first[b], first[b + 1]):
            grow = max(values[k, 2], values[k, 3]) * max(reach, cap[b, 0], cap[b, 1])
            low_x, high_x = min(low_x, min(line[k, 0], line[k, 2]) - grow), max(high_x, max(line[k, 0], line[k, 2]) + grow)
            low_y, high_y = min(low_y, min(line[k, 1], line[k, 3]) - grow), max(high_y, max(line[k, 1], line[k, 3]) + grow)
    c0, c1 = math.floor(low_x / step), math.ceil(high_x / step) + 1
    if not wraps:
        c0, c1 = max(c0, 0), min(c1, width)
    r0, r1 = max(0, height - 1 - math.ceil(high_y / step)), min(height, height - math.floor(low_y / step) + 1)
    if c1 <= c0 or r1 <= r0:
        return
    shape = (r1 - r0, c1 - c0)
    high, deep = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    near = np.full(shape, FAR, np.float32)
    # Of the nearest point so far: left distance and distance beyond the end [radii], intensity, length of the cap.
    left, beyond = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    strength, ends = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for b in range(len(first) - 1):
        top, bottom, start, stop = shape[0], 0, shape[1], 0
        for k in range(first[b], first[b + 1]):
            x0, y0 = line[k, 0], line[k, 1]
            dx, dy = line[k, 2] - x0, line[k, 3] - y0
            length = math.sqrt(dx * dx + dy * dy)
            if length <= 0.0:
                continue
            dx, dy = dx / length, dy / length
            opens, closes = k == first[b], k == first[b + 1] - 1
            radius = max(values[k, 2], values[k, 3])
            side = reach * radius
            # The strip of texels that may have their nearest point here: beyond the segment's ends lie the wedges on the
            # outside of a bend, half of each, and at the ends of the branch its caps.
            before = radius * max(reach, cap[b, 0]) if opens else side * bend(line, k - 1) + 2.0 * step
            behind = radius * max(reach, cap[b, 1]) if closes else side * bend(line, k) + 2.0 * step
            i0, i1, j0, j1 = r1, r0, c1, c0
            for along in (-before, length + behind):
                for across in (-side, side):
                    x, y = x0 + along * dx - across * dy, y0 + along * dy + across * dx
                    i0, i1 = min(i0, height - 1 - math.ceil(y / step)), max(i1, height - math.floor(y / step) + 1)
                    j0, j1 = min(j0, math.floor(x / step)), max(j1, math.ceil(x / step) + 1)
            i0, i1, j0, j1 = max(i0, r0), min(i1, r1), max(j0, c0), min(j1, c1)
            top, bottom, start, stop = min(top, i0 - r0), max(bottom, i1 - r0), min(start, j0 - c0), max(stop, j1 - c0)
            for i in range(i0, i1):
                py = (height - i - 0.5) * step - y0
                a, e = within(py * dy, dx, -before, length + behind)
                c, d = within(py * dx, -dy, -side, side)
                a, e = (max(a, c) + x0) / step - 0.5, (min(e, d) + x0) / step - 0.5
                for j in range(math.floor(min(max(a, j0), j1)), min(math.ceil(max(min(e, j1), j0 - 1)) + 1, j1)):
                    px = (j + 0.5) * step - x0
                    u, v = px * dx + py * dy, py * dx - px * dy
                    out_by = 0.0
                    if u < 0.0:
                        out_by, u = -u, 0.0
                    elif u > length:
                        out_by, u = u - length, length
                    away = math.sqrt(out_by * out_by + v * v)
                    if away >= near[i - r0, j - c0]:
                        continue
                    t = span[k, 0] + (span[k, 1] - span[k, 0]) * (u / length)
                    t = ease(t)
                    r = values[k, 2] + (values[k, 3] - values[k, 2]) * t
                    near[i - r0, j - c0] = away
                    strength[i - r0, j - c0] = values[k, 0] + (values[k, 1] - values[k, 0]) * t
                    capped = cap[b, 0] if opens and u == 0.0 else cap[b, 1] if closes and u == length else 0.0
                    ends[i - r0, j - c0] = capped
                    beyond[i - r0, j - c0] = out_by / r if capped > 0.0 else 0.0
                    left[i - r0, j - c0] = (v if capped > 0.0 else away if v >= 0.0 else -away) / r
        for i in range(top, bottom):
            for j in range(start, stop):
                if near[i, j] < FAR:
                    value = strength[i, j] * cross_section(layers, left[i, j], beyond[i, j], ends[i, j])
                    high[i, j], deep[i, j] = max(high[i, j], value), min(deep[i, j], value)
                    near[i, j] = FAR
    for i in range(shape[0]):
        for j in range(shape[1]):
            out[r0 + i, (c0 + j) % width] += high[i, j] + deep[i, j]
