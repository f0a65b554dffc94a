"""Skeletons are placed where the mesh is, whatever mesh it is, and what is embedded by them deforms."""

import numpy as np
import pytest
from avatar_fixture import closed_person
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.implicit.meshes.embedding import embed
from vistel.implicit.meshes.placement import place_in_parts, place_skeletons
from vistel.implicit.scene.mesh_file import read_polygons


def tube(a, b, ra, rb, along=24, around=20, caps=True):
    """A cone-sphere's mesh: vertices, triangles that face outwards."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    length = float(np.linalg.norm(b - a))
    u = (b - a) / length
    v = np.cross(u, (0.3, 0.5, 0.8))
    v /= np.linalg.norm(v)
    w = np.cross(u, v)
    x = np.linspace(0.0, length, along)
    r = ra + (rb - ra) * x / length
    if caps:
        angle = np.linspace(0.05, 0.45 * np.pi, 6)
        x = np.concatenate([-ra * np.cos(angle), x, length + rb * np.cos(angle[::-1])])
        r = np.concatenate([ra * np.sin(angle), r, rb * np.sin(angle[::-1])])
    turn = np.arange(around) * 2.0 * np.pi / around
    ring = np.cos(turn)[:, None] * v + np.sin(turn)[:, None] * w
    points = (a + x[:, None, None] * u + r[:, None, None] * ring).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(len(x) - 1), np.arange(around), indexing="ij")
    k = (j + 1) % around
    p, q, s, t = i * around + j, i * around + k, (i + 1) * around + k, (i + 1) * around + j
    quads = [np.stack([p, q, s], -1), np.stack([p, s, t], -1)]
    return points, np.concatenate(quads).reshape(-1, 3)[:, ::-1].astype(np.int32)


def together(*meshes):
    first = np.cumsum([0] + [len(v) for v, _ in meshes])
    return np.concatenate([v for v, _ in meshes]), np.concatenate([t + n for (_, t), n in zip(meshes, first, strict=False)])


@given(st.integers(0, 10**6))
@settings(max_examples=25)
def test_the_mesh_of_a_cone_sphere_gets_that_cone_sphere(seed):
    rng = np.random.default_rng(seed)
    a, direction = rng.normal(size=3), rng.normal(size=3)
    ra, rb = rng.uniform(0.05, 0.1, 2)
    b = a + direction / np.linalg.norm(direction) * rng.uniform(0.3, 0.8)
    placed = place_skeletons(*tube(a, b, ra, rb), 1)
    assert placed.mean_distance < 0.004
    ends = np.array([placed.limbs.a[0], placed.limbs.b[0]])
    if np.linalg.norm(ends[0] - a) > np.linalg.norm(ends[0] - b):
        ends = ends[::-1]
    np.testing.assert_allclose(ends, [a, b], atol=0.03)


def test_pieces_that_do_not_hang_together_get_skeletons_of_their_own():
    legs = [tube((x, 0, 0), (x, 0.8, 0), 0.06, 0.08) for x in (-0.12, 0.12)]
    placed = place_skeletons(*together(*legs), 2)
    assert sorted(np.round(placed.limbs.a[:, 0], 2)) == [-0.12, 0.12]
    assert placed.mean_distance < 0.004
    assert not placed.limbs.adjacent


def test_given_parts_keep_their_vertices():
    legs = [tube((x, 0, 0), (x, 0.8, 0), 0.06, 0.08) for x in (-0.12, 0.12)]
    part = np.repeat([1, 0], [len(v) for v, _ in legs])
    placed = place_in_parts(*together(*legs), part)
    np.testing.assert_array_equal(placed.limb, part)
    assert placed.limbs.a[0, 0] > 0 > placed.limbs.a[1, 0]


@pytest.mark.parametrize("count, most", [(23, 0.008), (60, 0.004)])
def test_a_person_is_held_closely(count, most):
    mesh = closed_person(1.75).mesh
    placed = place_skeletons(mesh.vertices, mesh.triangles, count)
    assert placed.limbs.groups == count
    assert placed.mean_distance <= most
    for a, b, c in placed.limb[mesh.triangles[::50]].tolist():
        for i, k in ((a, b), (b, c), (c, a)):
            assert i == k or (min(i, k), max(i, k)) in placed.limbs.adjacent


def test_an_animal_from_elsewhere_is_held_closely(shared_data):
    vertices, faces = read_polygons(shared_data / "poly/spot/spot_triangulated.obj")
    placed = place_skeletons(vertices, np.array(faces, np.int32), 23)
    assert placed.mean_distance < 0.01 * np.ptp(vertices, axis=0).max()


def spoilt(kind):
    """A capsule's mesh with something wrong."""
    v, t = tube((0, 0, 0), (0.6, 0, 0), 0.1, 0.08)
    if kind == "open":
        return tube((0, 0, 0), (0.6, 0, 0), 0.1, 0.08, caps=False)
    if kind == "flipped":
        return v, t[:, ::-1].copy()
    if kind == "twice":
        return np.concatenate([v, v]), np.concatenate([t, t + len(v)]).astype(np.int32)
    if kind == "loose vertices":
        return np.concatenate([v, v[:5]]), t
    flat = t.copy()
    flat[::7, 1] = flat[::7, 0]
    return v, flat


@pytest.mark.parametrize("kind", ["open", "flipped", "twice", "loose vertices", "flat triangles"])
def test_meshes_that_are_not_clean_are_placed_embedded_and_deformed(kind):
    vertices, triangles = spoilt(kind)
    placed = place_skeletons(vertices, triangles, 4)
    assert np.isfinite([placed.limbs.a, placed.limbs.b]).all()
    assert placed.mean_distance < 0.01
    deformer = Deformer(triangles, embed(vertices.astype(np.float32), placed.limb, placed.limbs))
    moved = vertices.astype(np.float32)
    out = moved - np.stack([np.clip(moved[:, 0], 0, 0.6), 0 * moved[:, 0], 0 * moved[:, 0]], axis=1)
    normals = (out / np.linalg.norm(out, axis=1, keepdims=True)).astype(np.float32)
    ball = PrimitiveSet.of_kinds(["sphere"], [[0.08]], np.eye(3)[None], np.array([[0.3, 0.13, 0.0]]))
    report = deformer.deform(moved, normals, placed.limbs.a, placed.limbs.b, [ghosts_of(ball)])
    assert report.moved > 20
    assert np.isfinite(moved).all()
    np.testing.assert_array_equal(moved[deformer.moved == 0], vertices.astype(np.float32)[deformer.moved == 0])


def test_what_cannot_be_placed_is_reported():
    v, t = tube((0, 0, 0), (0.6, 0, 0), 0.1, 0.08)
    with pytest.raises(ValueError, match="at least 1 primitive"):
        place_skeletons(v, t, 0)
    with pytest.raises(ValueError, match="vertex 3 is not finite"):
        place_skeletons(np.where(np.arange(len(v))[:, None] == 3, np.nan, v), t, 2)
    with pytest.raises(ValueError, match="none of them empty"):
        place_in_parts(v, t, np.full(len(v), 1))
    assert place_skeletons(v, t, 10_000).limbs.groups < len(v) / 12
