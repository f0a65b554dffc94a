"""The picture by which a wall of screens is set up: shows where corners, colours, edges or the measured places are wrong.

On each screen's own surface: a grid of decimetres, a ring that must be round, steps of grey and colours. Seen from the eye,
across all screens: circles of the sky, which run straight over a seam only where the corners in the file are those of the wall.
"""

import math
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vistel.arrays import F64, U8
from vistel.render.view.camera import Pinhole
from vistel.render.view.screens import RoomScreen, Stereo, boxes, picture_size, sights_of_screens

CELL = 0.1
"""Side of the grid's cells on the screen [m]."""
SKY_STEP = math.radians(10.0)
_DARK = (16, 18, 22)
_FAINT = (58, 64, 72)
_BOLD = (112, 120, 130)
_EDGE = (255, 255, 255)
_SKY = (255, 196, 60)
_LEVEL = (255, 110, 60)
_STEPS = 11
_FAR = 20.0


EYES_OVER_SEAT = 1.2
"""Of somebody who sits [m]."""


def eyes_at(position: F64, heading: float, apart: float) -> F64:
    """(2, 3) eyes of who sits at `position` and looks ahead, turned by `heading` [rad] about +Y; `apart` [m]."""
    left = np.array((math.cos(heading), 0.0, -math.sin(heading)))
    middle = position + np.array((0.0, EYES_OVER_SEAT, 0.0))
    return np.stack((middle + 0.5 * apart * left, middle - 0.5 * apart * left))


def pattern(screens: Sequence[RoomScreen], eyes: F64, stereo: Stereo = Stereo.MONO) -> U8:
    """The wall's picture (h, w, 3), first row at the top, for `eyes` (2, 3) left and right in the room."""
    width, height = picture_size(screens, stereo)
    wall = np.zeros((height, width, 3), np.uint8)
    for screen, (x, _, w, h) in zip(screens, boxes(screens, stereo), strict=True):
        shown = np.zeros((h, w, 3), np.uint8)
        for eye, sight in zip(_EYES[stereo], sights_of_screens([screen], eyes, stereo, 0), strict=False):
            left, bottom, across, up = sight.box or (0, 0, w, h)
            part = shown[h - bottom - up : h - bottom, left : left + across]
            drawn = _as_projected(_one(screen, sight.camera, (across, up), eye), screen)
            for channel, seen in enumerate(sight.colours):
                if seen:
                    part[..., channel] = drawn[..., channel]
        wall[height - h :, x : x + w] = shown
    return wall


_BOTH = ("left eye", "right eye")
_EYES: dict[Stereo, tuple[str, ...]] = {
    Stereo.MONO: ("",),
    Stereo.SIDE_BY_SIDE: _BOTH,
    Stereo.TOP_BOTTOM: _BOTH,
    Stereo.ANAGLYPH: _BOTH,
    Stereo.SEQUENTIAL: ("",),
    Stereo.QUAD_BUFFER: _BOTH,
}


def _one(screen: RoomScreen, camera: Pinhole, size: tuple[int, int], eye: str) -> U8:
    """What one eye sees on one screen."""
    image = Image.new("RGB", size, _DARK)
    draw = ImageDraw.Draw(image)
    line = max(1, round(size[1] / 400))
    _grid(draw, screen, size, line)
    _sky(draw, camera, size, line)
    _steps(draw, size)
    width, height = _metres(screen)
    across, up = size[0] / width, size[1] / height
    radius = 0.2 * min(width, height)
    middle = 0.5 * size[0], 0.5 * size[1]
    draw.ellipse(
        (middle[0] - radius * across, middle[1] - radius * up, middle[0] + radius * across, middle[1] + radius * up),
        outline=_EDGE,
        width=2 * line,
    )
    draw.rectangle((0, 0, size[0] - 1, size[1] - 1), outline=_EDGE)
    text = "\n".join(filter(None, (screen.name, eye, f"{width:.2f} x {height:.2f} m", f"{screen.width} x {screen.height} pixels")))
    font = ImageFont.load_default(max(9.0, min(size[1] / 26, size[0] / 22)))
    draw.rectangle(draw.multiline_textbbox(middle, text, font=font, anchor="mm", align="center"), fill=_DARK)
    draw.multiline_text(middle, text, fill=_EDGE, font=font, anchor="mm", align="center")
    return np.asarray(image, np.uint8)


def _metres(screen: RoomScreen) -> tuple[float, float]:
    across, up = screen.lower_right - screen.lower_left, screen.upper_left - screen.lower_left
    return float(np.linalg.norm(across)), float(np.linalg.norm(up))


def _grid(draw: ImageDraw.ImageDraw, screen: RoomScreen, size: tuple[int, int], line: int) -> None:
    """Decimetres from the lower left corner, every fifth one bold."""
    width, height = _metres(screen)
    for k in range(1, math.ceil(width / CELL)):
        x = k * CELL / width * size[0]
        draw.line((x, 0, x, size[1]), fill=_FAINT if k % 5 else _BOLD, width=line)
    for k in range(1, math.ceil(height / CELL)):
        y = size[1] - k * CELL / height * size[1]
        draw.line((0, y, size[0], y), fill=_FAINT if k % 5 else _BOLD, width=line)


def _sky(draw: ImageDraw.ImageDraw, camera: Pinhole, size: tuple[int, int], line: int) -> None:
    """Circles round the eye: upright ones through the zenith, level ones by their height; the horizon stands out."""
    turn = np.linspace(-math.pi, math.pi, 721)
    for k in range(-5, 6):
        height = k * SKY_STEP
        way = np.stack((np.cos(height) * np.sin(turn), np.full_like(turn, np.sin(height)), np.cos(height) * np.cos(turn)), axis=1)
        _curve(draw, camera, size, way, _SKY if k else _LEVEL, line if k else 2 * line)
    tilt = np.linspace(-1.4, 1.4, 361)
    for k in range(round(2.0 * math.pi / SKY_STEP)):
        a = k * SKY_STEP
        _curve(draw, camera, size, np.stack((np.cos(tilt) * np.sin(a), np.sin(tilt), np.cos(tilt) * np.cos(a)), axis=1), _SKY, line)


def _curve(
    draw: ImageDraw.ImageDraw, camera: Pinhole, size: tuple[int, int], ways: F64, colour: tuple[int, int, int], line: int
) -> None:
    """Through directions (n, 3) from the eye, where they are on the screen or near it."""
    at = camera.project(camera.position + _FAR * ways, *size)
    near = (at[:, 2] > 0.05) & (np.abs(at[:, 0]) < 4 * size[0]) & (np.abs(at[:, 1]) < 4 * size[1])
    for a, b, shown in zip(at[:-1], at[1:], near[:-1] & near[1:], strict=True):
        if shown:
            draw.line((a[0], a[1], b[0], b[1]), fill=colour, width=line)


def _steps(draw: ImageDraw.ImageDraw, size: tuple[int, int]) -> None:
    """Steps of grey, and below them of red, green and blue, at the picture's foot."""
    left, right, top, high = 0.15 * size[0], 0.85 * size[0], 0.80 * size[1], 0.035 * size[1]
    for row, tint in enumerate(((1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1))):
        for k in range(_STEPS):
            value = round(255 * k / (_STEPS - 1))
            x = left + k * (right - left) / _STEPS
            box = (x, top + row * high, x + (right - left) / _STEPS - 1, top + (row + 1) * high - 1)
            draw.rectangle(box, fill=(value * tint[0], value * tint[1], value * tint[2]))


def _as_projected(picture: U8, screen: RoomScreen) -> U8:
    """With the light as the projector's gain and blending make it; the same as shaders/correct.frag.glsl."""
    if screen.plain:
        return picture
    height, width = picture.shape[:2]
    x = (np.arange(width, dtype=np.float64) + 0.5) / width
    y = 1.0 - (np.arange(height, dtype=np.float64) + 0.5) / height

    def rise(from_edge: F64, part: float) -> F64:
        return np.clip(from_edge / part, 0.0, 1.0) if part > 0.0 else np.ones_like(from_edge)

    left, right, bottom, top = screen.blend
    light = np.outer(rise(y, bottom) * rise(1.0 - y, top), rise(x, left) * rise(1.0 - x, right))
    factor = (light[..., None] * np.asarray(screen.gain)) ** (1.0 / 2.2)
    return (picture * factor + 0.5).astype(np.uint8)
