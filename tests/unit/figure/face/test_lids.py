"""Eyes close: seen from the front and from the side no eyeball looks out between the lids."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from avatar_fixture import closed_person
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure import builtin
from vistel.figure.face.landmarks import EYEBALL, landmarks_of
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.shape import Expression, FaceShape

RULES = builtin_rules()
HEADS = {name: (lambda name=name: builtin(name).avatar) for name in ("carla", "ben", "jonas")} | {"of a file": closed_person}


def seen_of_the_ball(skin: F64, triangles: NDArray[np.int64], centre: F64, ball: float, aside: float) -> int:
    """How many of the parallel lines of sight that come in from `aside` [rad] to the wearer's left meet the ball before skin."""
    c, s = np.cos(aside), np.sin(aside)
    turned = (skin - centre) @ np.array(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)))
    near = turned[triangles[(np.linalg.norm(turned, axis=1) < 3.0 * ball)[triangles].all(axis=1)]]
    steps = np.linspace(-0.98 * ball, 0.98 * ball, 61)
    x, y = (g.ravel() for g in np.meshgrid(steps, steps))
    inside = x * x + y * y < (0.98 * ball) ** 2
    x, y = x[inside], y[inside]
    foremost = np.full(len(x), -np.inf)
    for a, b, d in near:
        area = (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0])
        if abs(area) < 1e-12:
            continue
        v = ((b[0] - x) * (d[1] - y) - (b[1] - y) * (d[0] - x)) / area
        w = ((d[0] - x) * (a[1] - y) - (d[1] - y) * (a[0] - x)) / area
        u = 1.0 - v - w
        hit = (v >= -1e-6) & (w >= -1e-6) & (u >= -1e-6)
        depth = v * a[2] + w * b[2] + u * d[2]
        foremost[hit] = np.maximum(foremost[hit], depth[hit])
    return int((np.sqrt(ball * ball - x * x - y * y) > foremost).sum())


@pytest.mark.parametrize("head", HEADS)
def test_no_eye_is_seen_between_closed_lids_from_the_front_or_the_side(head: str) -> None:
    avatar = HEADS[head]()
    marks = landmarks_of(avatar)
    shape = FaceShape(avatar.mesh.vertices, marks, None, avatar.mesh.triangles, avatar.mesh.targets)
    still = Expression.none(RULES)
    rest = avatar.mesh.vertices.astype(np.float64)
    closed = rest.copy()
    closed[shape.vertex] += shape.offsets(replace(still, lids=(0.0, 0.0)))
    triangles, ball = avatar.mesh.triangles.astype(np.int64), EYEBALL * marks.scale
    for eye, outward in zip(marks.eyes, (1.0, -1.0), strict=True):
        for aside in (0.0, 0.5 * outward, 1.0 * outward):
            before = seen_of_the_ball(rest, triangles, eye, ball, aside)
            assert before > 150
            assert seen_of_the_ball(closed, triangles, eye, ball, aside) <= 0.02 * before
