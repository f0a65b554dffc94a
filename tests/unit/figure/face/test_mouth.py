"""The mouth of built-in heads: skin cut along the lips, a bag behind it, and what each part follows when the jaw opens."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.lips import sides_of_mouth
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.shape import Expression
from vistel.figure.face.skin import FaceSkin
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.people.mouth import HALF, line, open_mouth

RULES = builtin_rules()


@pytest.fixture(scope="module")
def eva() -> Avatar:
    return builtin_avatar("builtin:seed=3", name="eva", height=1.70)


def ball(rings: int = 60, around: int = 120) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A closed head without features, where a head is."""
    polar = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    angle = np.arange(around) * 2.0 * np.pi / around
    grid = np.stack(
        np.broadcast_arrays(
            np.sin(polar)[:, None] * np.sin(angle), np.cos(polar)[:, None] + 0.0 * angle, np.sin(polar)[:, None] * np.cos(angle)
        ),
        axis=-1,
    )
    v = np.concatenate(([[0.0, 1.0, 0.0]], grid.reshape(-1, 3), [[0.0, -1.0, 0.0]])) * 0.095 + (0.0, 1.57, 0.0)
    t: list[tuple[int, int, int]] = []
    last = len(v) - 1
    for k in range(around):
        n = (k + 1) % around
        t += [(0, 1 + k, 1 + n), (last, last - around + n, last - around + k)]
        for r in range(rings - 2):
            a, b = 1 + r * around, 1 + (r + 1) * around
            t += [(a + k, b + k, b + n), (a + k, b + n, a + n)]
    return v, np.array(t)


def volume(v: NDArray[np.float64], t: NDArray[np.int64]) -> float:
    return float(np.einsum("fi,fi->", v[t[:, 0]], np.cross(v[t[:, 1]], v[t[:, 2]]))) / 6.0


def test_cutting_a_mouth_keeps_the_skin_closed_and_outside_out() -> None:
    v, t = ball()
    opened, faces, mouth = open_mouth(v, t)
    directed = np.concatenate((faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]))
    keys, back = directed @ (len(opened), 1), directed[:, ::-1] @ (len(opened), 1)
    assert len(np.unique(keys)) == len(keys)
    assert np.array_equal(np.sort(keys), np.sort(back))
    assert len(opened) - len(keys) // 2 + len(faces) == 2  # no handle: a pocket, not a pipe
    assert 0.97 * volume(v, t) < volume(opened, faces) < volume(v, t)
    edge = np.setdiff1d(np.unique(faces[mouth.face :]), np.arange(mouth.bag, len(opened)))
    assert np.abs(opened[edge, 1] - line(opened[edge, 0])).max() < 5e-5
    assert np.ptp(opened[edge, 0]) > 1.7 * HALF
    assert mouth.colour[mouth.bag :].max() > 200.0  # teeth


def test_skin_without_anything_where_a_mouth_should_be_is_refused() -> None:
    v, t = ball()
    with pytest.raises(ValueError, match="no line between lips"):
        open_mouth(v + np.array((0.0, 0.5, 0.0)), t)


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
