"""Muscles and bones under a figure's skin."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from figure_fixture import tube_person
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.figure import Figure
from vistel.figure.layers.contraction import activation, belly_length, thickening
from vistel.figure.layers.layer_kernels import LEAST, MOST
from vistel.figure.layers.places import Places
from vistel.figure.layers.skin import Anatomy, SkinLayers
from vistel.figure.posture.posture import ELBOW, KNEE, SHOULDER, Posture, pose_joints, standing

LENGTHS = st.floats(0.5, 1.6)


@cache
def layered() -> Figure:
    figure = Figure(tube_person())
    figure.layers = SkinLayers(figure)
    return figure


def layers() -> SkinLayers:
    found = layered().layers
    assert found is not None
    return found


def bent(degrees: float, hang: float = 0.0) -> Posture:
    """Both elbows."""
    dofs = Posture().dofs.copy()
    for side, sign in (("left", -1.0), ("right", 1.0)):
        dofs[ELBOW[side]] = math.radians(degrees)
        dofs[SHOULDER[side]] = (0.0, 0.0, sign * math.radians(hang))
    return Posture(dofs)


def values(posture: Posture) -> dict[str, float]:
    layered().pose(posture)
    return dict(zip(layers().names, layers().values.tolist(), strict=True))


@settings(max_examples=25, deadline=None)
@given(LENGTHS)
def test_a_belly_keeps_its_volume(ratio: float) -> None:
    for muscle in layers().anatomy.muscles.muscles[:18]:
        assert muscle.belly.at_length(ratio).volume == pytest.approx(muscle.belly.volume, rel=1e-12)


@given(st.tuples(LENGTHS, LENGTHS))
def test_the_shorter_a_muscle_the_more_active_and_the_thicker(pair: tuple[float, float]) -> None:
    short, long = sorted(pair)
    assert activation(short) >= activation(long)
    thick = [float(thickening(belly_length(r, activation(r)))) for r in (short, long)]
    assert thick[0] >= thick[1]
    assert activation(1.0) == 0.0


def test_nothing_moves_at_rest() -> None:
    figure = layered()
    under = figure.layers
    figure.layers = None
    bare = figure.pose(Posture()).vertices.copy()
    figure.layers = under
    assert np.abs(figure.pose(Posture()).vertices - bare).max() < 1e-7
    assert max(abs(v) for v in values(Posture()).values()) < 1e-9


def test_a_figure_without_its_layers_is_what_it_was() -> None:
    figure, fresh = layered(), Figure(tube_person())
    under, posture = figure.layers, bent(130.0, 70.0)
    with_layers = figure.pose(posture).vertices.copy()
    figure.layers = None
    assert np.array_equal(figure.pose(posture).vertices, fresh.pose(posture).vertices)
    figure.layers = under
    assert np.array_equal(figure.pose(posture).vertices, with_layers)
    assert np.abs(with_layers - fresh.pose(posture).vertices).max() > 2e-3


def test_biceps_bulges_and_elbow_shows_the_more_the_elbow_bends() -> None:
    seen = [values(bent(d)) for d in range(0, 151, 5)]
    for name in ("left_biceps", "left_brachioradialis", "left_elbow"):
        course = np.array([v[name] for v in seen])
        assert np.all(np.diff(course) >= -1e-6), name
        assert course[-1] > 0.7
        assert np.abs(np.diff(course)).max() < 0.15, f"{name} pops"
    assert seen[20]["left_triceps"] < -0.2
    assert all(LEAST - 1e-6 <= x <= MOST + 1e-6 for v in seen for x in v.values())


def test_calves_and_hamstrings_shorten_and_thighs_lengthen_on_bent_knees() -> None:
    dofs = Posture().dofs.copy()
    dofs[KNEE] = math.radians(90.0)
    seen = values(Posture(dofs))
    assert seen["left_calf_inner"] > 0.1
    assert seen["left_vastus_medialis"] < -0.1
    assert seen["left_knee"] > 0.5


def test_fists_show_knuckles_and_tighten_the_forearm() -> None:
    hands = np.zeros((2, 20))
    hands[:, 4::4] = hands[:, 6::4] = math.radians(80.0)
    seen = values(Posture(hands=hands))
    assert seen["right_middle_knuckle"] > 0.9
    assert seen["right_forearm_flexors"] > 0.5 > seen["right_forearm_extensors"]


def test_an_arm_overhead_lifts_trapezius_and_deltoid() -> None:
    down, up = values(bent(0.0, 75.0)), values(bent(0.0, -75.0))
    for name in ("left_trapezius", "left_deltoid_middle"):
        assert up[name] > 0.1, name
        assert down[name] < 0.0, name


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1.2, 1.2), min_size=8, max_size=8))
def test_left_and_right_do_the_same(angles: list[float]) -> None:
    dofs = Posture().dofs.copy()
    x, y, z = angles[:3]
    dofs[SHOULDER["left"]], dofs[SHOULDER["right"]] = (x, y, z), (x, -y, -z)
    dofs[ELBOW["left"]] = dofs[ELBOW["right"]] = abs(angles[3]) * 2.0
    dofs[KNEE] = abs(angles[4])
    seen = values(Posture(dofs))
    for name, value in seen.items():
        if name.startswith("left_"):
            assert value == pytest.approx(seen["right_" + name[5:]], abs=2e-2), name


def test_the_kernel_says_what_the_plain_formulas_say() -> None:
    joints = pose_joints(layered().avatar.skeleton, bent(95.0, 40.0))
    muscles = layers().anatomy.muscles
    stretch = muscles.stretch(joints)
    full = float(thickening(belly_length(0.65, 1.0))) - 1.0
    expected = (thickening(belly_length(stretch, activation(stretch))) - 1.0) / full
    layered().pose(bent(95.0, 40.0))
    assert np.allclose(layers().values[: len(muscles)], np.clip(expected, LEAST, MOST), atol=1e-5)
    shown = [bone.value(joints) for bone in layers().anatomy.bones]
    assert np.allclose(layers().values[len(muscles) :], shown, atol=1e-5)


def test_normals_follow_the_skin_that_layers_move() -> None:
    figure = layered()
    state = figure.pose(bent(110.0))
    assert np.allclose(np.linalg.norm(state.normals, axis=1), 1.0, atol=2e-3)


def test_a_person_of_any_height_has_muscles_in_proportion() -> None:
    small, large = (Anatomy.of(Places(tube_person(height))).muscles for height in (1.2, 1.9))
    assert np.allclose(large.rest_length / small.rest_length, 1.9 / 1.2, rtol=0.02)
    assert np.allclose([m.section for m in large.muscles], [m.section * (1.9 / 1.2) ** 2 for m in small.muscles], rtol=1e-6)


def test_standing_moves_no_vertex_far() -> None:
    figure = layered()
    under = figure.layers
    now = figure.pose(standing()).vertices.copy()
    figure.layers = None
    moved = np.linalg.norm(now - figure.pose(standing()).vertices, axis=1)
    figure.layers = under
    assert moved.max() < 0.012
