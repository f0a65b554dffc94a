"""A figure as one layered implicit model, and as a scene file."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from figure_fixture import tube_person

import vistel.implicit as vi
from vistel.figure.layers.forces import surface_ratio
from vistel.figure.layers.model import LAYERS, LayeredModel, layered_model, smooth_curve
from vistel.figure.layers.places import Places
from vistel.figure.layers.scene_text import scene_text
from vistel.figure.layers.skin import Anatomy
from vistel.figure.posture.posture import ELBOW, Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.scene import load


@cache
def model(elbow: float, physical: bool = False) -> LayeredModel:
    avatar = tube_person()
    dofs = Posture().dofs.copy()
    dofs[ELBOW["left"]] = math.radians(elbow)
    joints = pose_joints(avatar.skeleton, Posture(dofs))
    return layered_model(avatar, Anatomy.of(Places(avatar)), joints, physical=physical)


def part(of: LayeredModel, name: str) -> vi.Shape:
    return next(p.shape for p in of.parts if p.name == name)


def test_every_layer_has_parts_and_names_are_one_of_a_kind() -> None:
    assert all(model(0.0).layer(layer) for layer in LAYERS)
    names = [p.name for p in model(0.0).parts]
    assert len(set(names)) == len(names)


def test_limbs_blend_with_what_is_theirs_and_joints_with_both_sides() -> None:
    parts, pairs = model(0.0).graph()
    index = {p.name: i for i, p in enumerate(parts)}
    edges = {frozenset(pair) for pair in pairs}
    skins = [i for i, p in enumerate(parts) if p.layer == "skin"]
    assert not any(frozenset((i, j)) in edges for i in skins for j in skins)
    (joint,) = (p for p in parts if p.name == "left_forearm_joint")
    assert len(joint.limbs) == 2
    biceps = index["left_biceps"]
    assert sum(frozenset((biceps, i)) in edges for i in skins) == 1
    assert frozenset((biceps, index["right_biceps"])) not in edges


@pytest.mark.parametrize("physical", [False, True])
def test_a_contracted_biceps_is_thicker_on_both_models(physical: bool) -> None:
    straight, bent = (part(model(d, physical), "left_biceps") for d in (0.0, 120.0))
    along_z = []
    for shape in (straight, bent):
        middle = shape.bounds.mean(axis=0)
        ray = middle + np.linspace(0.0, 0.06, 2000)[:, None] * np.array((0.0, 1.0, 0.0))
        along_z.append(float(np.argmin(shape.field(ray) >= vi.THRESHOLD)))
    assert along_z[1] > 1.08 * along_z[0]


def test_the_physical_belly_keeps_its_realm_and_moves_its_surface() -> None:
    rest, full = part(model(0.0, True), "left_biceps"), part(model(150.0, True), "left_biceps")
    assert np.allclose(np.ptp(rest.bounds, axis=0), np.ptp(full.bounds, axis=0), rtol=1e-9)
    assert surface_ratio(1.0) > surface_ratio(0.0)


def test_the_whole_figure_is_one_program_with_muscles_under_its_skin() -> None:
    whole = model(90.0).blended()
    program = vi.compile(whole)
    joints = pose_joints(tube_person().skeleton, Posture())
    hips = joints.position[JOINT_INDEX["hips"]]
    assert program.field(np.array([hips]))[0] > vi.THRESHOLD
    assert program.field(np.array([hips + np.array((0.0, 0.0, 1.0))]))[0] == 0.0
    points = hips + np.random.default_rng(0).normal(0.0, 0.2, (200, 3))
    assert np.allclose(program.field(points), whole.field(points), atol=2e-5)


def test_bare_layers_lie_within_one_another() -> None:
    straight = model(0.0)
    skin = straight.blended()
    for name in ("left_biceps", "left_vastus_lateralis"):
        middle = part(straight, name).bounds.mean(axis=0)
        assert skin.field(middle) > vi.THRESHOLD


@pytest.mark.parametrize("blended", [False, True])
def test_a_scene_file_holds_the_same_field(tmp_path, blended: bool) -> None:
    of = model(60.0, True)
    layers = ("skin", "joints", "muscles", "bones") if blended else ("bones", "muscles", "tendons")
    file = tmp_path / "figure.toml"
    file.write_text(scene_text(of, layers, blended=blended, eye=(0.0, 1.0, 4.0), target=(0.0, 1.0, 0.0)))
    scene = load(file)
    assert scene.program is not None
    expected = of.blended(layers) if blended else of.alone(*layers)
    points = np.random.default_rng(1).uniform((-0.9, 0.0, -0.3), (0.9, 1.8, 0.4), (4000, 3))
    assert np.allclose(scene.program.field(points), expected.field(points), atol=3e-5)


def test_a_smooth_curve_passes_through_its_places() -> None:
    points = np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 0.0, 1.0), (3.0, 0.5, 0.0)])
    curve = smooth_curve(points, 5)
    assert np.allclose(curve[::5], points)
    assert len(curve) == 16
