"""Wrinkles in the renderer's pictures: outline, cloth, light and what presses, whoever deforms the figure."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from avatar_fixture import closed_person
from numpy.typing import NDArray
from scipy.spatial import KDTree

from vistel.arrays import U8
from vistel.conference.model import Conference
from vistel.figure.posture.posture import ELBOW, Posture, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.render.config import render_config
from vistel.render.figures.drawn import Corners, FigureView, Planned
from vistel.render.figures.figures import AvatarFigure, PosedVertices, limb_rows
from vistel.render.figures.gpu_deform import GpuDeformer, GpuSkin
from vistel.render.gl.context import NoOpenGlError, open_surface
from vistel.render.painter import Frame, Painter
from vistel.render.view.camera import Camera, look_at
from vistel.render.view.screens import Sight
from vistel.wrinkle.wrinkle_sets import wrinkle_sets

pytestmark = pytest.mark.gl

SIZE = 360
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def eva() -> AvatarFigure:
    avatar = closed_person()
    return AvatarFigure(avatar, wears=[s for s in wrinkle_sets(["shirt"]) if s.region.name == "sleeve"])


class Drawing:
    """Draws one figure in the open."""

    def __init__(self) -> None:
        self.surface = open_surface()
        self.deformer = GpuDeformer(self.surface.ctx)
        self.painter = Painter(self.surface, SIZE, SIZE, self.deformer, fine=False)
        self.painter.saves_shadows = False

    def picture(self, person: AvatarFigure, posed: PosedVertices, camera: Camera, *, creased: bool = True) -> U8:
        folds = posed.folds if creased else None
        view = FigureView("eva", posed.model, posed.skin, limb_rows(posed.posed, person.casters), folds=folds)
        self.painter.draw(Frame([Sight(camera)], [view]))
        assert self.painter.error() == "GL_NO_ERROR"
        return self.painter.image()


@pytest.fixture(scope="module")
def drawing() -> Iterator[Drawing]:
    try:
        made = Drawing()
    except NoOpenGlError as e:
        pytest.skip(str(e))
    yield made
    made.surface.close()


def bent(degrees: float) -> Posture:
    dofs = standing().dofs.copy()
    dofs[ELBOW["left"]] = math.radians(degrees)
    return Posture(dofs)


def at_the_elbow(person: AvatarFigure, posture: Posture) -> Camera:
    """Sees the bent left sleeve from the front."""
    elbow = pose_joints(person.skeleton, posture).position[JOINT_INDEX["left_lower_arm"]]
    return look_at(elbow + np.array((0.9, 0.1, 0.5)), elbow + np.array((0.0, 0.0, 0.06)), 0.25)


def outline(picture: U8) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where the figure is, and the pixels of its edge."""
    figure = (picture != picture[-1, -1]).any(axis=2)
    inside = figure & np.roll(figure, 1, 0) & np.roll(figure, -1, 0) & np.roll(figure, 1, 1) & np.roll(figure, -1, 1)
    return figure, figure & ~inside


@pytest.mark.parametrize("planned", [False, True], ids=["cpu", "gpu"])
def test_the_outline_of_a_bent_sleeve_changes_in_the_picture_and_that_of_a_straight_one_does_not(
    planned: bool, eva: AvatarFigure, drawing: Drawing
) -> None:
    worn, mean, most = eva.wearing, {}, {}
    for degrees in (5.0, 110.0):
        posture = bent(degrees)
        camera = at_the_elbow(eva, posture)
        pictures: list[U8] = []
        for wearing in (None, worn):
            eva.wearing = wearing
            pictures.append(drawing.picture(eva, eva.pose(posture, planned=planned), camera))
        (plain, edge), (wrinkled, _) = (outline(p) for p in pictures)
        changed = np.argwhere(plain ^ wrinkled)
        mean[degrees] = len(changed) / float(edge.sum())
        most[degrees] = float(KDTree(np.argwhere(edge)).query(changed)[0].max()) if len(changed) else 0.0
        lit = np.abs(pictures[0].astype(int) - pictures[1]).max(axis=2)[plain & wrinkled] > 12
        assert lit.mean() == 0.0 if degrees < 10.0 else lit.mean() > 0.03
    # Pixels of 0.7 mm: on the average along the outline that is seen, and where it moved farthest.
    assert mean[5.0] == most[5.0] == 0.0
    assert mean[110.0] > 0.1
    assert most[110.0] > 1.5


def test_both_engines_draw_the_same_wrinkles(eva: AvatarFigure, drawing: Drawing) -> None:
    posture = bent(110.0)
    camera = at_the_elbow(eva, posture)
    one, other = (drawing.picture(eva, eva.pose(posture, planned=p), camera).astype(int) for p in (False, True))
    assert (np.abs(one - other).max(axis=2) > 12).mean() < 2e-3


def pressing(person: AvatarFigure, posture: Posture) -> tuple[GhostSource, NDArray[np.float64]]:
    """A ball that reaches below the skin at the highest fold."""
    worn, person.wearing = person.wearing, None
    bare = corners(person, posture)[0]
    person.wearing = worn
    free, normals = corners(person, posture)
    top = int(np.argmax(np.linalg.norm(free - bare, axis=1)))
    centre = (bare[top] + 0.044 * normals[top]).astype(np.float64)
    return ghosts_of(PrimitiveSet.of_kinds(["sphere"], [[0.05]], np.eye(3)[None], centre[None])), centre


def corners(person: AvatarFigure, posture: Posture, ghosts: tuple[GhostSource, ...] = ()) -> tuple[NDArray[np.float32], ...]:
    skin = person.pose(posture, ghosts).skin
    assert isinstance(skin, Corners)
    return skin.positions.copy(), skin.normals.copy()


def test_wrinkles_flatten_where_something_presses(eva: AvatarFigure) -> None:
    posture = bent(110.0)
    ball, centre = pressing(eva, posture)
    worn = eva.wearing
    raised, pressed = [], []
    for wearing in (None, worn):
        eva.wearing = wearing
        raised.append(corners(eva, posture)[0])
        pressed.append(corners(eva, posture, (ball,))[0])
    before, after = (np.linalg.norm(b - a, axis=1) for a, b in (raised, pressed))
    touched = (np.linalg.norm(raised[0] - centre, axis=1) < 0.05) & (before > 0.003)
    assert touched.sum() >= 2
    assert after[touched].max() < 0.2 * before[touched].max()
    far = np.linalg.norm(raised[0] - centre, axis=1) > 0.12
    assert np.abs(after[far] - before[far]).max() < 1e-5


def test_the_gpu_flattens_them_as_well(eva: AvatarFigure, drawing: Drawing) -> None:
    posture = bent(110.0)
    ball, _ = pressing(eva, posture)
    skin = eva.pose(posture, (ball,), planned=True).skin
    assert isinstance(skin, Planned)
    gpu = GpuSkin(drawing.deformer, skin.shape)
    out = drawing.surface.ctx.buffer(reserve=24 * len(skin.shape.corner))
    gpu.run(skin.plan, out)
    there = np.frombuffer(out.read(), np.float32).reshape(-1, 6)[:, :3]
    assert np.abs(there - corners(eva, posture, (ball,))[0]).max() < 5e-5
    gpu.release()


def test_cloth_remembers_a_bend_for_a_while_and_then_forgets_it(eva: AvatarFigure) -> None:
    for k in range(120):
        eva.pose(bent(120.0), at_ns=k * SECOND // 20)
    deep = eva.wearing.whole.names.index("left_sleeve_deep") if eva.wearing else 0
    seen = [eva.pose(bent(5.0), at_ns=6 * SECOND + k * SECOND).folds for k in range(1, 121)]
    weights = [float(w[deep]) for w in seen if w is not None]
    assert 0.2 < weights[0] < 0.5
    assert all(b <= a for a, b in pairwise(weights))
    assert weights[-1] < 0.02


def test_the_display_of_a_site_switches_them(tmp_path: Path) -> None:
    for shown in (True, False):
        conference = Conference.model_validate(
            {"sites": [{"name": "tokyo", "participants": [{"name": "aiko"}], "display": {"wrinkles": shown}}]}
        )
        assert render_config(conference, conference.sites[0]).view.wrinkles is shown
