"""Lips of people as they are made: whoever looks at a face at rest sees no teeth."""

import numpy as np
import pytest

from vistel.figure.body_model.assemble import assemble
from vistel.figure.body_model.builtin_people import PEOPLE
from vistel.figure.body_model.model import body_model
from vistel.figure.body_model.person import fit
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.lips import foremost, line_of_lips, sides_of_mouth
from vistel.figure.face.marks import MARK_INDEX

SEEN_MM2 = 2.0
"""Of a mouth that is 17 to 2 mm2 open as the model has it."""
ACROSS, HIGH = np.linspace(-0.85, 0.85, 41), np.linspace(-0.003, 0.003, 61)


@pytest.mark.parametrize("name", ["aiko", "ben", "carla", "farah", "ines", "jonas"])
def test_lips_at_rest_leave_no_gap_through_which_one_sees_teeth(name: str) -> None:
    body = assemble(body_model(), fit(PEOPLE[name]).shape, name=name)
    mesh, marks = body.mesh, landmarks_of(body)
    p, triangles = mesh.vertices.astype(np.float64), mesh.triangles.astype(np.int64)
    _, inside = sides_of_mouth(p, triangles, marks)
    right, left = (marks.marks[MARK_INDEX[f"{side}_mouth_corner"]][0] for side in ("right", "left"))
    x = 0.5 * (left + right) + 0.5 * (left - right) * ACROSS
    line, _ = line_of_lips(np.column_stack([x, np.zeros((len(x), 2))]), marks)
    at = np.column_stack([np.repeat(x, len(HIGH)), (line[:, None] + HIGH).reshape(-1)])
    near = triangles[(np.abs(p[triangles] - marks.between) < 0.045).all(axis=(1, 2))]
    seen = foremost(p, near, at)
    assert (seen >= 0).all()
    gap = inside[near[seen]].any(axis=1).sum() * (x[1] - x[0]) * (HIGH[1] - HIGH[0])
    assert 1e6 * gap < SEEN_MM2
