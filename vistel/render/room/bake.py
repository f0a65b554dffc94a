"""Light that does not change, computed once when a room is built: window, roof light, and what furniture hides.

All amounts are relative: 1 is the floor in the open under the roof light.
"""

import numpy as np

from vistel.arrays import F64
from vistel.space.room import HALF_WIDTH

HALF_X = HALF_WIDTH
"""From the meeting room's middle to its walls at -X and +X [m]; things are kept within 4 m of the middle."""
HALF_Z = HALF_WIDTH
"""The same to the walls at -Z and +Z [m]."""
HEIGHT = 2.9
"""Of the ceiling over the floor [m]."""
WINDOW = (-2.0, 2.0, 0.85, 2.35)
"""Of the wall at -X: from z, to z, from y, to y [m]."""
ROOF_LIGHT = 1.2
"""Half the side of the square light in the ceiling [m]."""

# Shares of the light that is baked in.
_AMBIENT = 0.30
_WINDOW_POWER = 1.25
_ROOF_POWER = 1.15


def _window_points() -> F64:
    z, y = np.meshgrid(np.linspace(WINDOW[0], WINDOW[1], 5), np.linspace(WINDOW[2], WINDOW[3], 3))
    return np.stack((np.full(z.size, -HALF_X), y.ravel(), z.ravel()), axis=1)


def _roof_points() -> F64:
    x, z = np.meshgrid(np.linspace(-ROOF_LIGHT, ROOF_LIGHT, 4), np.linspace(-ROOF_LIGHT, ROOF_LIGHT, 4))
    return np.stack((x.ravel(), np.full(x.size, HEIGHT), z.ravel()), axis=1)


def light(points: F64, normal: F64, discs: F64) -> F64:
    """(n,) light at `points` (n, 3) of a plane with `normal` (3,).

    discs: (k, 4) x, y, z and radius of horizontal discs that hide it.
    """
    out = np.full(len(points), _AMBIENT)
    for lamps, facing, power in (
        (_window_points(), np.array((1.0, 0.0, 0.0)), _WINDOW_POWER),
        (_roof_points(), np.array((0.0, -1.0, 0.0)), _ROOF_POWER),
    ):
        for lamp in lamps:
            way = lamp - points
            d2 = np.maximum((way**2).sum(axis=1), 0.05)
            cosines = np.maximum(way @ normal, 0.0) * np.maximum(-way @ facing, 0.0) / d2
            out += power * 4.0 / len(lamps) * cosines / d2 * _clear(points, way, discs)
    return out * _under(points, discs) * _corners(points, normal)


def _clear(points: F64, way: F64, discs: F64) -> F64:
    """1 where nothing of `discs` stands between a point and the lamp `way` further on."""
    clear = np.ones(len(points))
    for x, y, z, r in discs:
        dy = np.where(np.abs(way[:, 1]) < 1e-6, 1e-6, way[:, 1])
        t = (y - points[:, 1]) / dy
        hx, hz = points[:, 0] + t * way[:, 0] - x, points[:, 2] + t * way[:, 2] - z
        clear[(t > 1e-3) & (t < 1.0) & (hx * hx + hz * hz < r * r)] = 0.0
    return clear


def _under(points: F64, discs: F64) -> F64:
    """What of the sky the discs above leave: 1 minus the form factor of a disc over a horizontal plane."""
    left = np.ones(len(points))
    for x, y, z, r in discs:
        h = np.maximum(y - points[:, 1], 0.0)
        d2 = (points[:, 0] - x) ** 2 + (points[:, 2] - z) ** 2
        s = d2 + h * h
        factor = 0.5 * (1.0 - (s - r * r) / np.sqrt(np.maximum((s + r * r) ** 2 - 4.0 * r * r * d2, 1e-12)))
        left *= 1.0 - 0.85 * np.where(h > 1e-4, factor, 0.0)
    return left


def _corners(points: F64, normal: F64) -> F64:
    """Corners are darker: walls see less of the room there."""
    out = np.ones(len(points))
    for axis, low, high in ((0, -HALF_X, HALF_X), (1, 0.0, HEIGHT), (2, -HALF_Z, HALF_Z)):
        if abs(normal[axis]) < 0.5:
            for wall in (low, high):
                out *= 1.0 - 0.38 * np.exp(-np.abs(points[:, axis] - wall) / 0.28)
    return out


def openness(points: F64, normals: F64, discs: F64) -> F64:
    """(n,) ambient light that reaches points of furniture with their own (n, 3) normals."""
    up = 0.5 + 0.5 * normals[:, 1]
    floor_near = 1.0 - 0.45 * (1.0 - up) * np.exp(-points[:, 1] / 0.25)
    return (0.35 + 0.65 * _under(points, discs)) * floor_near
