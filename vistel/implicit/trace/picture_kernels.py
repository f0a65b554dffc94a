"""Pictures of one sum of spheres and sphylinders of one material: camera, march, lamps and shadows, packet by packet.

The general way (`light.Tracer`) keeps rays, hits and looks of a whole tile in memory between its steps; here all of them
stay in the rows of one packet. What is drawn is the same.
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.trace.march_kernels import FACTS, reach, solve, workspace
from vistel.implicit.trace.packet_kernels import F32, NEVER, RAYS, clip_to_ball, smallest
from vistel.jit.kernel_jit import fast, leaf
from vistel.jit.numbers import FOUR, HALF, ONE, ZERO
from vistel.jit.pointers import at, keep, pointer
from vistel.jit.wide import wide

SIDE = 8


@leaf
def camera_rows(rays, start, end, norm, place, view, x0, y0, dx, dy, depth, flat, columns, rows):
    """Rays through a block of SIDE x SIDE pixels. view: (9,) right, up, ahead; x0, y0: of the block's middle, in units of
    the view at 1 m; dx, dy: of one pixel; depth: of the base; flat: 1 for an orthographic view."""
    wide()
    rx, ry, rz, ux, uy, uz, ax, ay, az = (view[0], view[1], view[2], view[3], view[4], view[5], view[6], view[7], view[8])
    spread = ONE if flat else depth
    for i in range(RAYS):
        column, row = i & (SIDE - 1), i >> 3
        x, y = (F32(column) - F32(3.5)) * dx, (F32(row) - F32(3.5)) * dy
        inside = (column < columns) & (row < rows)
        rays[i] = spread * (x * rx + y * ux)
        rays[RAYS + i] = spread * (x * ry + y * uy)
        rays[2 * RAYS + i] = spread * (x * rz + y * uz)
        x, y = (ZERO, ZERO) if flat else (x + x0, y + y0)
        bx, by, bz = ax + x * rx + y * ux, ay + x * ry + y * uy, az + x * rz + y * uz
        length = math.sqrt(bx * bx + by * by + bz * bz)
        inverse = ONE / length
        rays[3 * RAYS + i], rays[4 * RAYS + i], rays[5 * RAYS + i] = bx * inverse, by * inverse, bz * inverse
        norm[i] = depth * length
        start[i] = -depth * length if inside else NEVER
        end[i] = F32(1e29) if inside else -NEVER


@leaf
def add_slope_sphere(points, fact, out):
    """Add the gradient of a sphere's field at points (3 rows) to out (3 rows)."""
    wide()
    k, cx, cy, cz = fact[0], fact[5], fact[6], fact[7]
    wk = -FOUR * fact[1] * k
    for i in range(RAYS):
        x, y, z = points[i] - cx, points[RAYS + i] - cy, points[2 * RAYS + i] - cz
        s = wk * max(ONE - k * (x * x + y * y + z * z), ZERO)
        out[i] += s * x
        out[RAYS + i] += s * y
        out[2 * RAYS + i] += s * z


@leaf
def add_slope_capsule(points, fact, out):
    """The same of a sphylinder."""
    wide()
    k, cx, cy, cz, ux, uy, uz = fact[0], fact[5], fact[6], fact[7], fact[8], fact[9], fact[10]
    wk, length = -FOUR * fact[1] * k, fact[2]
    for i in range(RAYS):
        x, y, z = points[i] - cx, points[RAYS + i] - cy, points[2 * RAYS + i] - cz
        s = min(max(x * ux + y * uy + z * uz, ZERO), length)
        x, y, z = x - s * ux, y - s * uy, z - s * uz
        s = wk * max(ONE - k * (x * x + y * y + z * z), ZERO)
        out[i] += s * x
        out[RAYS + i] += s * y
        out[2 * RAYS + i] += s * z


@leaf
def walk(rays, time, points):
    """Points at distances `time`."""
    wide()
    for i in range(RAYS):
        t = time[i]
        points[i] = rays[i] + t * rays[3 * RAYS + i]
        points[RAYS + i] = rays[RAYS + i] + t * rays[4 * RAYS + i]
        points[2 * RAYS + i] = rays[2 * RAYS + i] + t * rays[5 * RAYS + i]


@leaf
def turn(rays, slope, size, lift):
    """Gradients (3 rows) become unit normals towards where the rays came from; size: see `looks.Look.lift`."""
    wide()
    for i in range(RAYS):
        gx, gy, gz = slope[i], slope[RAYS + i], slope[2 * RAYS + i]
        length = math.sqrt(gx * gx + gy * gy + gz * gz)
        inverse = ONE / max(length, F32(1e-20))
        facing = gx * rays[3 * RAYS + i] + gy * rays[4 * RAYS + i] + gz * rays[5 * RAYS + i]
        s = -inverse if facing > ZERO else inverse
        slope[i], slope[RAYS + i], slope[2 * RAYS + i] = gx * s, gy * s, gz * s
        lift[i] = min(F32(1e-3) * inverse, F32(1e-3) * size)


@leaf
def lamp_rows(rays, points, normals, lift, hit, lamp, place, out, start, end, facing, shine):
    """Rays from lifted points to a lamp (kind, position or direction relative to the base), as far as it is; facing:
    N.L, 0 where the lamp is behind; shine: N.H."""
    wide()
    kind, lx, ly, lz = lamp[0], place[0], place[1], place[2]
    for i in range(RAYS):
        px, py, pz = points[i], points[RAYS + i], points[2 * RAYS + i]
        nx, ny, nz = normals[i], normals[RAYS + i], normals[2 * RAYS + i]
        x = lx - px if kind > HALF else lx
        y = ly - py if kind > HALF else ly
        z = lz - pz if kind > HALF else lz
        far = math.sqrt(x * x + y * y + z * z)
        inverse = ONE / far
        x, y, z = x * inverse, y * inverse, z * inverse
        n = nx * x + ny * y + nz * z
        lit = (n > ZERO) & (hit[i] > HALF)
        facing[i] = n if lit else ZERO
        hx, hy, hz = x - rays[3 * RAYS + i], y - rays[4 * RAYS + i], z - rays[5 * RAYS + i]
        shine[i] = max((nx * hx + ny * hy + nz * hz) / math.sqrt(hx * hx + hy * hy + hz * hz), ZERO)
        s = lift[i]
        out[i], out[RAYS + i], out[2 * RAYS + i] = px + s * nx, py + s * ny, pz + s * nz
        out[3 * RAYS + i], out[4 * RAYS + i], out[5 * RAYS + i] = x, y, z
        start[i] = ZERO if lit else NEVER
        end[i] = -NEVER if not lit else (far if kind > HALF else F32(1e29))


@leaf
def raise_rows(row, spare, exponent):
    """Numbers in 0..1 to a whole power, by squaring."""
    wide()
    for i in range(RAYS):
        spare[i] = ONE
    left = exponent
    while left > 0:
        if left & 1:
            for i in range(RAYS):
                spare[i] *= row[i]
        for i in range(RAYS):
            row[i] *= row[i]
        left >>= 1
    for i in range(RAYS):
        row[i] = spare[i]


@leaf
def add_light(facing, shine, given, diffuse, specular):
    """given (2 rows): the parts of a lamp's light that a surface gives back in its own colour and in the lamp's."""
    wide()
    for i in range(RAYS):
        lit = facing[i] > ZERO
        given[i] = diffuse * facing[i]
        given[RAYS + i] = specular * shine[i] if lit else ZERO


@fast
def draw(P, origin, centre, radius, eye, view, step, flat, threshold, colour, finish, lamps, shadows, box, light, distance, thing):
    """Draw the pixels of box (x0, y0, x1, y1) into light (h, w, 3), distance and thing (h, w).

    view: (3, 3) right, up, ahead; step: (2,) of a pixel at 1 m; finish: (5,); lamps: (m, 8) kind (1 a lamp, 0 parallel),
    position or direction, colour, casts shadows.
    """
    work, dark = workspace(P.leaf.shape[0]), workspace(P.leaf.shape[0])
    rays, start, shift = pointer(work.rays), pointer(work.span), pointer(work.shift)
    rays2, start2, shift2 = pointer(dark.rays), pointer(dark.span), pointer(dark.shift)
    rows_ = np.zeros(16 * RAYS, np.float32)
    norm = pointer(rows_)
    time, hit, points, slope, lift, facing, shine, given, spare = (
        at(norm, RAYS),
        at(norm, 2 * RAYS),
        at(norm, 3 * RAYS),
        at(norm, 6 * RAYS),
        at(norm, 9 * RAYS),
        at(norm, 10 * RAYS),
        at(norm, 11 * RAYS),
        at(norm, 12 * RAYS),
        at(norm, 14 * RAYS),
    )
    view_, place_, lamp_ = np.empty(9, np.float32), np.empty(3, np.float32), np.empty(8, np.float32)
    hits, found, hits2, found2 = np.empty((RAYS, 1)), np.zeros(RAYS, np.int64), np.empty((RAYS, 1)), np.zeros(RAYS, np.int64)
    for k in range(9):
        view_[k] = F32(view[k // 3, k % 3])
    height, width = light.shape[0], light.shape[1]
    depth = 0.0
    for k in range(3):
        depth += (centre[k] - eye[k]) * view[2, k]
    depth = max(depth, 0.1 * radius)
    place, size = work.place, F32(radius * 1.1547)
    whole = int(finish[3]) if finish[3] == math.floor(finish[3]) and finish[3] < 4096 else 0
    for top in range(box[1], box[3], SIDE):
        for left in range(box[0], box[2], SIDE):
            x = (left + HALF * SIDE - HALF * width) * step[0]
            y = (HALF * height - top - HALF * SIDE) * step[1]
            for k in range(3):
                across = x * view[0, k] + y * view[1, k]
                place[k] = eye[k] + (across + depth * view[2, k] if flat else depth * (across + view[2, k]))
                shift[k] = F32(origin[k] - place[k])
                shift2[k] = shift[k]
                place_[k] = F32(centre[k] - place[k])
            columns, rows = min(SIDE, box[2] - left), min(SIDE, box[3] - top)
            camera_rows(
                rays,
                start,
                at(start, RAYS),
                norm,
                pointer(place_),
                pointer(view_),
                F32(x),
                F32(y),
                F32(step[0]),
                F32(-step[1]),
                F32(depth),
                flat,
                columns,
                rows,
            )
            clip_to_ball(rays, place_[0], place_[1], place_[2], F32(radius), start, at(start, RAYS))
            if smallest(start) >= NEVER:
                continue
            kept = reach(P, work)
            if kept == 0:
                continue
            for i in range(RAYS):
                found[i] = 0
            solve(work, kept, RAYS, 0.0, F32(threshold), hits, found, 0)
            some = 0
            for i in range(RAYS):
                hit[i] = F32(found[i])
                time[i] = F32(hits[i, 0]) if found[i] > 0 else ZERO
                some += found[i]
            if some == 0:
                continue
            walk(rays, time, points)
            for i in range(3 * RAYS):
                slope[i] = ZERO
            facts = pointer(work.facts)
            for c in range(kept):
                fact = at(facts, c * FACTS)
                if fact[2] < ZERO:
                    add_slope_sphere(points, fact, slope)
                else:
                    add_slope_capsule(points, fact, slope)
            turn(rays, slope, size, lift)
            for i in range(RAYS):
                if found[i] > 0:
                    u, v = left + (i & 7), top + (i >> 3)
                    thing[v, u] = 1
                    distance[v, u] = norm[i] + time[i]
                    for k in range(3):
                        light[v, u, k] = F32(finish[0] * colour[k])
            for m in range(lamps.shape[0]):
                for k in range(8):
                    lamp_[k] = F32(lamps[m, k])
                for k in range(3):
                    place_[k] = F32(lamps[m, 1 + k] - place[k]) if lamps[m, 0] > 0.5 else F32(lamps[m, 1 + k])
                lamp_rows(
                    rays, points, slope, lift, hit, pointer(lamp_), pointer(place_), rays2, start2, at(start2, RAYS), facing, shine
                )
                if shadows and lamps[m, 7] > 0.5:
                    for k in range(3):
                        place_[k] = F32(centre[k] - place[k])
                    clip_to_ball(rays2, place_[0], place_[1], place_[2], F32(radius), start2, at(start2, RAYS))
                    if smallest(start2) < NEVER:
                        kept2 = reach(P, dark)
                        for i in range(RAYS):
                            found2[i] = 0
                        if kept2 > 0:
                            solve(dark, kept2, RAYS, 0.0, F32(threshold), hits2, found2, 0)
                            for i in range(RAYS):
                                if found2[i] > 0:
                                    facing[i] = ZERO
                if whole > 0:
                    raise_rows(shine, spare, whole)
                else:
                    for i in range(RAYS):
                        shine[i] = shine[i] ** F32(finish[3]) if facing[i] > ZERO else ZERO
                add_light(facing, shine, given, F32(finish[1]), F32(finish[2]))
                for i in range(RAYS):
                    if facing[i] > ZERO:
                        u, v = left + (i & 7), top + (i >> 3)
                        for k in range(3):
                            light[v, u, k] += (given[i] * F32(colour[k]) + given[RAYS + i]) * lamp_[4 + k]
    keep(work, dark, rows_, view_, place_, lamp_)
