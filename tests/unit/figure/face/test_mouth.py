"""A mouth of skin cut along the lips with a bag behind it: what each part follows when the jaw opens."""

from __future__ import annotations

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.lips import sides_of_mouth
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.shape import Expression
from vistel.figure.face.skin import FaceSkin

RULES = builtin_rules()


@pytest.fixture(scope="module")
def eva() -> Avatar:
    return closed_person()


@pytest.mark.parametrize("level", [0, 1, 2])
def test_at_every_level_of_detail_the_lips_part_teeth_stay_with_their_jaw_and_nothing_tears(eva: Avatar, level: int) -> None:
    mesh = (eva, *eva.coarser)[level].mesh
    marks = landmarks_of(eva)
    side, inside = sides_of_mouth(mesh.vertices.astype(np.float64), mesh.triangles, marks)
    assert inside.sum() > 10
    skin = FaceSkin(mesh, marks)
    intensity = np.zeros(len(RULES.units))
    intensity[RULES.names.index("AU26")] = 1.0
    moved = np.zeros_like(mesh.vertices)
    moved[skin.vertex] = skin.shape.offsets(Expression(intensity))
    p = mesh.vertices.astype(np.float64)
    front = (np.abs(p[:, 0] - marks.between[0]) < 0.008) & (p[:, 2] > marks.between[2] - 0.004) & ~inside
    near = front & (np.abs(p[:, 1] - marks.between[1]) < 0.004)
    upper, lower = near & (side == 0.0), near & (side == 1.0)
    assert upper.any()
    assert lower.any()
    after = p + moved
    assert after[upper, 1].min() - after[lower, 1].max() > 0.012
    # Teeth are as stiff as teeth; the upper ones reach below the line between the lips.
    if level == 0:
        assert (inside & (side == 0.0) & (p[:, 1] < marks.between[1] - 0.002)).sum() > 5
    assert np.abs(moved[inside & (side == 0.0)]).max() < 1e-6
    middle = inside & (side == 1.0) & (np.abs(p[:, 0]) < 0.015)
    assert moved[middle, 1].max() < -0.008


def test_lips_close_over_a_jaw_that_is_half_open(eva: Avatar) -> None:
    mesh, marks = eva.mesh, landmarks_of(eva)
    skin = FaceSkin(mesh, marks)
    p = mesh.vertices[skin.vertex].astype(np.float64)
    side, inside = (x[skin.vertex] for x in sides_of_mouth(mesh.vertices.astype(np.float64), mesh.triangles, marks))
    lips = (np.abs(p[:, 0] - marks.between[0]) < 0.006) & (np.abs(p[:, 1] - marks.between[1]) < 0.003) & ~inside

    def gap(**strength: float) -> float:
        intensity = np.zeros(len(RULES.units))
        for name, value in strength.items():
            intensity[RULES.names.index(name)] = value
        after = (p + skin.shape.offsets(Expression(intensity)))[lips]
        return float(after[side[lips] == 0.0, 1].min() - after[side[lips] == 1.0, 1].max())

    assert gap(AU26=0.5) > 0.007
    assert gap(AU26=0.5, AU8=0.5) < 0.002
