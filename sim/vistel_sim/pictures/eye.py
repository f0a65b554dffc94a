"""What an infrared eye camera sees: a dark pupil, an iris, lids that close, a lamp's reflection."""

import math

import cv2
import numpy as np

from vistel.arrays import F32, F64, U8
from vistel_sim.pictures.noise import Noise

WIDTH = 320
"""Of a picture [px]."""
HEIGHT = 240
"""Of a picture [px]."""
_EYEBALL_PX = 128.0
"""Radius of the eyeball [px]."""
_IRIS = 0.48
"""Radius of the iris over that of the eyeball, seen from the front."""
_PUPIL = 0.17
"""Radius of the pupil over that of the eyeball, seen from the front."""
_SOFT_PX = 1.3
"""Half width of an edge [px]: the lens is not quite sharp."""


class EyePicture:
    """Draws one person's left eye; the camera sits below it and is a little askew, as a clip-on camera is."""

    def __init__(self, seed: int, *, noise: float = 3.0, right: bool = False) -> None:
        """noise: deviation [grey levels]. right: draw the right eye, which is the left one mirrored."""
        rng = np.random.default_rng(seed)
        self._below = math.radians(12.0 + rng.uniform(-3.0, 3.0))
        self._roll = math.radians(rng.uniform(-4.0, 4.0))
        self._middle = np.array((WIDTH / 2, HEIGHT / 2)) + rng.uniform(-8.0, 8.0, 2)
        self._right = right
        self._noise = Noise(noise, seed)
        grain = cv2.GaussianBlur(rng.standard_normal((HEIGHT, WIDTH)).astype(np.float32), (0, 0), 5.0)
        self._y, self._x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
        self._skin = 168.0 + 120.0 * grain - 0.06 * np.abs(self._x - WIDTH / 2)
        self._spokes = rng.standard_normal(48).astype(np.float32)

    def pupil(self, gaze: F64) -> tuple[F64, float]:
        """(2,) centre [px] of the pupil of an eye that looks at `gaze` (yaw left positive, pitch up positive) [rad]; cosine of
        the angle at which the camera sees it."""
        yaw, pitch = float(gaze[0]), float(gaze[1])
        if self._right:
            yaw = -yaw
        d = np.array((math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)))
        c, s = math.cos(self._below), math.sin(self._below)
        d = np.array((d[0], c * d[1] + s * d[2], c * d[2] - s * d[1]))
        c, s = math.cos(self._roll), math.sin(self._roll)
        flat = np.array((c * d[0] - s * d[1], s * d[0] + c * d[1]))
        at = self._middle + _EYEBALL_PX * (flat - (0.0, math.sin(self._below))) * (1.0, -1.0)
        return self._mirrored(at), float(d[2])

    def draw(self, gaze: F64, opening: float, number: int, gain: float = 1.0, pupil: float = 1.0) -> U8:
        """(240, 320) grey. opening: 0 closed .. 1; number: of the frame, for its noise; gain: of the light; pupil: its size."""
        centre, facing = self.pupil(gaze)
        centre = self._mirrored(centre)
        x, y = self._x, self._y
        dx, dy = x - centre[0], y - centre[1]
        # A disc seen from the side is narrower along the direction in which it has turned away.
        away = centre - self._middle + (0.0, -_EYEBALL_PX * math.sin(self._below))
        n = away / max(float(np.hypot(*away)), 1e-6)
        along, across = dx * n[0] + dy * n[1], dy * n[0] - dx * n[1]
        rho = np.hypot(along / max(facing, 0.3), across)
        spokes = self._spokes[(np.arctan2(dy, dx) * (24.0 / math.pi)).astype(np.int64) % 48]
        picture = _over(np.full_like(x, 142.0), 92.0 + 4.0 * spokes, rho, _IRIS * _EYEBALL_PX)
        picture = _over(picture, np.full_like(x, 22.0), rho, pupil * _PUPIL * _EYEBALL_PX)
        glint = self._middle + 0.35 * (centre - self._middle) + (10.0, 14.0)
        picture = _over(picture, np.full_like(x, 250.0), np.hypot(x - glint[0], y - glint[1]), 4.0)
        upper, lower = self.lids(opening)
        picture += np.clip(0.5 + (upper - y) / _SOFT_PX, 0.0, 1.0) * (self._skin - picture)
        picture += np.clip(0.5 + (y - lower) / _SOFT_PX, 0.0, 1.0) * (self._skin - picture)
        # The dark line of the lashes along the upper lid.
        picture -= 55.0 * np.exp(-(((y - upper + 2.0) / 2.5) ** 2)) * (np.abs(x - WIDTH / 2) < 125.0)
        frame = np.asarray(np.clip(gain * picture, 0.0, 255.0), np.uint8)
        frame = self._noise.add(frame, number)
        return np.ascontiguousarray(frame[:, ::-1]) if self._right else frame

    def lids(self, opening: float) -> tuple[F32, F32]:
        """y [px] of the upper and the lower lid at each column, for an eye that is `opening` open."""
        u = (self._x[:1] - self._middle[0]) / 135.0
        bow = np.clip(1.0 - u * u, 0.0, 1.0)
        base = self._middle[1] + 22.0
        lower = base + 24.0 * bow
        upper = lower - opening * 92.0 * bow
        return upper.astype(np.float32), lower.astype(np.float32)

    def _mirrored(self, at: F64) -> F64:
        return np.array((WIDTH - 1 - at[0], at[1])) if self._right else at


def _over(below: F32, colour: F32, rho: F32, radius: float) -> F32:
    """A disc with a soft edge laid over a picture."""
    return np.asarray(below + np.clip(0.5 + (radius - rho) / _SOFT_PX, 0.0, 1.0) * (colour - below), np.float32)
