"""Buttons and buckles: small things of their own down the middle of the front."""

import numpy as np

from vistel.arrays import F64
from vistel.figure.clothes.build import Build
from vistel.figure.clothes.cloth import Cloth


def middle_line(build: Build, cloth: Cloth) -> tuple[F64, F64]:
    """(N,) heights, from below, and (N, 3) places of the front of cloth where x = 0."""
    p = cloth.points[cloth.triangles]
    a, b = p.reshape(-1, 3), np.roll(p, -1, axis=1).reshape(-1, 3)
    across = (a[:, 0] <= 0.0) & (b[:, 0] > 0.0)
    t = (a[across, 0] / (a[across, 0] - b[across, 0]))[:, None]
    at = a[across] + t * (b[across] - a[across])
    at = at[at[:, 2] > build.trunk.middle[:, 0].mean() + build.trunk.origin[2]]
    at = at[np.argsort(at[:, 1], kind="stable")]
    return at[:, 1], at


def button(at: F64, out: F64, like: Cloth, radius: float) -> Cloth:
    """A button at a place (3,) of the cloth, facing along `out` (3,), moving with what is nearest."""
    turn = np.arange(8) * (np.pi / 4.0)
    return _raised(at, out, like, radius * np.column_stack([np.cos(turn), np.sin(turn)]), 0.0022, 0.0016, "button")


def buckle(at: F64, out: F64, like: Cloth, wide: float, high: float) -> Cloth:
    """A plate [m], in the same way."""
    corners = 0.5 * np.array(((wide, -high), (wide, high), (-wide, high), (-wide, -high)))
    return _raised(at, out, like, corners, 0.0035, 0.0030, "buckle")


def _raised(at: F64, out: F64, like: Cloth, outline: F64, rim: float, middle: float, panel: str) -> Cloth:
    """A plate with an outline (N, 2) counter-clockwise, whose rim and middle stand out so far [m]."""
    count, side = len(outline), np.cross(np.eye(3)[1], out)
    side = side / np.linalg.norm(side)
    up = np.cross(out, side)
    ring = outline[:, :1] * side + outline[:, 1:] * up
    points = np.vstack([at + ring, at + 0.9 * ring + rim * out, at + middle * out])
    k, n = np.arange(count), np.roll(np.arange(count), -1)
    walls = np.vstack([np.column_stack([k, n, count + n]), np.column_stack([k, count + n, count + k])])
    triangles = np.vstack([walls, np.column_stack([count + k, count + n, np.full(count, 2 * count)])]).astype(np.int32)
    nearest = int(np.argmin(np.square(like.points - at).sum(axis=1)))
    flat = np.column_stack([(points - at) @ side, (points - at) @ up])[triangles]
    weight, limb = np.tile(like.weight[nearest], (len(points), 1)), np.full(len(points), like.limb[nearest], np.int32)
    own, shown = np.zeros(len(triangles), np.int32), np.zeros(len(points), np.bool_)
    return Cloth(points, triangles, weight, limb, own, flat, shown, (panel,))
