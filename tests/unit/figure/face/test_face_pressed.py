"""Something presses on a face: the skin gives way there, and nothing else is thrown about."""

from __future__ import annotations

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.marks import MARK_INDEX
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of

RADIUS = 0.03


@pytest.fixture(scope="module")
def eva() -> Avatar:
    return closed_person()


def ball(centre: np.ndarray) -> GhostSource:
    return ghosts_of(PrimitiveSet.of_kinds(["sphere"], [[RADIUS]], np.eye(3)[None], centre[None]), compliance=0.0)


def test_a_cheek_gives_way_to_what_presses_and_nose_and_teeth_stay(eva: Avatar) -> None:
    figure, marks = Figure(eva), landmarks_of(eva)
    state = figure.pose(standing())
    rest = state.vertices.copy()
    at = marks.marks[MARK_INDEX["left_cheek"]] + state.joints.position[JOINT_INDEX["head"]] - eva.skeleton.rest[JOINT_INDEX["head"]]
    out = np.array((0.75, 0.0, 0.66))
    centre = at + (RADIUS - 0.008) * out / np.linalg.norm(out)
    pressed = figure.pose(standing(), [ball(centre)]).vertices
    before, after = (np.linalg.norm(p - centre, axis=1) for p in (rest, pressed))
    assert (before < RADIUS).sum() > 10
    assert after.min() > RADIUS - 2e-4
    moved = np.linalg.norm(pressed - rest, axis=1)
    assert moved[before < RADIUS].max() > 0.005
    assert moved[before > RADIUS].max() < 0.012
    assert moved[before > 2.2 * RADIUS].max() < 0.006
