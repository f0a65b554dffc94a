"""Faces with shapes of their own: the mouth is found, lips and lids stay on their sides."""

from dataclasses import replace
from functools import cache

import numpy as np

import vistel.figure
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.landmarks import Landmarks, landmarks_of
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.seal import LipSeal
from vistel.figure.face.shape import Expression, FaceShape
from vistel.figure.face.targets import meant


@cache
def _person() -> tuple[Avatar, Landmarks, FaceShape]:
    avatar = vistel.figure.person(height=1.7, weight=62.0, face_seed=1).avatar
    marks = landmarks_of(avatar)
    return avatar, marks, FaceShape(avatar.mesh.vertices, marks, None, avatar.mesh.triangles, avatar.mesh.targets)


def _expression(**units: float) -> Expression:
    rules = builtin_rules()
    return Expression(np.array([units.get(u.name, units.get(u.unit.name, 0.0)) for u in rules.units]))


def test_lips_meet_where_the_open_jaw_parts_them() -> None:
    avatar, marks, shape = _person()
    meanings = meant(t.name for t in avatar.mesh.targets)
    jaw = next(t for t in avatar.mesh.targets if t.name in meanings and meanings[t.name].unit == "AU26")
    moved = dict(zip(jaw.vertex.tolist(), (-jaw.offset[:, 1]).tolist(), strict=True))
    v = avatar.mesh.vertices
    for up, least, most in ((0.006, -1e-3, 0.004), (-0.006, 0.006, 1.0)):
        at = marks.between + np.array((0.0, up, 0.0))
        front = np.flatnonzero((np.abs(v[:, :2] - at[:2]).max(axis=1) < 0.003) & (v[:, 2] > marks.between[2] - 0.004))
        assert len(front) and all(least <= moved.get(int(k), 0.0) <= most for k in front)
    assert shape.landmarks.ball > 0.01


def test_lips_of_shapes_that_act_together_do_not_pass_through_each_other() -> None:
    _, _, shape = _person()
    seal = shape._seal  # pyright: ignore[reportPrivateUsage]
    assert isinstance(seal, LipSeal)

    def deepest(e: Expression, sealed: bool) -> float:
        p = shape._by_rules(e)  # pyright: ignore[reportPrivateUsage]
        if sealed:
            seal.part_lips(p)
        gap = np.einsum("nk,nk->n", seal.share, p[seal.above, 1]) - p[seal.lower, 1]
        return float((seal.free - gap).max())

    e = _expression(AU12=1.0, AU17=0.6, AU10=0.2)
    assert deepest(e, sealed=False) > 0.001
    assert deepest(e, sealed=True) < 0.6 * deepest(e, sealed=False)
    assert deepest(Expression.none(builtin_rules()), sealed=True) <= 1e-9


def test_lids_on_their_way_do_not_go_through_the_eyeball() -> None:
    _, marks, shape = _person()
    for opening in (0.6, 0.3, 0.0):
        offset = shape.offsets(replace(Expression.none(builtin_rules()), lids=(opening, opening)))
        p = np.asarray(shape._p[: len(offset)] + offset)  # pyright: ignore[reportPrivateUsage]
        away = np.linalg.norm(p - marks.eyes[0], axis=1)
        ahead = (p[:, 2] - marks.eyes[0][2]) > 0.8 * away
        before = np.linalg.norm(p - offset - marks.eyes[0], axis=1) > marks.ball
        lifted = (np.linalg.norm(offset, axis=1) > 0.003) & ahead & before & (away < 1.2 * marks.ball)
        assert lifted.any() and away[lifted].min() > 1.01 * marks.ball
