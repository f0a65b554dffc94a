"""What the face camera of a helmet sees: a face with 13 green marks, drawn so that the true centres are known."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from vistel.arrays import F64, U8
from vistel.figure.face.marks import MARK_COUNT, REST
from vistel_sim.pictures.noise import Noise

WIDTH = 640
"""Of a picture [px]."""
HEIGHT = 480
"""Of a picture [px]."""
_PX_PER_M = 2600.0
"""Scale of the picture at the face [px per m]."""
_MIDDLE_M = np.array((0.0, 0.032))
"""Where the middle of the picture is on the face, x and y in the head's frame [m]."""
_MARK_M = 0.003
"""Radius of a mark [m]."""
_OWN_M = 0.0012
"""Standard deviation of where a person's marks are stuck, from the table's places [m]."""
_GREEN = (78.0, 190.0, 62.0)
"""Colour of a mark: blue, green, red, 0 to 255."""
_SKIN = (118.0, 148.0, 196.0)
"""Colour of the skin: blue, green, red, 0 to 255."""


@dataclass(frozen=True)
class View:
    """What disturbs a picture. slip: of the helmet on the head, x, y [m] and angle [rad]. gains: of blue, green, red. covers: dark
    discs in front of the face (x, y, radius [px]). blur: of the marks' edges [px]."""

    slip: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0)
    covers: Sequence[tuple[float, float, float]] = ()
    blur: float = 0.8


class FacePicture:
    """Draws one person's face. own: (13, 2) by how much their marks lie off the standard face's [m]."""

    def __init__(self, seed: int, *, noise: float = 3.0) -> None:
        """noise: deviation [grey levels] of each pixel."""
        rng = np.random.default_rng(seed)
        self.own: F64 = _OWN_M * rng.standard_normal((MARK_COUNT, 2))
        self._angle = rng.uniform(0.0, math.pi, MARK_COUNT)
        self._aspect = rng.uniform(0.85, 1.0, MARK_COUNT)
        self._noise = Noise(noise, seed)
        self._face = _face(seed)

    def centres(self, marks: F64, view: View | None = None) -> F64:
        """(13, 2) pixels of the centres of marks (13, 2) [m, standard head's frame]."""
        dx, dy, turn = (view or View()).slip
        c, s = math.cos(turn), math.sin(turn)
        p = (marks + self.own - _MIDDLE_M) @ np.array(((c, s), (-s, c))) + (dx, dy)
        return p * (_PX_PER_M, -_PX_PER_M) + (WIDTH / 2, HEIGHT / 2)

    def draw(self, marks: F64, number: int, view: View | None = None) -> U8:
        """(480, 640, 3) BGR of a face whose marks are at `marks` (13, 2) [m]. number: of the frame, for its noise."""
        view = view or View()
        gains = np.array(view.gains)
        dx, dy, turn = view.slip
        lay = np.array(((math.cos(turn), math.sin(turn), 0.0), (-math.sin(turn), math.cos(turn), 0.0)))
        middle = np.array((WIDTH / 2, HEIGHT / 2))
        lay[:, 2] = middle - lay[:, :2] @ middle + (_PX_PER_M * dx, -_PX_PER_M * dy)
        face = cv2.warpAffine(self._face, lay, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REPLICATE) if any(view.slip) else self._face
        frame = np.asarray(cv2.transform(face, np.diag(gains).astype(np.float32)), np.uint8)
        radius = _MARK_M * _PX_PER_M
        for k, (x, y) in enumerate(self.centres(marks, view)):
            _dab(frame, x, y, (radius, radius * self._aspect[k]), self._angle[k], gains * _GREEN, view.blur)
        for x, y, r in view.covers:
            _dab(frame, x, y, (r, r), 0.0, gains * (60.0, 70.0, 90.0), 1.5)
        return self._noise.add(frame, number)


def _dab(frame: U8, x: float, y: float, radii: tuple[float, float], angle: float, colour: F64, blur: float) -> None:
    """Lay an ellipse of `colour` over the picture; its edge is as soft as `blur`."""
    reach = max(radii) + 3.0 * blur + 1.0
    x0, x1 = max(0, math.floor(x - reach)), min(frame.shape[1], math.ceil(x + reach) + 1)
    y0, y1 = max(0, math.floor(y - reach)), min(frame.shape[0], math.ceil(y + reach) + 1)
    if x0 >= x1 or y0 >= y1:
        return
    dx, dy = np.arange(x0, x1) - x, (np.arange(y0, y1) - y)[:, None]
    c, s = math.cos(angle), math.sin(angle)
    out = np.hypot((c * dx + s * dy) / radii[0], (c * dy - s * dx) / radii[1])
    cover = np.clip(0.5 + (1.0 - out) * min(radii) / (2.5 * blur), 0.0, 1.0)[..., None]
    patch = frame[y0:y1, x0:x1]
    patch[:] = np.rint(np.clip(patch + cover * (colour - patch), 0.0, 255.0)).astype(np.uint8)


def _face(seed: int) -> U8:
    """A face without marks: skin with its shades, eyes, brows, lips, and dark hair round it."""
    rng = np.random.default_rng(seed + 1)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    x = (x - WIDTH / 2) / _PX_PER_M
    y = _MIDDLE_M[1] - (y - HEIGHT / 2) / _PX_PER_M
    round_ = np.hypot(x / 0.085, (y - 0.04) / 0.13)
    shade = 1.05 - 0.35 * np.clip(round_, 0.0, 1.2) ** 2 + 1.2 * x
    grain = cv2.GaussianBlur(rng.standard_normal((HEIGHT, WIDTH)).astype(np.float32), (0, 0), 4.0)
    out = (shade + 0.25 * grain)[..., None] * np.array(_SKIN, np.float32)

    def lay(at: tuple[float, float], radii: tuple[float, float], colour: tuple[float, float, float]) -> None:
        cover = np.clip(0.5 + 6.0 * (1.0 - np.hypot((x - at[0]) / radii[0], (y - at[1]) / radii[1])), 0.0, 1.0)[..., None]
        out[:] = out + cover * (np.array(colour, np.float32) - out)

    for side in (-1.0, 1.0):
        lay((side * 0.03, 0.065), (0.014, 0.006), (205, 210, 214))
        lay((side * 0.03, 0.065), (0.0055, 0.0055), (60, 62, 50))
        lay((side * 0.03, 0.084), (0.018, 0.0025), (38, 48, 62))
    lay((0.0, 0.0165), (0.024, 0.0045), (104, 98, 170))
    lay((0.0, 0.0165), (0.022, 0.0008), (50, 44, 84))
    hair = np.clip((round_ - 1.0) * 12.0, 0.0, 1.0)[..., None]
    out += hair * (np.array((34, 40, 48), np.float32) - out)
    return np.asarray(np.clip(cv2.GaussianBlur(out, (0, 0), 1.0), 0.0, 255.0), np.uint8)


def rest_face() -> F64:
    """(13, 2) marks of a face that does nothing."""
    return REST.copy()
