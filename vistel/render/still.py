"""One picture of figures, or of a conference's state, for programs and notebooks."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from vistel.arrays import U8
from vistel.figure.posed import PosedFigure
from vistel.figure.posture.posture import pose_joints
from vistel.render.figures.cache import cached_figure
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.people import load_figure
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.view.camera import Camera, look_at
from vistel.render.view.view import View
from vistel.space.files.interior import Interior
from vistel.space.room import Room

SEATS = 3
"""Of the room that is drawn with `room=True`."""
FIELD_OF_VIEW = 0.5
"""Upwards, of the camera that looks at figures [rad]."""
_MARGIN = 0.15
"""Space round the joints of figures for skin, hair and clothes [m]."""
_FROM = np.array((0.28, 0.10, 1.0))
"""Direction from figures to the camera, when they face +Z."""
_LARGEST = 16384
"""Most pixels of a side that OpenGL draws."""


@dataclass(frozen=True)
class Picture:
    """array: (height, width, 3) sRGB, first row at the top. A notebook shows it by itself."""

    array: U8

    def save(self, path: str | Path) -> None:
        """Write it as a file; the path's suffix says in which format (.png, .jpg, ...). Raises OSError or ValueError."""
        Image.fromarray(self.array).save(path)

    def _repr_png_(self) -> bytes:
        out = io.BytesIO()
        Image.fromarray(self.array).save(out, "png")
        return out.getvalue()


def picture(
    shown: Sequence[PosedFigure] | PosedFigure | Instant,
    size: tuple[int, int] = (640, 480),
    camera: Camera | None = None,
    room: bool = False,
    light: str = "fine",
) -> Picture:
    """Draw figures, or all that is there at an instant of a conference.

    size: width and height in pixels. camera: by default one that has all figures in the picture, or the overview of an instant's
    room. room: with the built-in meeting room round it. light: "fine", or "fast" without soft shadows and reflections.
    Raises NoOpenGlError, in one line, where nothing can be drawn; ValueError for a size or light that cannot be.
    """
    width, height = size
    if not (1 <= width <= _LARGEST and 1 <= height <= _LARGEST):
        raise ValueError(f"size: expected width and height from 1 to {_LARGEST} pixels, got {width} x {height}")
    if light not in ("fine", "fast"):
        raise ValueError(f"light: expected 'fine' or 'fast', got {light!r}")
    figures = () if isinstance(shown, Instant) else (shown,) if isinstance(shown, PosedFigure) else tuple(shown)
    named = {f"figure {n}": figure for n, figure in enumerate(figures)}
    people = tuple(PersonNow(ParticipantInfo(name, ""), f.posture, Timing(0, 0, 0, False)) for name, f in named.items())
    instant = shown if isinstance(shown, Instant) else Instant(1, people)
    view = View(width, height, "room", "", light=light, names=isinstance(shown, Instant))

    def load(about: ParticipantInfo) -> AvatarFigure:
        figure = named.get(about.name)
        return load_figure(about) if figure is None else cached_figure(figure.avatar, wears=figure.wrinkles)

    open_air = None if room else Interior(Room((), (), shell=False))
    renderer = SceneRenderer(view, SEATS, load, open_air)
    try:
        renderer.painter.saves_shadows = False
        renderer.camera = camera if camera is not None or not figures else _camera(figures, width / height)
        return Picture(np.ascontiguousarray(renderer.render_complete(instant)[::-1, :, :3]))
    finally:
        renderer.close()


def _camera(figures: Sequence[PosedFigure], aspect: float) -> Camera:
    """All figures, from in front of the first one and a little to the side."""
    points = np.concatenate([pose_joints(f.avatar.skeleton, f.posture).position for f in figures])
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    middle, size = 0.5 * (low + high), high - low
    across = float(np.hypot(size[0], size[2]))
    high_enough = 0.5 * max(float(size[1]), across / aspect) / np.tan(0.5 * FIELD_OF_VIEW)
    heading = figures[0].posture.stance.heading
    c, s = np.cos(heading), np.sin(heading)
    towards = np.array((c * _FROM[0] + s * _FROM[2], _FROM[1], c * _FROM[2] - s * _FROM[0])) / np.linalg.norm(_FROM)
    return look_at(middle + (high_enough + 0.5 * float(size[2])) * towards, middle, FIELD_OF_VIEW)
