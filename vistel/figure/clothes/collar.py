"""Collars of shirts and jackets: strips of their own that stand along a neckline and fall over it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.clothes.build import TRUNK, Build
from vistel.figure.clothes.cloth import Cloth
from vistel.figure.clothes.shell import of_skin, spread
from vistel.figure.clothes.strip import frames, laid
from vistel.geometry.smoothstep import smooth

_EVEN = 3
"""Rounds of evening bones' shares along a collar."""
_LIES = 0.006
"""How far off the cloth what lies on it is, at most [m]."""


@dataclass(frozen=True, eq=False)
class Line:
    """Places evenly along a rim. points, out, away: (N, 3), of which the last two are those of
    `vistel.figure.clothes.strip.frames`; weight: (N, BONES); limb: (N,)."""

    points: F64
    out: F64
    away: F64
    weight: F32
    limb: I32


def along(cloth: Cloth, ring: I32, gap: float, count: int, lowest: bool = False) -> Line:
    """Of a rim round the neck, from half of `gap` [m] beside the middle of the front, or its lowest place, right round to the other
    side of it."""
    at = cloth.points[ring]
    start = int(np.argmax(-at[:, 1] if lowest else at[:, 2] - 3.0 * np.abs(at[:, 0])))
    ring = np.roll(ring, -start)
    p = cloth.points[ring]
    out, away = frames(cloth, ring, 4)
    step = np.linalg.norm(np.diff(p, axis=0, append=p[:1]), axis=1)
    at = np.concatenate([[0.0], np.cumsum(step)])
    wanted = 0.5 * gap + np.arange(count) * ((float(at[-1]) - gap) / (count - 1))

    def read(values: F64) -> F64:
        closed = np.vstack([values, values[:1]])
        return np.column_stack([np.interp(wanted, at, closed[:, k]) for k in range(values.shape[1])])

    n, a = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (read(out), read(away)))
    nearest = np.minimum(np.searchsorted(at, wanted), len(ring)) % len(ring)
    return Line(read(p), n, a, read(cloth.weight[ring].astype(np.float64)).astype(np.float32), cloth.limb[ring[nearest]])


def shirt_collar(build: Build, line: Line, stand: float, fall: float, points: float, panel: str) -> Cloth:
    """Stands `stand` high and falls by `fall`, in front by `points` [m]."""
    count = len(line.points)
    front = np.abs(np.linspace(-1.0, 1.0, count)) ** 6
    drop = fall + (points - fall) * front
    # It opens to the front, so that the neck has room.
    lean = 0.004 * front
    edge = np.full(count, stand)
    profile = [
        (0.0030 + lean, edge - drop + 0.003), (0.0050 + lean, edge - drop), (0.0055 + lean, edge - 0.5 * drop),
        (0.0045 + lean, edge - 0.003), (0.0020 + lean, edge + 0.0015), (-0.0015 + lean, edge - 0.003), (-0.0015, 0.5 * edge),
        (-0.0020, 0.0 * edge - 0.006),
    ]  # fmt: skip
    return _of(build, line, profile, panel)


def _of(build: Build, line: Line, profile: Sequence[tuple[F64 | float, F64]], panel: str) -> Cloth:
    """A strip; profile: of each row how far out and how far away it lies [m]."""
    count = len(line.points)
    rows = np.array([line.points + np.broadcast_to(o, count)[:, None] * line.out + a[:, None] * line.away for o, a in profile])
    return laid(rows, panel, _of_neck(build, rows), np.tile(line.limb, (len(rows), 1)))


def _of_neck(build: Build, rows: F64) -> F32:
    """(K, N, BONES) bones' shares of rows round a neck, even along them: a neck that bends takes its collar along."""
    share = of_skin(build, rows, "neck", *TRUNK).astype(np.float64)
    for _ in range(_EVEN):
        ends = np.concatenate([share[:, :1], share, share[:, -1:]], axis=1)
        share = 0.25 * ends[:, :-2] + 0.5 * share + 0.25 * ends[:, 2:]
    return share.astype(np.float32)


def lapels(build: Build, cloth: Cloth, line: Line, panel: str) -> Cloth:
    """Lapels and collar in one, with a notch between them; `line` begins where they meet in front, lowest."""
    scale, count = build.scale, len(line.points)
    step = np.linalg.norm(np.diff(line.points, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(step)])
    from_apex = np.minimum(way, way[-1] - way)
    total = 0.5 * float(way[-1])
    notch = total - 0.165 * scale
    lapel = 0.082 * scale * np.clip(from_apex / notch, 0.0, 1.0) ** 0.75
    collar = scale * (0.050 - 0.004 * np.clip((from_apex - notch) / (total - notch), 0.0, 1.0))
    wide = np.where(from_apex < notch - 0.004, lapel, np.where(from_apex < notch + 0.008, 0.030 * scale, collar))
    stand = 0.020 * scale * np.clip((from_apex - 0.8 * notch) / (total - 0.8 * notch), 0.0, 1.0)
    flat = np.full(count, 0.004)
    profile = [
        (flat - 0.001, stand - wide + 0.002), (flat, stand - wide), (flat + 0.002, stand - 0.66 * wide),
        (flat + 0.003, stand - 0.33 * wide), (flat + 0.002, stand - 0.06 * wide), (flat - 0.003, stand + 0.001),
        (flat - 0.007, stand - 0.004), (flat - 0.008, 0.0 * stand - 0.012),
    ]  # fmt: skip
    rows = np.array([line.points + o[:, None] * line.out + a[:, None] * line.away for o, a in profile])
    # What lies on the cloth follows it, the more freely the farther it is from where it is turned over.
    normal = cloth.normals()
    for k, most in enumerate((0.03, 0.03, 0.015, 0.004)):
        near = spread(cloth.points, np.hstack([cloth.points, normal]), rows[k])
        n = near[:, 3:] / np.linalg.norm(near[:, 3:], axis=1, keepdims=True)
        short = profile[k][0] - ((rows[k] - near[:, :3]) * n).sum(axis=1)
        rows[k] += np.maximum(short, -most)[:, None] * n
    bones, limb, far = cloth.bones_at(rows.reshape(-1, 3))
    bones = bones.reshape(*rows.shape[:2], -1)
    # What stands up round the neck goes with it.
    free = smooth((far - _LIES) / _LIES).reshape(*rows.shape[:2], 1)
    bones = (bones + free * (_of_neck(build, rows) - bones)).astype(np.float32)
    return laid(rows, panel, bones, limb.reshape(rows.shape[:2]))
