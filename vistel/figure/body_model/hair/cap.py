"""The cap: the skin inside the hairline, lifted, over which cards lie; and thin shells over it."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.body_model.hair.cards import Strips
from vistel.figure.body_model.hair.scalp import Scalp
from vistel.geometry.smoothstep import smooth

EDGE = 0.05
"""How far a cap reaches beyond the hairline, as a share of the head's size."""
DEEP = 1.45
"""Farthest place inside the hairline, likewise."""
FINER = 0.6
"""Power that gives the hairline more texels than the top of the head."""


@dataclass(frozen=True)
class Cap:
    """How high it is over the skin, well inside the hairline, for a head of size 0.095 m: thick everywhere, crown more on top of
    the head, lumps more or less from place to place [m]."""

    thick: float
    crown: float = 0.0
    lumps: float = 0.0

    def height(self, scalp: Scalp, p: F64, inside: F64) -> F64:
        """(N,) over places (N, 3) of the skin or above it, which are `inside` (N,) [m] from the hairline [m]."""
        d = p - scalp.middle
        d /= np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-9)
        edge, far = (smooth(inside / (share * scalp.size)) for share in (0.35, 0.8))
        return (
            scalp.size / 0.095 * (self.thick * edge + far * (self.crown * smooth((d[:, 1] - 0.25) / 0.55) + self.lumps * _lumpy(d)))
        )


@dataclass(frozen=True, eq=False)
class Ground:
    """The skin inside the hairline. points, normal: (V, 3); triangles: (F, 3)."""

    points: F64
    normal: F64
    triangles: I32


def ground(scalp: Scalp, columns: int, rows: int) -> Ground:
    """As a net whose lowest row follows the hairline and whose meridians meet on top; rows are closer near the hairline."""
    azimuth, elevation = scalp.hairline(columns)
    top = 0.5 * np.pi
    up = np.linspace(0.0, 1.0, rows + 1)[:-1, None] ** 1.5
    low = elevation - EDGE
    e = np.append((low + up * (top - low)).reshape(-1), top)
    a = np.append(np.broadcast_to(azimuth, (rows, columns)).reshape(-1), 0.0)
    points, normal = scalp.traced(np.stack([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)], axis=-1))
    here, there = np.arange(columns, dtype=np.int32), np.roll(np.arange(columns, dtype=np.int32), -1)
    tri: list[I32] = []
    for r in range(rows - 1):
        p, q = np.int32(r * columns), np.int32((r + 1) * columns)
        tri += [np.stack([p + here, p + there, q + here], 1), np.stack([p + there, q + there, q + here], 1)]
    p = np.int32((rows - 1) * columns)
    tri.append(np.stack([p + here, p + there, np.full_like(here, rows * columns)], 1))
    return Ground(points, normal, np.concatenate(tri))


def cap(scalp: Scalp, skin: Ground, high: Cap, box: F64) -> Strips:
    """The skin inside the hairline, lifted. In its box of the picture v grows from the hairline, u round the whorl, alike on both
    sides."""
    h = scalp.inside(skin.points)
    d = skin.points - scalp.middle
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    p = skin.points + (0.0007 + high.height(scalp, skin.points, h))[:, None] * skin.normal
    # The polar angle about the whorl: no seam, as both sides have the same.
    ahead = np.array((0.0, 0.0, 1.0)) - scalp.whorl[2] * scalp.whorl
    # Strands would be smeared over triangles that the sides' common line crosses: it goes through a vertex of the forehead.
    ahead = d[np.argmax(d @ ahead)]
    ahead = ahead - (ahead @ scalp.whorl) * scalp.whorl
    ahead /= np.linalg.norm(ahead)
    angle = np.abs(np.arctan2(d @ np.cross(scalp.whorl, ahead), d @ ahead)) / np.pi
    v = np.clip((h / scalp.size + EDGE) / (DEEP + EDGE), 0.0, 1.0) ** FINER
    uv = box[:2] + np.column_stack([angle, v]) * (box[2:] - box[:2])
    return Strips(p, uv, skin.triangles)


def _lumpy(d: F64) -> F64:
    """(N,) about 0, at most 1: waves over directions (N, 3), the same for all levels of detail."""
    waves = ((7.1, 2.3, -4.4, 0.3), (-3.7, 8.9, 2.6, 1.9), (4.8, -5.2, 7.7, 4.1), (10.9, 6.1, 3.2, 2.7))
    return np.mean([np.sin(d @ w[:3] + w[3]) for w in waves], axis=0)
