"""Faces in the renderer: marks move the skin on both engines, loudness where there are none, eyes meet on what they look at."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.audio.heard_voices import Speech
from vistel.figure.face.gaze import FARTHEST, converged, distance_looked_at
from vistel.figure.face.marks import REST, Expressions
from vistel.figure.posture.posture import NECK, Posture, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.messages.postures import posture_of
from vistel.protocol.live_link_face import CHANNELS
from vistel.render.figures.drawn import Corners, Planned
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.gpu_deform import GpuDeformer, GpuSkin
from vistel.render.gl.context import GlContext
from vistel.wire.motion import MotionSample, StalePart

pytestmark = pytest.mark.gl


@pytest.fixture(scope="module")
def eva() -> AvatarFigure:
    return AvatarFigure(closed_person())


def making(turned: float = 0.0, **channels: float) -> Posture:
    dofs = standing().dofs.copy()
    dofs[NECK] = (0.0, turned, 0.0)
    return Posture(dofs, face=Expressions(CHANNELS).marks([channels.get(name, 0.0) for name in CHANNELS]))


def drawn(person: AvatarFigure, posture: Posture, **more: float) -> tuple[np.ndarray, np.ndarray]:
    skin = person.pose(posture, **more).skin  # type: ignore[arg-type]
    assert isinstance(skin, Corners)
    return skin.positions.copy(), skin.normals.copy()


def test_an_open_mouth_moves_the_drawn_chin_and_the_normals_with_it(eva: AvatarFigure) -> None:
    (rest, straight), (opened, tilted) = drawn(eva, making()), drawn(eva, making(jawOpen=1.0))
    moved = np.linalg.norm(opened - rest, axis=1)
    assert moved.max() > 0.025
    assert moved[rest[:, 1] < 1.35].max() == 0.0
    assert np.linalg.norm(tilted - straight, axis=1)[moved > 0.01].mean() > 0.1
    assert np.abs(np.linalg.norm(tilted, axis=1) - 1.0).max() < 1e-3


def test_a_face_turns_with_its_head(eva: AvatarFigure) -> None:
    apart = [np.linalg.norm(drawn(eva, making(t, jawOpen=0.8))[0] - drawn(eva, making(t))[0], axis=1) for t in (0.0, 0.9)]
    assert np.abs(apart[0] - apart[1]).max() < 1e-4


def test_both_engines_make_the_same_face(eva: AvatarFigure, surface: GlContext) -> None:
    posture = making(0.5, jawOpen=0.5, browInnerUp=1.0, mouthSmileLeft=1.0)
    places, normals = drawn(eva, posture)
    skin = eva.pose(posture, planned=True).skin
    assert isinstance(skin, Planned)
    gpu, out = GpuSkin(GpuDeformer(surface.ctx), skin.shape), surface.ctx.buffer(reserve=24 * len(skin.shape.corner))
    gpu.run(skin.plan, out, skin.offsets)
    rows = np.frombuffer(out.read(), np.float32).reshape(-1, 6)
    assert np.abs(rows[:, :3] - places).max() < 5e-5
    assert np.quantile(np.linalg.norm(rows[:, 3:] - normals, axis=1), 0.995) < 0.06
    still = eva.pose(making(0.5), planned=True).skin
    assert isinstance(still, Planned)
    gpu.run(still.plan, out, still.offsets)
    rows = np.frombuffer(out.read(), np.float32).reshape(-1, 6)
    assert np.abs(rows[:, :3] - drawn(eva, making(0.5))[0]).max() < 5e-5
    gpu.release()


def test_who_is_heard_and_not_seen_moves_the_mouth(eva: AvatarFigure) -> None:
    silent = replace(making(), face=None)
    rest = drawn(eva, silent)[0]
    most = 0.0
    for k in range(60):
        spoken = eva.pose(silent, at_ns=k * 33_000_000, speech=Speech(-20.0)).skin
        assert isinstance(spoken, Corners)
        most = max(most, float(np.abs(spoken.positions - rest).max()))
    assert most > 0.003


def test_a_motion_whose_face_is_stale_carries_nothing_of_it() -> None:
    sample = MotionSample(1, 1, np.zeros(25), np.zeros((2, 20)), np.zeros(4), face=REST.ravel(), lids=np.ones(2))
    seen = posture_of(sample)
    assert seen.face is not None
    assert np.allclose(seen.face, REST)
    lost = posture_of(replace(sample, stale=StalePart.FACE | StalePart.GAZE))
    assert lost.face is None
    assert lost.lids is None


def test_eyes_meet_on_what_is_looked_at() -> None:
    skeleton = standard_skeleton(1.75)
    joints = pose_joints(skeleton, standing())
    eyes = [JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]
    middle = joints.position[eyes].mean(axis=0)
    cup, lamp = middle + np.array((0.01, 0.0, 0.5)), middle + np.array((1.5, 0.0, 1.5))
    away = distance_looked_at(joints, [cup, lamp])
    assert away == pytest.approx(0.5, abs=0.01)
    assert distance_looked_at(joints, [lamp]) == FARTHEST
    apart = float(np.linalg.norm(joints.position[eyes[0]] - joints.position[eyes[1]]))
    turned = pose_joints(skeleton, converged(standing(), apart, away))
    for eye in eyes:
        ray, to = turned.rotation[eye][:, 2], middle + np.array((0.0, 0.0, away)) - turned.position[eye]
        assert math.degrees(math.acos(min(1.0, float(ray @ to / np.linalg.norm(to))))) < 0.3
    looking = replace(standing(), gaze=np.array((0.3, -0.2)))
    far = pose_joints(skeleton, converged(looking, apart, FARTHEST))
    same = pose_joints(skeleton, looking)
    for eye in eyes:
        assert float(far.rotation[eye][:, 2] @ same.rotation[eye][:, 2]) > math.cos(math.radians(0.5))
