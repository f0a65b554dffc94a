"""A wall of screens as somebody before it sees it: each screen's picture laid on it where it stands, seen from one eye."""

import math
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np

from docs.pictures.conferences.scenes import ROOT, Moment, choreographed, photograph
from vistel.arrays import F64, U8
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.render.figures.people import load_figure
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.view.camera import look_at
from vistel.render.view.screens import RoomScreen, Stereo, boxes, eyes_apart, picture_size

Prepare = Callable[[SceneRenderer], None]
Change = Callable[[Moment], Moment]

FILE = ROOT / "examples" / "conferences" / "v-wall.toml"
T_S, ANGLE = 2.0, math.radians(80.0)
DARK = 18
FINER = 2
"""How many times finer than the picture asked for the screens are laid out, before pixels are brought together."""


def before_the_wall(stereo: Stereo) -> Moment:
    """The first participant of the example with its wall before them."""
    moment = choreographed(FILE, 0, T_S)
    return replace(moment, view=replace(moment.view, stereo=stereo))


def shown(moment: Moment, light: str, prepare: Prepare | None = None) -> U8:
    """What is sent to the screens, packed into one picture."""
    return photograph(moment, *picture_size(moment.view.screens, moment.view.stereo), light, prepare)


def eyes_of(moment: Moment) -> F64:
    """(2, 3) pupils of the viewer [m, room]."""
    person = next(p for p in moment.instant.people if p.about.name == moment.view.eyes)
    joints = pose_joints(load_figure(person.about).skeleton, person.posture)
    return eyes_apart(joints.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]], moment.view.eye_distance)


def straight_ahead(eye: F64, screens: tuple[RoomScreen, ...], width: int, height: int) -> RoomScreen:
    """A screen that fills an eye's view of the wall, its middle that of the first seam."""
    camera = look_at(eye, 0.5 * (screens[0].lower_right + screens[1].upper_left), ANGLE)
    left, right, bottom, top = camera.edges(width / height)
    corners = (eye + camera.rotation @ np.array((x, y, -1.0)) for x, y in ((left, bottom), (right, bottom), (left, top)))
    return RoomScreen("eye", *corners, width, height)


def seen_from(eye: F64, side: int, moment: Moment, packed: U8, width: int, height: int) -> U8:
    """(height, width, 3) the screens with their share of `packed` for the left (0) or right (1) eye, as `eye` (3,) sees them."""
    screens, stereo = moment.view.screens, moment.view.stereo
    if stereo not in (Stereo.MONO, Stereo.SIDE_BY_SIDE):
        raise ValueError(f"the pictures of two eyes cannot be told apart in {stereo.value}")
    camera = straight_ahead(eye, screens, width, height).seen_from(eye)
    assert camera is not None, "the screen was laid before the eye"
    size = FINER * width, FINER * height
    light = np.full((size[1], size[0], 3), DARK / 255.0, np.float32)
    for screen, (x0, _, whole, h) in zip(screens, boxes(screens, stereo), strict=True):
        w = whole // 2 if stereo is Stereo.SIDE_BY_SIDE else whole
        x = x0 + side * (whole - w)
        corners = np.array(
            [screen.upper_left, screen.upper_left + screen.lower_right - screen.lower_left, screen.lower_right, screen.lower_left]
        )
        place = camera.project(corners, *size)[:, :2].astype(np.float32)
        matrix = cv2.getPerspectiveTransform(np.array(((0, 0), (w, 0), (w, h), (0, h)), np.float32), place)
        part = np.ascontiguousarray(packed[-h:, x : x + w]).astype(np.float32) / 255.0
        laid = cv2.warpPerspective(part, matrix, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        covers = cv2.fillConvexPoly(np.zeros((size[1], size[0]), np.uint8), np.round(place).astype(np.int32), 1)
        light = np.where(covers[..., None] > 0, laid, light)
    small = cv2.resize(light, (width, height), interpolation=cv2.INTER_AREA)
    return np.round(255.0 * small).astype(np.uint8)


def wall_seen(width: int, height: int, light: str = "fine", prepare: Prepare | None = None, change: Change | None = None) -> U8:
    """The example's wall, in stereo as its file says, as the left eye of who sits before it sees it. change: is made to what
    is drawn, not to the eye that sees it."""
    moment = before_the_wall(Stereo.SIDE_BY_SIDE)
    drawn = change(moment) if change is not None else moment
    return seen_from(eyes_of(moment)[0], 0, moment, shown(drawn, light, prepare), width, height)


__all__ = ["Stereo", "before_the_wall", "eyes_of", "seen_from", "shown", "straight_ahead", "wall_seen"]
