"""Screens as windows into the room: what each eye sees through them, and how that is packed into one picture.

A screen is a flat rectangle anywhere in the room, given by three corners; a picture drawn for the eye where it really is
stands behind it like the world behind a window, whatever the angle (R. Kooima, "Generalized perspective projection", 2009).
Two of them make the V of walls of Singh §6.1. A desktop's stereo is the same with a window that hangs before the head.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from vistel.arrays import F64
from vistel.conference import display
from vistel.render.view.camera import Camera, Pinhole, WindowCamera

Box = tuple[int, int, int, int]
"""Left, bottom, width and height in pixels of the picture, its first row at the bottom."""
Colours = tuple[bool, bool, bool]

EYE_DISTANCE = 0.063
"""Between the pupils of an adult, on average [m]."""
NEAREST = 0.02
"""An eye nearer than this to a screen's plane, or behind it, sees nothing on it [m]."""


class Stereo(Enum):
    """How the pictures of two eyes share a screen's."""

    MONO = "mono"
    SIDE_BY_SIDE = "side_by_side"
    TOP_BOTTOM = "top_bottom"
    ANAGLYPH = "anaglyph"
    SEQUENTIAL = "sequential"
    QUAD_BUFFER = "quad_buffer"
    """A whole picture for each eye: the left one left in a picture of twice the width, until the window takes them apart."""

    @property
    def widths(self) -> int:
        """How many times a screen's width its part of the picture is wide."""
        return 2 if self is Stereo.QUAD_BUFFER else 1


@dataclass(frozen=True)
class RoomScreen:
    """lower_left, lower_right, upper_left: (3,) corners in the room frame [m]. width, height: of its picture in pixels.

    gain: factor of red, green and blue light. blend: the part of the picture at its left, right, bottom and top edge over
    which light fades, where the next projector's picture lies over this one.
    """

    name: str
    lower_left: F64
    lower_right: F64
    upper_left: F64
    width: int
    height: int
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    blend: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def plain(self) -> bool:
        """Whether light is as drawn everywhere on it."""
        return self.gain == (1.0, 1.0, 1.0) and not any(self.blend)

    @staticmethod
    def placed(config: display.Screen, position: F64, heading: float) -> "RoomScreen":
        """A screen of the conference file, for a viewer whose seat stands at `position`, turned by `heading` [rad] about +Y."""
        c, s = float(np.cos(heading)), float(np.sin(heading))
        turn = np.array(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)))
        low_left, low_right, up_left = (
            position + turn @ np.array(corner) for corner in (config.lower_left, config.lower_right, config.upper_left)
        )
        return RoomScreen(config.name, low_left, low_right, up_left, config.width, config.height, config.gain, config.blend)

    def scaled(self, scale: float) -> "RoomScreen":
        """The same with a picture of `scale` times the width and height."""
        return replace(self, width=max(1, round(scale * self.width)), height=max(1, round(scale * self.height)))

    def seen_from(self, eye: F64) -> WindowCamera | None:
        """What an eye at (3,) sees through it; None from behind, and from as good as within its plane."""
        across, up = self.lower_right - self.lower_left, self.upper_left - self.lower_left
        w = float(np.linalg.norm(across))
        right, back = across / w, np.cross(across, up)
        back = back / np.linalg.norm(back)
        above = np.cross(back, right)
        h = float(up @ above)
        away = float((eye - self.lower_left) @ back)
        if away < NEAREST:
            return None
        from_eye = self.lower_left - eye
        left, bottom = float(from_eye @ right) / away, float(from_eye @ above) / away
        window = (left, left + w / away, bottom, bottom + h / away)
        # Corners that were measured make no quite right angle; the picture fills what they do make.
        return WindowCamera(np.asarray(eye, np.float64), np.stack((right, above, back), axis=1), window, float(up @ right) / h)


@dataclass(frozen=True)
class Sight:
    """One eye's picture of one screen, in a picture that may hold several. box: None for all of it; colours: those drawn;
    screen: None for a desktop."""

    camera: Pinhole
    box: Box | None = None
    colours: Colours = (True, True, True)
    screen: RoomScreen | None = None

    def unsqueezed(self, width: int, height: int) -> tuple[int, int]:
        """Of a picture of so many pixels: how many it has once the display has stretched it to its shape, wider where two
        eyes share a width, higher where they share a height."""
        left, right, bottom, top = self.camera.edges(width / height)
        stretch = (right - left) / (top - bottom) * height / width
        return round(width * max(1.0, stretch)), round(height * max(1.0, 1.0 / stretch))


def picture_size(screens: Sequence[RoomScreen], stereo: Stereo = Stereo.MONO) -> tuple[int, int]:
    """Width and height in pixels of the picture that holds them all, side by side in their order."""
    return stereo.widths * sum(s.width for s in screens), max(s.height for s in screens)


def boxes(screens: Sequence[RoomScreen], stereo: Stereo = Stereo.MONO) -> list[Box]:
    """Where each screen lies in that picture."""
    out: list[Box] = []
    for s in screens:
        out.append((sum(width for _, _, width, _ in out), 0, stereo.widths * s.width, s.height))
    return out


def sights_of_screens(screens: Sequence[RoomScreen], eyes: F64, stereo: Stereo, frame: int) -> list[Sight]:
    """What is drawn of `screens` for `eyes` (2, 3) left and right in the room; frame: number of the picture."""
    out: list[Sight] = []
    for screen, box in zip(screens, boxes(screens, stereo), strict=True):
        for eye, place, colours in _shares(stereo, box, frame):
            camera = screen.seen_from(eyes[eye] if eye < 2 else eyes.mean(axis=0))
            if camera is not None:
                out.append(Sight(camera, place, colours, screen))
    return out


def sights_of_desktop(
    camera: Camera, size: tuple[int, int], stereo: Stereo, frame: int, eye_distance: float, convergence: float
) -> list[Sight]:
    """The same for a window that hangs `convergence` metres before `camera`: things there seem to be on the display. size: of
    the picture, with both eyes' in it."""
    width, height = size[0] // stereo.widths, size[1]
    left, right, bottom, top = (convergence * e for e in camera.edges(width / height))

    def corner(x: float, y: float) -> F64:
        return camera.position + camera.rotation @ np.array((x, y, -convergence))

    window = RoomScreen("desktop", corner(left, bottom), corner(right, bottom), corner(left, top), width, height)
    apart = 0.5 * eye_distance * camera.rotation[:, 0]
    return sights_of_screens([window], np.stack((camera.position - apart, camera.position + apart)), stereo, frame)


def eyes_apart(eyes: F64, distance: float) -> F64:
    """`eyes` (2, 3) moved along the line between them until they are `distance` apart [m]."""
    middle, way = eyes.mean(axis=0), eyes[1] - eyes[0]
    half = 0.5 * distance * way / max(1e-9, float(np.linalg.norm(way)))
    return np.stack((middle - half, middle + half))


def eyes_before(screens: Sequence[RoomScreen], distance: float) -> F64:
    """(2, 3) eyes of somebody who has not been seen yet: before the middle of the screens, twice as far as they are high."""
    if not screens:
        return np.zeros((2, 3))
    middle = np.mean([0.5 * (s.lower_right + s.upper_left) for s in screens], axis=0)
    right = np.mean([s.lower_right - s.lower_left for s in screens], axis=0)
    above = np.mean([s.upper_left - s.lower_left for s in screens], axis=0)
    back = np.cross(right, above)
    eye = middle + 2.0 * float(np.linalg.norm(above)) * back / max(1e-9, float(np.linalg.norm(back)))
    return eyes_apart(np.stack((eye - right, eye + right)), distance)


_ALL: Colours = (True, True, True)


def _shares(stereo: Stereo, box: Box, frame: int) -> list[tuple[int, Box, Colours]]:
    """Eye (0 left, 1 right, 2 between), box and colours of each picture within a screen's."""
    x, y, w, h = box
    if stereo in (Stereo.SIDE_BY_SIDE, Stereo.QUAD_BUFFER):
        return [(0, (x, y, w // 2, h), _ALL), (1, (x + w // 2, y, w - w // 2, h), _ALL)]
    if stereo is Stereo.TOP_BOTTOM:
        return [(0, (x, y + h // 2, w, h - h // 2), _ALL), (1, (x, y, w, h // 2), _ALL)]
    if stereo is Stereo.ANAGLYPH:
        return [(0, box, (True, False, False)), (1, box, (False, True, True))]
    if stereo is Stereo.SEQUENTIAL:
        return [(frame % 2, box, _ALL)]
    return [(2, box, _ALL)]


def fitted(part: Box, size: tuple[int, int], squeezed: bool = False) -> Box:
    """Where in a window of `size` a picture's part is shown as large as fits, its shape kept. squeezed: it holds two eyes'
    pictures of full width side by side, each of which gets half the window's."""
    _, _, w, h = part
    w = w // 2 if squeezed else w
    scale = min(size[0] / w, size[1] / h)
    width, height = round(w * scale), round(h * scale)
    return (size[0] - width) // 2, (size[1] - height) // 2, width, height
