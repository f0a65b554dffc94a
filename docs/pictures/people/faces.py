"""Draws docs/pictures/face-*.png: action units on a built-in head in the renderer's light, in front and in profile, and the
shapes of a mouth that speaks; and wrinkle-renderer.png: bent sleeves as the renderer draws them.

    python -m docs.pictures.people.faces [--out FOLDER]

Needs an OpenGL context (EGL without a display; software is fine).
"""

import argparse
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from vistel.audio.heard_voices import Speech
from vistel.audio.visemes import VISEMES
from vistel.figure.face.intensities import LOUD_DB
from vistel.figure.face.marks import Expressions
from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.protocol.live_link_face import CHANNELS
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.view.camera import look_at

SIZE = 300
Case = tuple[dict[str, float], tuple[float, float], tuple[float, float]]
FRONT, SIDE = (0.22, 0.02, 0.72), (0.75, 0.02, 0.12)
OPEN, AHEAD = (1.0, 1.0), (0.0, 0.0)
UNITS: list[Case] = [
    ({}, OPEN, AHEAD),
    ({"browInnerUp": 1, "browOuterUp": 1}, OPEN, AHEAD),
    ({"browDown": 1}, OPEN, AHEAD),
    ({"mouthSmile": 1, "cheekSquint": 0.7}, OPEN, AHEAD),
    ({"jawOpen": 0.25}, OPEN, AHEAD),
    ({"jawOpen": 0.7}, OPEN, AHEAD),
    ({"mouthPucker": 0.8}, OPEN, AHEAD),
    ({}, (0.0, 0.0), AHEAD),
    ({}, (0.8, 0.8), (0.2, -0.35)),
    ({}, OPEN, (0.4, 0.25)),
]
PROFILE: list[Case] = [
    ({"browInnerUp": 1, "browOuterUp": 1}, OPEN, AHEAD),
    ({}, OPEN, AHEAD),
    ({"mouthSmile": 1, "cheekSquint": 0.9}, OPEN, AHEAD),
    ({"jawOpen": 0.5}, OPEN, AHEAD),
    ({}, (0.0, 0.0), AHEAD),
]


def sheet(avatar: str, cases: list[Case] | tuple[str, ...], away: tuple[float, float, float]) -> Image.Image:
    """Five to a row; of faces, or of visemes."""
    studio = SceneRenderer(View(SIZE, SIZE, "room", ""), 3)
    out = Image.new("RGB", (5 * SIZE, SIZE * -(-len(cases) // 5)))
    head = pose_joints(standard_skeleton(1.75), standing()).position[JOINT_INDEX["head"]] + np.array((0.0, 0.045, 0.05))
    studio.camera = look_at(head + np.array(away), head, 0.30)
    expressions = Expressions(CHANNELS)
    try:
        for n, case in enumerate(cases):
            speech, posture = {}, standing()
            if isinstance(case, str):
                speech = {"eva": Speech(LOUD_DB, np.eye(len(VISEMES))[VISEMES.index(case)])}
            else:
                channels, lids, gaze = case
                both = {side: value for name, value in channels.items() for side in (name, f"{name}Left", f"{name}Right")}
                marks = expressions.marks([both.get(name, 0.0) for name in CHANNELS])
                posture = replace(posture, face=marks, lids=np.array(lids), gaze=np.array(gaze))
            person = (PersonNow(ParticipantInfo("eva", "", avatar, 1.75), posture, Timing(0, 0, 0, False)),)
            picture = studio.render(Instant(1000 * n * 33_000_000, person, speech=speech))
            k = 1
            while k < 15 or not studio.complete:
                picture = studio.render(Instant((k + 1000 * n) * 33_000_000, person, speech=speech))
                time.sleep(0.0 if studio.complete else 0.05)
                k += 1
            out.paste(Image.fromarray(np.ascontiguousarray(picture[::-1, :, :3])), ((n % 5) * SIZE, (n // 5) * SIZE))
    finally:
        studio.close()
    return out


def sleeves() -> Image.Image:
    """Two people from two sides, arms bent, without wrinkles and with them."""
    out = Image.new("RGB", (4 * 360, 360))
    dofs = standing().dofs.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[ELBOW[side]] = math.radians(105.0)
        dofs[SHOULDER[side]] = (0.0, -sign * 0.5, -sign * 1.05)
    for n, avatar in enumerate(("builtin:person=carla", "builtin:person=ben")):
        for creased in (False, True):
            studio = SceneRenderer(View(360, 360, "room", "", wrinkles=creased), 3)
            studio.camera = look_at(np.array((0.9, 1.35, 0.9)), np.array((0.15, 1.2, 0.12)), 0.5)
            person = (PersonNow(ParticipantInfo("eva", "", avatar, 1.75), Posture(dofs), Timing(0, 0, 0, False)),)
            try:
                studio.render(Instant(0, person))
                while not studio.complete:
                    time.sleep(0.05)
                    studio.render(Instant(0, person))
                picture = studio.render(Instant(33_000_000, person))
            finally:
                studio.close()
            out.paste(Image.fromarray(np.ascontiguousarray(picture[::-1, :, :3])), ((2 * n + creased) * 360, 0))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    out = parser.parse_args().out
    for name, avatar, cases, away in (
        ("units", "builtin:person=carla", UNITS, FRONT),
        ("profile", "builtin:person=ben", PROFILE, SIDE),
        ("talking", "builtin:person=jonas", VISEMES, FRONT),
    ):
        sheet(avatar, cases, away).save(out / f"face-{name}.png", optimize=True)
    sleeves().save(out / "wrinkle-renderer.png", optimize=True)


if __name__ == "__main__":
    main()
