"""Triangles of a flat region with holes, without new vertices: ear clipping (Eberly 2002).

Every vertex of the rim is a corner of a triangle, also where the rim is straight, since the faces beside it use it too.
`mapbox_earcut` leaves such vertices out, which would leave cracks.
"""

import numpy as np

from vistel.arrays import F64

SLIVER = 1e-9


def triangulate(loops: list[list[int]], at: dict[int, tuple[float, float]]) -> list[tuple[int, int, int]]:
    """Triangles, counter-clockwise, of what lies left of directed loops of vertices; at: where each vertex is."""
    area = [_area([at[v] for v in loop]) for loop in loops]
    # A loop of next to no area is no hole, whichever way rounding turned it.
    outer = [k for k in range(len(loops)) if area[k] > -SLIVER]
    holes: dict[int, list[int]] = {k: [] for k in outer}
    for k in range(len(loops)):
        if k not in holes and outer:
            around = [o for o in outer if _holds([at[v] for v in loops[o]], at[loops[k][0]])]
            holes[min(around or outer, key=lambda o: area[o])].append(k)
    found: list[tuple[int, int, int]] = []
    for k in outer:
        ring = list(loops[k])
        for hole in sorted(holes[k], key=lambda h: -max(at[v][0] for v in loops[h])):
            ring = _bridged(ring, loops[hole], at)
        found += _clipped(ring, at)
    return found


def _area(points: list[tuple[float, float]]) -> float:
    return sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(points, points[1:] + points[:1], strict=True)) / 2


def _holds(ring: list[tuple[float, float]], p: tuple[float, float]) -> bool:
    inside = False
    for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
        if (a[1] > p[1]) != (b[1] > p[1]) and p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]):
            inside = not inside
    return inside


def _bridged(ring: list[int], hole: list[int], at: dict[int, tuple[float, float]]) -> list[int]:
    """The ring with a hole joined to it by the shortest bridge that crosses neither."""
    k = max(range(len(hole)), key=lambda i: at[hole[i]])
    start = np.array(at[hole[k]])
    points = np.array([at[v] for v in ring])
    sides = np.concatenate([_sides(ring, at), _sides(hole, at)])
    for i in np.argsort(((points - start) ** 2).sum(axis=1)):
        end = points[i]
        if not _opens(ring, int(i), at, start) or _meets(start, end, sides):
            continue
        return [*ring[: i + 1], *hole[k:], *hole[: k + 1], *ring[i:]]
    i = int(np.argmin(((points - start) ** 2).sum(axis=1)))
    return [*ring[: i + 1], *hole[k:], *hole[: k + 1], *ring[i:]]


def _sides(ring: list[int], at: dict[int, tuple[float, float]]) -> F64:
    points = np.array([at[v] for v in ring])
    return np.stack([points, np.roll(points, -1, axis=0)], axis=1)


def _opens(ring: list[int], i: int, at: dict[int, tuple[float, float]], p: F64) -> bool:
    """Whether a ring's inside lies towards p at its i-th vertex, which may occur more than once."""
    a, b, c = (np.array(at[ring[j % len(ring)]]) for j in (i - 1, i, i + 1))
    left, right = _turn(a, b, p) > 0, _turn(b, c, p) > 0
    return (left and right) if _turn(a, b, c) > 0 else (left or right)


def _turn(a: F64, b: F64, c: F64) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _meets(p: F64, q: F64, sides: F64) -> bool:
    """Whether p-q touches a side that does not end at p or q."""
    a, b = sides[:, 0], sides[:, 1]
    at_end = (a == p).all(1) | (a == q).all(1) | (b == p).all(1) | (b == q).all(1)
    d = q - p
    e = b - a
    side_a = d[0] * (a[:, 1] - p[1]) - d[1] * (a[:, 0] - p[0])
    side_b = d[0] * (b[:, 1] - p[1]) - d[1] * (b[:, 0] - p[0])
    side_p = e[:, 0] * (p[1] - a[:, 1]) - e[:, 1] * (p[0] - a[:, 0])
    side_q = e[:, 0] * (q[1] - a[:, 1]) - e[:, 1] * (q[0] - a[:, 0])
    return bool((~at_end & (side_a * side_b <= 0) & (side_p * side_q <= 0)).any())


def _clipped(ring: list[int], at: dict[int, tuple[float, float]]) -> list[tuple[int, int, int]]:
    rest = list(ring)
    x = np.array([at[v] for v in rest])
    least = 1e-12 * max(1e-30, float(np.ptp(x, axis=0).max()) ** 2)
    found: list[tuple[int, int, int]] = []
    k = missed = 0
    while len(rest) > 3:
        n = len(rest)
        i, j, m = (k - 1) % n, k % n, (k + 1) % n
        if missed > n:
            # Only flat corners are left: cut off the one that is least so.
            j = int(np.argmax([_turn(x[a - 1], x[a], x[(a + 1) % n]) for a in range(n)]))
            i, m = (j - 1) % n, (j + 1) % n
        elif not _ear(x, rest, i, j, m, least):
            k, missed = (k + 1) % n, missed + 1
            continue
        found.append((rest[i], rest[j], rest[m]))
        del rest[j]
        x = np.delete(x, j, axis=0)
        k, missed = (j + 1) % len(rest), 0  # on past the neighbour, for fatter triangles
    found.append((rest[0], rest[1], rest[2]))
    return found


def _ear(x: F64, rest: list[int], i: int, j: int, m: int, least: float) -> bool:
    a, b, c = x[i], x[j], x[m]
    if _turn(a, b, c) <= least:
        return False
    inside = np.ones(len(x), bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (q[0] - p[0]) * (x[:, 1] - p[1]) - (q[1] - p[1]) * (x[:, 0] - p[0]) >= -least
    corners = {rest[i], rest[j], rest[m]}
    return not any(rest[k] not in corners for k in np.flatnonzero(inside).tolist())
