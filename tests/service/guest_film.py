"""A built-in person before a webcam: pictures drawn in fine light, with the true places of their joints, and a film of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from vistel.capture.pointer import PointerCapture
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.posed import PosedFigure, builtin
from vistel.figure.posture.posture import JointPose, Posture, Stance, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.protocol.pages.pointer import Pointed, PointerDecoder, posture_record
from vistel.render.figures.cache import cached_figure
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import look_at
from vistel.render.view.view import View
from vistel.space.files.interior import Interior
from vistel.space.people import build_like
from vistel.space.room import Room

SIZE = (640, 480)
FIELD = math.radians(45.0)
"""Of the camera's picture, upright."""
AWAY_M = 1.0
BELOW_EYES_M = 0.12
"""Where the camera is: on top of a screen on a table."""
AT_CAMERA = -math.atan(BELOW_EYES_M / AWAY_M)
"""Pitch of a head that looks at it [rad]."""
SETTLE_S = 3.0
"""For a posture to be reached."""
RATE_HZ = 30
_NO_TIMING = Timing(0, 0, 0, False)


def led(*hands: tuple[float, float, float] | None, yaw: float = 0.0, pitch: float = AT_CAMERA) -> bytes:
    """A record of a page: where the palms go (left, right) in the seat's frame [m], where the head looks."""
    left, right = (None if hand is None else Pointed(hand) for hand in hands)
    return posture_record(yaw, pitch, left, right)


SITS = led(None, None)
RAISES = led((0.30, 1.22, 0.22), (-0.30, 1.22, 0.22))
HIGH, LOW = led((0.22, 1.28, 0.28), (-0.22, 1.28, 0.28)), led((0.24, 0.98, 0.34), (-0.24, 0.98, 0.34))


@dataclass(frozen=True)
class Still:
    """picture: (480, 640, 3) sRGB; posture, joints: what is true in it, in the seat's frame."""

    picture: np.ndarray
    posture: Posture
    joints: JointPose


def stills(figure: PosedFigure, does: Sequence[bytes]) -> list[Still]:
    """A picture of the person after each of these records."""
    skeleton = figure.avatar.skeleton
    person = PointerCapture("ann", build_like(Proportions.of(skeleton, figure.avatar.body)), Stance(np.zeros(3), 0.0))
    page, t_ns = PointerDecoder("ann"), 10**18
    renderer = SceneRenderer(
        View(*SIZE, "room", "", light="fine", names=False),
        3,
        lambda _: cached_figure(figure.avatar, wears=figure.wrinkles),
        Interior(Room((), (), shell=False)),
    )
    out: list[Still] = []
    try:
        renderer.painter.saves_shadows = False
        for said in does:
            posture = Posture()
            for _ in range(round(60 * SETTLE_S)):
                t_ns += 16_666_667
                for frame in page.feed(said, t_ns):
                    person.take(frame)
                posture = person.solve(t_ns)
            joints = pose_joints(skeleton, posture)
            if renderer.camera is None:
                eyes = 0.5 * (joints.position[JOINT_INDEX["left_eye"]] + joints.position[JOINT_INDEX["right_eye"]])
                at = np.array((0.0, eyes[1] - BELOW_EYES_M, eyes[2] + AWAY_M))
                renderer.camera = look_at(at, at - (0.0, 0.0, 1.0), FIELD)
            shown = PersonNow(ParticipantInfo("ann", ""), replace(posture, lids=np.ones(2)), _NO_TIMING)
            drawn = renderer.render_complete(Instant(1, (shown,), PlayoutWorld(1, {}), {}))
            out.append(Still(np.ascontiguousarray(drawn[::-1, :, :3]), posture, joints))
    finally:
        renderer.close()
    return out


def film(path: Path, shown: Sequence[tuple[Still, float]]) -> Path:
    """A film (motion JPEG) in which each picture stands for so many seconds; a browser's fake camera plays it again and again."""
    with path.open("wb") as file:
        for still, seconds in shown:
            done, data = cv2.imencode(".jpg", still.picture[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 92])
            assert done
            file.write(data.tobytes() * round(RATE_HZ * seconds))
    return path


def person(name: str) -> PosedFigure:
    """A built-in person."""
    return builtin(name)
