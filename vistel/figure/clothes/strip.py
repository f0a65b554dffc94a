"""Strips of cloth along a rim: hems that are folded in, ribs, collars, cuffs, and skirts hung from the hips."""

from collections.abc import Sequence

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.clothes.cloth import Cloth
from vistel.figure.making.assembly.piece import closest

_WAVES = 8
_ASIDE = 5e-4
"""How far beside a rim's place on its panel the strip's is [m]."""
_PLACES: F64 = np.array([(i, k, 5 - i - k) for i in range(6) for k in range(6 - i)]) / 5.0
"""Where triangles of hems are looked at: shares of their corners."""
_SHALLOW = 0.2
"""So near its rim, as a share of its depth, a hem is taken to be as deep as this: it cannot be moved there."""
_ROUNDS = 6
_AT_ONCE = 0.004
"""By how much a hem is moved inwards each time, at most [m]."""


def frames(cloth: Cloth, ring: I32, rounds: int = 5) -> tuple[F64, F64]:
    """(N, 3) unit vectors at a rim: out of the cloth's face, and away from the cloth along its face; even along the rim."""
    n, p = cloth.normals()[ring], cloth.points[ring]
    for _ in range(rounds):
        n = 0.5 * n + 0.25 * (np.roll(n, 1, axis=0) + np.roll(n, -1, axis=0))
    along = np.roll(p, -1, axis=0) - np.roll(p, 1, axis=0)
    away = np.cross(along, n)
    for _ in range(rounds):
        away = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        away = 0.5 * away + 0.25 * (np.roll(away, 1, axis=0) + np.roll(away, -1, axis=0))
    return tuple(v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-12) for v in (n, away))  # type: ignore[return-value]


def offsets(cloth: Cloth, ring: I32, steps: Sequence[tuple[float, float]]) -> F64:
    """(K, N, 3) rows of points along a rim; steps: how far out of the face and how far away from the cloth [m]."""
    out, away = frames(cloth, ring, 8)
    return np.array([even_ring(cloth.points[ring] + a * out + b * away, _WAVES) for a, b in steps])


def even_ring(p: F64, waves: int) -> F64:
    """A ring (N, 3) without what varies faster than so many times round it."""
    step = np.linalg.norm(np.diff(p, axis=0, append=p[:1]), axis=1)
    turn = 2.0 * np.pi * (np.cumsum(step) - step) / step.sum()
    k = np.arange(1, min(waves, (len(p) - 1) // 3) + 1)
    basis = np.column_stack([np.ones(len(p)), np.cos(turn[:, None] * k), np.sin(turn[:, None] * k)])
    return basis @ np.linalg.lstsq(basis, p, rcond=None)[0]


def with_strip(
    cloth: Cloth, ring: I32, rows: F64, panel: str = "", weight: F32 | None = None, limb: I32 | None = None
) -> tuple[Cloth, I32]:
    """The cloth with rows (K, N, 3) of points sewn to a rim (N,), and the new rim. panel: of the strip, on which its first side
    lies along the rim from 0; "": it has the colour of the rim. weight: (K, N, BONES) and limb (K, N), by default as the rim
    has."""
    count, first = len(ring), len(cloth.points)
    number = np.vstack([ring, first + np.arange(len(rows) * count).reshape(len(rows), count)]).astype(np.int32)
    triangles = _bands(number)
    names = (*cloth.panels, panel) if panel and panel not in cloth.panels else cloth.panels
    if panel:
        own, flat = np.full(count, names.index(panel), np.int32), _unrolled(cloth.points[ring], rows)
    else:
        own, flat = _continued(cloth, ring, len(rows))
    times = 2 * len(rows)
    cloth.rim[ring] = True
    made = Cloth(
        np.vstack([cloth.points, rows.reshape(-1, 3)]),
        np.concatenate([cloth.triangles, triangles]).astype(np.int32),
        np.vstack(
            [
                cloth.weight,
                np.tile(cloth.weight[ring], (len(rows), 1)) if weight is None else weight.reshape(-1, cloth.weight.shape[1]),
            ]
        ),
        np.concatenate([cloth.limb, np.tile(cloth.limb[ring], len(rows)) if limb is None else limb.ravel()]),
        np.concatenate([cloth.panel, np.tile(own, times)]).astype(np.int32),
        np.concatenate([cloth.flat, flat]),
        np.concatenate([cloth.rim, np.ones(len(rows) * count, np.bool_)]),
        names,
    )
    return made, number[-1]


def hem(cloth: Cloth, ring: I32, thick: float, deep: float, edge: bool = True) -> Cloth:
    """What is folded in at a rim: an edge as thick as the cloth, and a hem inside [m], which nowhere comes out of the cloth. It is
    a piece of its own, or the light on the cloth would turn with its edge. edge: without it the hem alone, where nobody looks at it
    from near by."""
    cloth.rim[ring] = True
    out, away = frames(cloth, ring)
    p, count = cloth.points[ring], len(ring)
    folded = [p - 0.7 * thick * out + 0.3 * thick * away] if edge else []
    rows = np.array([p, *folded, _within(cloth, p, p - 1.7 * thick * out - deep * away, -out, thick)])
    own, flat = _continued(cloth, ring, len(rows) - 1)
    return Cloth(
        rows.reshape(-1, 3),
        _bands(np.arange(len(rows) * count, dtype=np.int32).reshape(-1, count)),
        np.vstack([np.tile(cloth.weight[ring], (len(rows) - 1, 1)), cloth.bones_at(rows[-1])[0]]),
        np.tile(cloth.limb[ring], len(rows)),
        np.tile(own, 2 * (len(rows) - 1)),
        flat,
        np.ones(len(rows) * count, np.bool_),
        cloth.panels,
    )


def _within(cloth: Cloth, rim: F64, inner: F64, inwards: F64, thick: float) -> F64:
    """(N, 3) the inner edge of a hem, moved inwards (N, 3) until what lies between it and its rim (N, 3) is inside the cloth: its
    triangles are larger than those of the rim, and cut into what is round."""
    count, cover = len(rim), cloth.points[cloth.triangles]
    face = np.cross(cover[:, 1] - cover[:, 0], cover[:, 2] - cover[:, 0])
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-12)
    corners = _bands(np.arange(2 * count, dtype=np.int32).reshape(2, count))
    deep = (_PLACES @ (corners >= count).T).T
    out = inner.copy()
    for _ in range(_ROUNDS):
        places = np.einsum("kc,fcx->fkx", _PLACES, np.vstack([rim, out])[corners]).reshape(-1, 3)
        on, share, _ = closest(places, cover)
        high = ((places - np.einsum("nk,nkc->nc", share, cover[on])) * face[on]).sum(axis=1).reshape(deep.shape)
        short = np.max(np.maximum(0.0, high + deep * thick) / np.maximum(deep, _SHALLOW), axis=1)
        if not short.any():
            break
        by = np.zeros(2 * count)
        np.maximum.at(by, corners.ravel(), np.repeat(short, 3))
        # Evenly, or the edge would have teeth.
        wide = np.max([np.roll(by[count:], k) for k in (-1, 0, 1)], axis=0)
        out += np.minimum(0.5 * (by[count:] + wide), _AT_ONCE)[:, None] * inwards
    return out


def _bands(number: I32) -> I32:
    """(F, 3) triangles between rows (K, N) of vertices that are rings."""
    following = np.roll(number, -1, axis=1)
    a, b, c, d = number[:-1], number[1:], following[1:], following[:-1]
    both = [np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)]
    return np.concatenate(both).astype(np.int32)


def _continued(cloth: Cloth, ring: I32, rows: int) -> tuple[I32, F64]:
    """(N,) panel beside each edge of a rim, and (F, 3, 2) places of a strip's triangles that all lie on the rim."""
    start, end, count = cloth.triangles.ravel(), np.roll(cloth.triangles, -1, axis=1).ravel(), len(cloth.points)
    edge = start.astype(np.int64) * count + end
    order = np.argsort(edge)
    place = order[np.searchsorted(edge[order], ring.astype(np.int64) * count + np.roll(ring, -1))]
    face, k = np.divmod(place, 3)
    here, following = cloth.flat[face, k], cloth.flat[face, (k + 1) % 3]
    # A seam along the rim: coarser levels keep the lines of seams.
    here, following = here + _ASIDE, following + _ASIDE
    one = np.concatenate(
        [np.tile(np.stack(c, axis=1), (rows, 1, 1)) for c in ((here, here, following), (here, following, following))]
    )
    return cloth.panel[face], one


def _unrolled(rim: F64, rows: F64) -> F64:
    """(F, 3, 2) places of a strip's triangles on a panel of its own."""
    count, p = len(rim), np.concatenate([rim[None], rows])
    round_it = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p[0], axis=0, append=p[0][:1]), axis=1))])
    up = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=2).mean(axis=1))])
    u, v = np.meshgrid(round_it, -up)
    grid = np.stack([u, v], axis=-1)
    a, b, c, d = grid[:-1, :count], grid[1:, :count], grid[1:, 1:], grid[:-1, 1:]
    return np.concatenate([np.stack([a, b, c], axis=2).reshape(-1, 3, 2), np.stack([a, c, d], axis=2).reshape(-1, 3, 2)])


def rolled(rows: F64, panels: Sequence[str], weight: F32, limb: I32) -> Cloth:
    """Cloth of rows (K, N, 3) of points that are rings, the first one on top, clockwise seen from above. panels: (K - 1) of each
    band between two of them. weight: (K, N, BONES); limb: (K, N)."""
    count = rows.shape[1]
    number = np.arange(rows.shape[0] * count, dtype=np.int32).reshape(-1, count)
    triangles = _bands(number)
    names = tuple(dict.fromkeys(panels))
    own = np.tile(np.repeat([names.index(p) for p in panels], count), 2).astype(np.int32)
    flat = _unrolled(rows[0], rows[1:])
    return Cloth(*_of(rows, triangles, weight, limb), own, flat, np.zeros(rows.size // 3, np.bool_), names)


def laid(rows: F64, panel: str, weight: F32, limb: I32) -> Cloth:
    """Cloth of rows (K, N, 3) of points that are no rings, the first row lowest, going to the right seen from outside. weight:
    (K, N, BONES); limb: (K, N)."""
    count = rows.shape[1]
    number = np.arange(rows.shape[0] * count, dtype=np.int32).reshape(-1, count)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)])
    u = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rows.mean(axis=0), axis=0), axis=1))])
    v = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rows, axis=0), axis=2).mean(axis=1))])
    flat = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)[triangles]
    own = np.zeros(len(triangles), np.int32)
    return Cloth(*_of(rows, triangles, weight, limb), own, flat, np.zeros(rows.size // 3, np.bool_), (panel,))


def _of(rows: F64, triangles: I32, weight: F32, limb: I32) -> tuple[F64, I32, F32, I32]:
    """Points, triangles, weights and limbs of rows, as `Cloth` has them."""
    return rows.reshape(-1, 3), triangles.astype(np.int32), weight.reshape(-1, weight.shape[-1]), limb.ravel()
