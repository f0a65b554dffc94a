"""Draws docs/pictures/v-wall.png: a wall of two screens in a V. Above, what is sent to each screen, for one eye; below, the wall
as that eye sees it, both screens where they stand, and the same room without any screen.

    python docs/pictures/v_wall.py

Needs an OpenGL context (EGL without a display; software is fine).
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from implicit_render import font
from PIL import Image, ImageDraw

from vistel.conference.files import load
from vistel.conference.paths import RunPaths
from vistel.figure.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.room import meeting_room
from vistel_services.renderer.camera import Pinhole, look_at
from vistel_services.renderer.people import load_shape
from vistel_services.renderer.playout import Timing
from vistel_services.renderer.screens import Screen, Stereo, boxes
from vistel_services.renderer.service import configure
from vistel_services.renderer.stage import About, Instant, PersonNow
from vistel_services.renderer.studio import Studio, View
from vistel_services.renderer.world_view import WorldView
from vistel_sim.motion.open import open_motion

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "examples" / "conferences" / "v-wall.toml"
OUT = Path(__file__).parent / "v-wall.png"
T_S = 6.4
SIZE, ANGLE = (960, 540), math.radians(72.0)
GAP = 12
PAPER, INK, DARK = (250, 250, 248), (40, 44, 50), (18, 18, 20)


def instant(conference, view: View, t_s: float) -> Instant:
    """Everybody of the conference as the built-in choreography has them at `t_s`."""
    motion = open_motion(conference)
    people = []
    for site in conference.sites:
        for p in site.participants:
            about = About(p.name, p.display_name or p.name, p.avatar, p.height)
            people.append(PersonNow(about, motion.posture(p.name, t_s), Timing(0, 0, 0, False)))
    room = meeting_room(conference.room.seats)
    world = WorldView(1, {t.id: (t.position, t.rotation) for t in room.things})
    return Instant(0, tuple(people), world, {t.id: t for t in room.things})


def photograph(view: View, seats: int, moment: Instant) -> np.ndarray:
    """The picture of a view, first row at the top."""
    studio = Studio(view, seats, load_shape)
    picture = studio.render(moment)
    while not studio.complete:
        time.sleep(0.05)
        picture = studio.render(moment)
    studio.close()
    return picture[::-1, :, :3].copy()


def eye_of(view: View, moment: Instant) -> np.ndarray:
    """Between the viewer's eyes."""
    person = next(p for p in moment.people if p.about.name == view.eyes)
    joints = pose_joints(load_shape(person.about).skeleton, person.posture)
    return joints.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)


def before(eye: np.ndarray, target: np.ndarray) -> Screen:
    """A screen that fills an eye's view towards `target`."""
    camera = look_at(eye, target, ANGLE)
    left, right, bottom, top = camera.edges(SIZE[0] / SIZE[1])
    corners = (eye + camera.rotation @ np.array((x, y, -1.0)) for x, y in ((left, bottom), (right, bottom), (left, top)))
    return Screen("eye", *corners, *SIZE)


def seen(camera: Pinhole, screens: tuple[Screen, ...], picture: np.ndarray) -> np.ndarray:
    """The screens with what they show, where they stand, as `camera` sees them."""
    out = np.full((SIZE[1], SIZE[0], 3), DARK, np.uint8)
    for screen, (x, _, w, h) in zip(screens, boxes(screens), strict=True):
        shown = np.ascontiguousarray(picture[-h:, x : x + w])
        corners = np.array([screen.upper_left, screen.upper_left + screen.lower_right - screen.lower_left,
                            screen.lower_right, screen.lower_left])  # fmt: skip
        place = camera.project(corners, *SIZE)[:, :2].astype(np.float32)
        flat = np.array(((0, 0), (w, 0), (w, h), (0, h)), np.float32)
        matrix = cv2.getPerspectiveTransform(flat, place)
        warped = cv2.warpPerspective(shown, matrix, SIZE, flags=cv2.INTER_AREA)
        inside = cv2.warpPerspective(np.full((h, w), 255, np.uint8), matrix, SIZE)[..., None] / 255.0
        out = (inside * warped + (1.0 - inside) * out).astype(np.uint8)
    return out


def label(image: np.ndarray, text: str) -> Image.Image:
    out = Image.new("RGB", (image.shape[1], image.shape[0] + 26), PAPER)
    out.paste(Image.fromarray(image), (0, 26))
    ImageDraw.Draw(out).text((2, 3), text, font=font(15), fill=INK)
    return out


def main() -> None:
    conference = load(FILE)
    config = configure(conference, conference.sites[0], RunPaths(Path(), Path()))
    view = replace(config.view, stereo=Stereo.MONO)
    moment = instant(conference, view, T_S)
    packed = photograph(view, config.seats, moment)
    eye, seam = eye_of(view, moment), 0.5 * (view.screens[0].lower_right + view.screens[1].upper_left)
    straight = before(eye, seam)
    direct = photograph(replace(view, width=SIZE[0], height=SIZE[1], screens=(straight,)), config.seats, moment)
    camera = straight.seen_from(eye)
    assert camera is not None
    wall = seen(camera, view.screens, packed)
    left = label(wall, "the wall from the eye it was drawn for")
    right = label(direct, "the room itself from that eye")
    top = label(packed, "what the two screens show")
    scale = (left.width + GAP + right.width) / top.width
    top = top.resize((round(top.width * scale * 0.62), round(top.height * scale * 0.62)), Image.Resampling.LANCZOS)
    out = Image.new("RGB", (left.width + GAP + right.width, top.height + GAP + left.height), PAPER)
    out.paste(top, ((out.width - top.width) // 2, 0))
    out.paste(left, (0, top.height + GAP))
    out.paste(right, (left.width + GAP, top.height + GAP))
    out = out.resize((out.width * 5 // 8, out.height * 5 // 8), Image.Resampling.LANCZOS)
    out.quantize(256).save(OUT, optimize=True)


if __name__ == "__main__":
    main()
