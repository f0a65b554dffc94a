"""Strokes: what is written on a board, point by point on the grid of its face, as bytes that are the same everywhere.

The grid: x from the left edge of the face, y from its lower edge, as its front is seen, in units of which `ACROSS` make its
width and `UPWARDS` its height: 0.5 mm on a board that nobody has made larger or smaller.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vistel.arrays import I64

UNIT = 0.0005
"""Of the grid [m], on a board of its first size."""
ACROSS = 3600
"""Units of the grid in the width of a face."""
UPWARDS = 2400
"""Units of the grid in the height of a face."""
FURTHEST = 127
"""From one point of a stroke to the next along x or y, at most, in units: a step is two bytes. Longer ways get points between."""
MOST_POINTS = 200
"""Of a stroke. Who writes on begins the next one where it ends."""
MOST_NAME = 40
"""Letters of what its writer calls a stroke."""
WIDTHS = 2, 80
"""Of a stroke, in units: 1 mm to 4 cm."""
WIDTH = 12
"""Of a stroke that says none, in units."""
_BEGIN = 4
"""Bytes of the first point: x and y in two bytes each, the lower one first."""


@dataclass(frozen=True)
class Stroke:
    """number: its own among strokes, dents and bonds, later ones are higher; board: id of the thing; by: participant; id: what its
    writer calls it; colour: 0xRRGGBBFF; width: in units; ink: its points, see `packed`."""

    number: int
    board: str
    by: str
    id: str
    colour: int
    width: int
    ink: bytes

    @property
    def count(self) -> int:
        """Points."""
        return (len(self.ink) - _BEGIN) // 2 + 1

    @cached_property
    def points(self) -> I64:
        """(n, 2) on the grid."""
        return unpacked(self.ink)

    def grown(self, points: Sequence[tuple[int, int]]) -> "Stroke":
        """The stroke with more points."""
        x, y = self.points[-1].tolist()
        return replace(self, ink=self.ink + packed([(x, y), *points])[_BEGIN:])


def packed(points: Sequence[tuple[int, int]]) -> bytes:
    """Points (x, y) on the grid, one at least, as ink: x and y of the first one, two bytes each, low byte first, then the way to
    each further one, a signed byte each for x and y; points are put between those that are more than `FURTHEST` apart."""
    x, y = points[0]
    out = bytearray(x.to_bytes(2, "little") + y.to_bytes(2, "little"))
    for to_x, to_y in points[1:]:
        way_x, way_y = to_x - x, to_y - y
        parts = max(1, -(-max(abs(way_x), abs(way_y)) // FURTHEST))
        before = 0, 0
        for k in range(1, parts + 1):
            now = way_x * k // parts, way_y * k // parts
            out += bytes(((now[0] - before[0]) & 0xFF, (now[1] - before[1]) & 0xFF))
            before = now
        x, y = to_x, to_y
    return bytes(out)


def unpacked(ink: bytes) -> I64:
    """(n, 2) points on the grid of ink. Raises ValueError for bytes that are none, or leave the face."""
    if len(ink) < _BEGIN or len(ink) % 2:
        raise ValueError(f"ink of a stroke: expected {_BEGIN} bytes and two for each further point, got {len(ink)} bytes")
    begin = np.frombuffer(ink[:_BEGIN], "<u2").astype(np.int64)
    ways = np.frombuffer(ink[_BEGIN:], np.int8).astype(np.int64).reshape(-1, 2)
    points: I64 = np.concatenate([begin[None], begin + np.cumsum(ways, axis=0)])
    if points.min() < 0 or points[:, 0].max() > ACROSS or points[:, 1].max() > UPWARDS:
        raise ValueError("ink of a stroke: a point that is not on the face of a board")
    return points


def touches(stroke: Stroke, path: I64, width: int) -> bool:
    """Whether a path (n, 2) on the grid, `width` units wide, touches a stroke."""
    near = (width + stroke.width) // 2
    points = stroke.points
    if (points.max(axis=0) < path.min(axis=0) - near).any() or (points.min(axis=0) > path.max(axis=0) + near).any():
        return False
    return _near(path, points, near) or _near(points, path, near) or _cross(points, path)


def _near(places: I64, line: I64, near: int) -> bool:
    """Whether one of some places (n, 2) is within `near` of a line (m, 2)."""
    way = _ways(line)
    to = places[:, None, :] - line[None, :, :]
    length = np.maximum(1, (way * way).sum(axis=1))
    along = np.clip((to * way).sum(axis=2), 0, length) / length
    off = to - along[:, :, None] * way
    return bool(((off * off).sum(axis=2) <= near * near).any())


def _cross(line: I64, other: I64) -> bool:
    """Whether two lines (n, 2) and (m, 2) cross."""
    way, across = _ways(line)[:, None, :], _ways(other)[None, :, :]
    to = other[None, :, :] - line[:, None, :]
    turn = way[..., 0] * across[..., 1] - way[..., 1] * across[..., 0]
    along = (to[..., 0] * across[..., 1] - to[..., 1] * across[..., 0]) * np.sign(turn)
    aside = (to[..., 0] * way[..., 1] - to[..., 1] * way[..., 0]) * np.sign(turn)
    size = np.abs(turn)
    return bool(((size > 0) & (along >= 0) & (along <= size) & (aside >= 0) & (aside <= size)).any())


def _ways(line: I64) -> I64:
    """(n, 2) from each point to the next; none from the last."""
    ways: I64 = np.concatenate([np.diff(line, axis=0), np.zeros((1, 2), np.int64)])
    return ways
