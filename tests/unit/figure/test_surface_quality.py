"""Measures of a posed skin: segments' volume, cross-sections, triangles that pass through others."""

from __future__ import annotations

import numpy as np
import pytest
from figure_fixture import capsule, tube_person

from benchmarks.figures.self_intersection import intersecting
from vistel.figure.limb_segments import SEGMENTS, cross_section, limb_segment
from vistel.figure.skeleton import JOINT_INDEX


@pytest.fixture(scope="module")
def person():
    return tube_person()


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_segment_of_a_tapering_tube_has_its_volume(person, side) -> None:
    mesh, body = person.mesh, person.body
    piece = limb_segment(person.skeleton, mesh.vertices, mesh.triangles, side, (("lower_arm", 0.2), ("lower_arm", 0.8)))
    i = body.names.index(f"{side}_forearm")
    r = body.radius_a[i] + np.array((0.2, 0.8)) * (body.radius_b[i] - body.radius_a[i])
    length = 0.6 * np.linalg.norm(person.skeleton.tip[JOINT_INDEX[f"{side}_lower_arm"]])
    cone = np.pi * length * (r[0] ** 2 + r[0] * r[1] + r[1] ** 2) / 3.0
    # A ring of twelve corners fills 95.5 % of its circle.
    assert piece.volume(mesh.vertices) == pytest.approx(0.955 * cone, rel=0.03)


def test_volume_does_not_depend_on_where_the_body_is_and_grows_with_its_cube(person) -> None:
    mesh = person.mesh
    piece = limb_segment(person.skeleton, mesh.vertices, mesh.triangles, "left", SEGMENTS["thigh"])
    volume = piece.volume(mesh.vertices)
    turn = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], np.float32)
    assert piece.volume(mesh.vertices @ turn + np.float32(2.0)) == pytest.approx(volume, rel=1e-5)
    assert piece.volume(1.1 * mesh.vertices) == pytest.approx(1.331 * volume, rel=1e-4)


def test_a_cross_section_is_a_ring_round_the_limb(person) -> None:
    mesh, i = person.mesh, person.body.names.index("left_forearm")
    ring = cross_section(person.skeleton, mesh.vertices, mesh.triangles, "left", ("lower_arm", 0.5))
    radius = 0.5 * (person.body.radius_a[i] + person.body.radius_b[i])
    least, mean = ring.radius(mesh.vertices)
    assert mean == pytest.approx(radius, rel=0.03)
    assert least > 0.93 * radius
    assert ring.area(mesh.vertices) == pytest.approx(0.955 * np.pi * radius**2, rel=0.03)


def test_nothing_is_cut_where_there_is_no_skin(person) -> None:
    mesh = person.mesh
    with pytest.raises(ValueError, match="no skin"):
        limb_segment(person.skeleton, mesh.vertices + 9.0, mesh.triangles, "left", SEGMENTS["forearm"])


def test_a_tube_through_another_is_found_and_tubes_apart_are_not() -> None:
    one, faces = capsule(np.array((-0.2, 0, 0)), np.array((0.2, 0, 0)), 0.05, 0.05)
    other, _ = capsule(np.array((0.013, -0.2, 0.007)), np.array((0.013, 0.2, 0.007)), 0.03, 0.03)
    both = np.concatenate([faces, faces + len(one)]).astype(np.int32)
    crossing = intersecting(np.concatenate([one, other]), both)
    assert crossing[: len(faces)].sum() > 4
    assert crossing[len(faces) :].sum() > 4
    assert not intersecting(np.concatenate([one, other + np.array((0, 0, 0.081))]), both).any()


def test_a_pair_that_crosses_is_found_in_whatever_order_and_neighbours_are_left_out() -> None:
    p = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, -0.5], [0.2, 0.2, 0.5], [0.3, 0.9, 0.5]]) * 0.1
    for triangles in ([[0, 1, 2], [3, 4, 5]], [[3, 5, 4], [2, 0, 1]]):
        assert intersecting(p, np.array(triangles, np.int32)).all()
    assert not intersecting(p, np.array([[0, 1, 2], [0, 4, 3]], np.int32)).any()
    assert not intersecting(p + np.array([[0, 0, 0]] * 3 + [[0, 0, 0.06]] * 3), np.array([[0, 1, 2], [3, 4, 5]], np.int32)).any()


def test_a_pair_that_crosses_by_less_than_asked_is_left_out() -> None:
    # An edge that reaches 4 mm through a face on the floor.
    p = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.02, 0.02, -0.004], [0.02, 0.02, 0.05], [0.03, 0.02, 0.05]])
    triangles = np.array([[0, 1, 2], [3, 4, 5]], np.int32)
    assert intersecting(p, triangles, 0.0039).all()
    assert not intersecting(p, triangles, 0.0041).any()
