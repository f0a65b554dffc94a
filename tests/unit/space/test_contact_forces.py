"""Contacts as forces: golden values, and what every patch promises."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vistel.implicit as vi
from vistel.geometry.rotation import matrix_from_rotvec
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.ghosts.actuation import muscle_force, power_warp
from vistel.space.contact.forces import ContactParameters, ContactPatch, Motion, contact_patches

GOLDEN = {
    row["name"]: row
    for row in json.loads((Path(__file__).parents[2] / "golden.json").read_text())["values"]
    if row["group"] in ("forces", "collision")
}
T = vi.THRESHOLD
EDGE = float(vi.QUARTIC.inverse(T))


def one(kind: str, params: list[float], at: object, turn: object = (0, 0, 0)) -> PrimitiveSet:
    r = matrix_from_rotvec(np.array(turn, float))
    return PrimitiveSet.of_kinds([kind], [params], r[None], np.array([at], float))


def balls(d: float, radius: float = EDGE) -> tuple[PrimitiveSet, PrimitiveSet]:
    return one("sphere", [radius], (0, 0, 0)), one("sphere", [radius], (d, 0, 0))


def golden(name: str) -> float:
    row = GOLDEN[name]
    i = row["inputs"]
    if name.startswith("moebius warp"):
        return vi.QUARTIC.actuated(i["xstar"]).warp
    if name.startswith("moebius f_b"):
        return float(vi.QUARTIC.actuated(i["xstar"])(0.3))
    if name.startswith("muscle"):
        return muscle_force(i["xstar"])
    if name.startswith("power"):
        return power_warp(i["xstar"])
    (patch,) = contact_patches(*balls(i["D"]))
    if "normal_force" in name:
        return patch.normal_force
    if "contact_area" in name:
        return patch.area
    if "disc_radius" in name:
        return math.sqrt(patch.area / math.pi)
    a = vi.Sphere((0, 0, 0), i["r"])
    middle = np.array([i["D"] / 2, 0.0, 0.0])
    if name.startswith("pressure_exact"):
        return float(a.field(middle)) - T
    at = middle if "at contact" in name else np.array([EDGE, 0.0, 0.0])
    return (EDGE - i["D"] / 2) * float(np.linalg.norm(a.gradient(at)))


NAMES = [n for n, row in GOLDEN.items() if row["group"] == "forces"]
NAMES += ["two_spheres.contact_area", "two_spheres.contact_disc_radius"]


@pytest.mark.parametrize("name", NAMES)
def test_golden_forces(name: str) -> None:
    assert golden(name) == pytest.approx(GOLDEN[name]["expected"], abs=GOLDEN[name]["tolerance"])


def test_every_golden_force_is_tried() -> None:
    assert len(NAMES) == 14


SHAPES = {
    "sphere": [0.5],
    "cone_sphere": [-0.4, 0, 0, 0.4, 0, 0, 0.4, 0.3],
    "superellipsoid": [0.5, 0.4, 0.45, 0.3, 0.4],
    "rounded_polygon": [0.3, -0.4, 0, -0.4, -0.4, 0, 0.4, 0.4, 0, 0.4, 0.4, 0, -0.4],
    "supertoroid": [0.2, 0.2, 0.25, 2.0, 1.0, 1.0],
}
_turn = st.tuples(*[st.floats(-2, 2)] * 3)


@given(
    st.sampled_from(sorted(SHAPES)),
    st.sampled_from(sorted(SHAPES)),
    _turn,
    st.tuples(*[st.floats(-0.8, 0.8)] * 3),
    st.floats(0.05, 3.0),
    st.floats(0.05, 3.0),
)
@settings(max_examples=60, deadline=None)
def test_patches_are_finite_push_apart_and_lie_in_both_bodies(
    kind_a: str, kind_b: str, turn: tuple[float, ...], at: tuple[float, ...], c_a: float, c_b: float
) -> None:
    a, b = one(kind_a, SHAPES[kind_a], (0, 0, 0)), one(kind_b, SHAPES[kind_b], at, turn)
    for patch in contact_patches(a, b, c_a, c_b, surface=ContactParameters(1.0, 0.6, 0.3)):
        numbers = np.concatenate([patch.point, patch.normal, patch.force, patch.torque, [patch.area, patch.normal_force]])
        assert np.isfinite(numbers).all()
        assert patch.area > 0
        assert patch.force @ patch.normal <= 0
        assert np.linalg.norm(patch.normal) == pytest.approx(1.0)
        assert 0 < patch.mean_pressure <= patch.peak_pressure + 1e-12
        assert patch.peak_pressure <= (1 - T) / min(max(c_a, 0.02), max(c_b, 0.02)) + 1e-9
        assert np.linalg.norm(patch.friction) <= 0.6 * patch.mean_pressure * patch.area * 1.3 + 1e-9


@given(_turn, st.tuples(*[st.floats(-0.45, 0.45)] * 3))
@settings(max_examples=40, deadline=None)
def test_the_order_of_the_bodies_does_not_matter(turn: tuple[float, ...], at: tuple[float, ...]) -> None:
    a, b = one("cone_sphere", SHAPES["cone_sphere"], (0, 0, 0)), one("sphere", [0.35], np.array(at) + np.array((0, 0.4, 0)), turn)
    one_way, other_way = contact_patches(a, b, 1.0, 0.5, angles=48), contact_patches(b, a, 0.5, 1.0, angles=48)
    assert len(one_way) == len(other_way)
    for p, q in zip(one_way, other_way, strict=True):
        scale = max(p.normal_force, 1e-6)
        np.testing.assert_allclose(p.force, -q.force, atol=2e-3 * scale)
        assert p.area == pytest.approx(q.area, rel=2e-3)


def test_the_force_is_that_of_the_overlap_and_turns_with_the_bodies() -> None:
    forces = [contact_patches(*balls(d))[0].normal_force for d in (1.05, 1.0, 0.9, 0.8)]
    assert np.all(np.diff(forces) > 0)
    assert contact_patches(*balls(2 * EDGE + 1e-6)) == []
    r = matrix_from_rotvec(np.array((0.3, -1.1, 0.7)))
    (straight,) = contact_patches(*balls(0.9))
    (turned,) = contact_patches(*(s.moved(r, np.array((3.0, -2.0, 1.0))) for s in balls(0.9)))
    np.testing.assert_allclose(turned.force, r @ straight.force, atol=1e-12)
    assert turned.area == pytest.approx(straight.area, rel=1e-12)


def test_a_stiffer_body_is_pressed_less() -> None:
    (soft,), (stiff,) = contact_patches(*balls(0.9), 1.0, 1.0), contact_patches(*balls(0.9), 1.0, 0.1)
    assert stiff.point[0] < soft.point[0]  # the surface moves into the soft one
    assert stiff.normal_force > soft.normal_force


def test_friction_opposes_sliding_and_keeps_to_coulombs_cone() -> None:
    moving = Motion(np.array((0.0, 2.0, 0.0)), np.zeros(3), np.zeros(3))
    (patch,) = contact_patches(*balls(0.9), motion_a=moving, surface=ContactParameters(1.0, 0.4, 0.0))
    assert patch.friction[1] < 0
    assert abs(patch.friction[1]) == pytest.approx(0.4 * patch.normal_force, rel=1e-3)
    (still,) = contact_patches(*balls(0.9), surface=ContactParameters(1.0, 0.4, 0.0))
    assert np.all(still.friction == 0.0)


def test_a_spinning_body_is_braked_about_the_contact() -> None:
    spinning = Motion(np.zeros(3), np.array((5.0, 0.0, 0.0)), np.zeros(3))
    (patch,) = contact_patches(*balls(0.9), motion_a=spinning, surface=ContactParameters(1.0, 0.5, 0.0))
    assert patch.torque_about(np.zeros(3))[0] < -1e-4
    np.testing.assert_allclose(patch.friction, 0.0, atol=1e-12)  # all round: no net force


def test_damping_pushes_more_when_closing_and_never_pulls() -> None:
    closing, parting = (Motion(np.array((v, 0.0, 0.0)), np.zeros(3), np.zeros(3)) for v in (1.0, -50.0))
    surface = ContactParameters(1.0, 0.0, 0.5)
    forces = [-contact_patches(*balls(0.9), motion_a=m, surface=surface)[0].force[0] for m in (closing, parting)]
    assert forces[0] > contact_patches(*balls(0.9))[0].normal_force
    assert forces[1] == 0.0


def test_a_body_of_two_primitives_counts_each_point_of_its_surface_once() -> None:
    two = PrimitiveSet.join([one("sphere", [EDGE], (0, 0, 0)), one("sphere", [EDGE], (0, 0.0, 0))])
    _, b = balls(0.9)
    area = sum(p.area for p in contact_patches(two, b))
    assert area == pytest.approx(GOLDEN["two_spheres.contact_area"]["expected"], rel=1e-9)


def test_balls_in_one_spot_give_finite_forces() -> None:
    for patch in contact_patches(*balls(0.0)) + contact_patches(*balls(1e-12)):
        assert isinstance(patch, ContactPatch)
        assert np.isfinite(patch.force).all()
