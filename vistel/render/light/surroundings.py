"""The room as things in it mirror it: six pictures taken from the table, spread for matt and polished surfaces.

Diffuse light is kept as nine spherical harmonics (Ramamoorthi and Hanrahan 2001), mirrors as maps of the sphere for growing
roughness (Karis 2013).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import moderngl
import numpy as np
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from vistel.arrays import F32, F64
from vistel.render.view.camera import Camera

FROM = np.array((0.0, 1.15, 0.0))
"""Where the room is seen from [m]: over the table, as high as heads."""
SMOOTHEST = 0.06
"""Roughness of the best mirror: a sharper one would show how coarsely the room was taken for it."""
SIDE = 64
"""Pixels along a side of each of the six pictures."""
ROUGHNESSES = (0.0, 0.25, 0.5, 0.75, 1.0)
WIDTH = 128
"""Pixels of a map of the sphere along its longitude."""
HEIGHT = 64
"""Pixels of it from the zenith to the nadir."""
MEAN = 0.53
"""Mean light of all directions together, the same as in the plainer light of common.glsl."""
_COARSE = 32, 16


@dataclass(frozen=True, eq=False)
class Surroundings:
    """mirrors: (5 * HEIGHT, WIDTH, 3) linear light, maps for `ROUGHNESSES` one after the other; irradiance: (9, 3)."""

    mirrors: F32
    irradiance: F32


def surroundings(picture: Callable[[Camera], F32]) -> Surroundings:
    """picture: (SIDE, SIDE, 3) linear light that a camera sees, first row at the bottom."""
    light, towards, share = _seen(picture)
    light = np.minimum(light, 8.0)
    light = light * (MEAN / max(1e-6, float((light.mean(axis=1) * share).sum())))
    maps = [_polished(light, towards), *_spread(light, towards, share, ROUGHNESSES[1:])]
    return Surroundings(np.concatenate(maps).astype(np.float32), _harmonics(light, towards, share).astype(np.float32))


class Reflections:
    """Surroundings on the graphics side."""

    def __init__(self, ctx: moderngl.Context, around: Surroundings) -> None:
        self._texture = ctx.texture((WIDTH, len(around.mirrors)), 3, around.mirrors.astype(np.float16).tobytes(), dtype="f2")
        self._texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self._texture.repeat_y = False
        self._irradiance = around.irradiance.tobytes()

    def use(self, unit: int) -> dict[str, object]:
        """Bind the map to a texture unit; returns what shaders with FINE need to know."""
        self._texture.use(unit)
        return {"mirrored": unit, "irradiance": self._irradiance}

    def release(self) -> None:
        """Give it back."""
        self._texture.release()


def open_air(camera: Camera) -> F32:
    """What a camera sees where there is no room: sky over ground, (SIDE, SIDE, 3)."""
    at = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    x, y = np.meshgrid(at, at)
    ways = np.stack((x, y, -np.ones_like(x)), axis=2) @ camera.rotation.T
    up = ways[..., 1:2] / np.linalg.norm(ways, axis=2, keepdims=True)
    return np.where(up > 0.0, np.array((0.5, 0.56, 0.66)) + 0.25 * up, (0.30, 0.26, 0.21)).astype(np.float32)


def _seen(picture: Callable[[Camera], F32]) -> tuple[F64, F64, F64]:
    """Light (n, 3) from directions (n, 3), each with its share of the sphere (n,)."""
    at = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    x, y = np.meshgrid(at, at)
    solid = 1.0 / (x * x + y * y + 1.0) ** 1.5
    lights: list[F64] = []
    ways: list[F64] = []
    for back in np.concatenate((np.eye(3), -np.eye(3))):
        up = np.array((0.0, 0.0, 1.0)) if abs(back[1]) > 0.5 else np.array((0.0, 1.0, 0.0))
        right = np.cross(up, back)
        rotation = np.stack((right, np.cross(back, right), back), axis=1)
        lights.append(picture(Camera(FROM, rotation, math.pi / 2)).reshape(-1, 3).astype(np.float64))
        ways.append(np.stack((x, y, -np.ones_like(x)), axis=2).reshape(-1, 3) @ rotation.T)
    towards = np.concatenate(ways)
    share = np.tile(solid.ravel(), 6)
    return np.concatenate(lights), towards / np.linalg.norm(towards, axis=1, keepdims=True), share / share.sum()


def _sphere(width: int, height: int) -> F64:
    """(height * width, 3) directions of a map's texels; the same as `mirror` in fine_light.glsl."""
    longitude = ((np.arange(width) + 0.5) / width - 0.5) * 2.0 * math.pi
    zenith = (np.arange(height) + 0.5) / height * math.pi
    t, p = np.meshgrid(zenith, longitude, indexing="ij")
    return np.stack((np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)), axis=2).reshape(-1, 3)


def _polished(light: F64, towards: F64) -> F32:
    """(HEIGHT, WIDTH, 3): what a mirror shows."""
    nearest = np.asarray(KDTree(towards).query(_sphere(WIDTH, HEIGHT))[1])
    return light[nearest].reshape(HEIGHT, WIDTH, 3).astype(np.float32)


def _spread(light: F64, towards: F64, share: F64, roughnesses: Sequence[float]) -> list[F32]:
    """(HEIGHT, WIDTH, 3) for each: what a surface of that roughness mirrors, seen straight on (GGX)."""
    width, height = _COARSE
    weighted = np.column_stack((light * share[:, None], share)).astype(np.float32)
    rows: list[list[F32]] = [[] for _ in roughnesses]
    for way in np.array_split(_sphere(width, height), height):
        cosine = np.clip(way.astype(np.float32) @ towards.T.astype(np.float32), -1.0, 1.0)
        nh2 = 0.5 + 0.5 * cosine  # of the half vector between the mirrored direction and the light's
        facing = np.maximum(cosine, 0.0)
        for row, rough in zip(rows, roughnesses, strict=True):
            total = (facing / np.square(nh2 * (rough**4 - 1.0) + 1.0)) @ weighted
            row.append(np.asarray(total[:, :3] / total[:, 3:], np.float32))
    images = [np.concatenate(row).reshape(height, width, 3).astype(np.float32) for row in rows]
    return [_finer(image) for image in images]


def _finer(image: F32) -> F32:
    """A map of WIDTH and HEIGHT; round the sphere, so that its ends meet."""
    wide = cv2.resize(np.hstack((image, image, image)), (3 * WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    return np.maximum(np.asarray(wide, np.float32)[:, WIDTH : 2 * WIDTH], 0.0)


def _harmonics(light: F64, towards: F64, share: F64) -> F64:
    """(9, 3) factors of 1, y, z, x, xy, yz, 3z²-1, xz, x²-y²: the mean light of the half sphere about a normal, by cosine."""
    x, y, z = towards.T
    basis = np.stack((np.ones_like(x), y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y))
    norms = np.array((1.0, 3.0, 3.0, 3.0, 15.0, 15.0, 1.25, 15.0, 3.75))
    spread = np.array((1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25))
    return (norms * spread)[:, None] * (basis * share) @ light
