"""The body model: from looks to points; its file."""

from pathlib import Path

import numpy as np
import pytest

from vistel.figure.body_model.look import Look
from vistel.figure.body_model.model import FILE, BodyModelError, body_model, load, paired
from vistel.figure.making.parts import soundness


def test_its_skin_is_one_closed_surface_that_faces_outwards() -> None:
    model = body_model()
    sound = soundness(model.closed, model.body)
    assert (sound.border, sound.branching, sound.pieces) == (0, 0, 1)
    p = model.shape(Look()).points
    corner = p[model.closed]
    assert np.einsum("fi,fi->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) > 0.0


def test_soles_are_on_the_floor_and_the_left_arm_is_on_the_left() -> None:
    shape = body_model().shape(Look(male=1.0))
    assert shape.points[:, 1].min() == pytest.approx(0.0, abs=1e-9)
    assert 1.6 < shape.stature < 1.9
    assert shape.joints["left_hand"][0] > 0.3 > -0.3 > shape.joints["right_hand"][0]
    assert shape.eyes[0, 2] > shape.joints["head"][2]


def test_men_are_taller_than_women_and_both_than_children() -> None:
    model = body_model()
    man, woman, child = (model.shape(look).stature for look in (Look(1.0), Look(0.0), Look(0.5, age=6.0)))
    assert man > woman > child


def test_each_number_of_a_look_changes_the_body() -> None:
    model = body_model()
    usual = model.points(Look())
    for look in (
        Look(muscle=0.9),
        Look(weight=0.9),
        Look(height=0.9),
        Look(proportions=0.9),
        Look(origin=(1.0, 0.0, 0.0)),
        Look(age=60.0),
    ):
        assert np.abs(model.points(look) - usual).max() > 0.002
    for name in ("nose-hump", "measure-waist-circ", "ear-scale"):
        assert np.abs(model.points(Look(details={name: 1.0})) - model.points(Look(details={name: -1.0}))).max() > 0.002


def test_the_middle_level_keeps_most_vertices_round_the_eyes() -> None:
    model = body_model()
    shape = model.shape(Look())
    own = np.flatnonzero(np.isin(np.arange(model.body), model.levels[0].vertex))
    away = np.linalg.norm(shape.points[own, None] - shape.eyes, axis=2).min(axis=1)
    kept = np.isin(own, model.levels[1].vertex)
    assert kept[away < 0.02].mean() > 0.5 > kept.mean()


def test_weights_sum_to_one_and_levels_are_parts_of_the_finest() -> None:
    model = body_model()
    assert np.allclose(model.weight.sum(axis=1), 1.0, atol=1e-5)
    assert [len(level.corner_triangles) for level in model.levels[1:]] == [6000, 2600]
    for level in model.levels:
        assert level.vertex.max() < len(model.bone) and level.triangles.max() < len(level.vertex)
        assert level.uv.min() >= 0.0 and level.uv.max() <= 1.0


def test_it_has_arkits_52_face_units() -> None:
    names = body_model().units.names
    assert len(names) == 52 and {"jawOpen", "eyeBlinkLeft", "mouthSmileRight", "tongueOut"} <= set(names)


def test_opposite_targets_are_one_axis() -> None:
    assert paired(("a-decr", "a-incr", "b-in", "b-out", "c-round")) == {"a": (0, 1), "b": (2, 3), "c-round": (-1, 4)}


def test_a_file_that_was_changed_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "body.npz"
    path.write_bytes(FILE.read_bytes()[:-1])
    path.with_suffix(".md").write_text(FILE.with_suffix(".md").read_text("utf-8"), "utf-8")
    with pytest.raises(BodyModelError, match=r"not the file that body\.md beside it describes; make it anew with: make body-model"):
        load(path)
    with pytest.raises(BodyModelError, match="cannot be read"):
        load(tmp_path / "missing.npz")
