"""The deformation of meshes: golden solves, shared contact surfaces, untouched vertices, odd input."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.implicit.meshes.embedding import Limbs, embed, primitive_field

GOLDEN = json.loads((Path(__file__).parents[3] / "golden.json").read_text())["values"]


def golden(start: str, **inputs: float) -> dict:
    """The one golden value whose name starts so, with these inputs."""
    rows = [r for r in GOLDEN if r["name"].startswith(start) and all(r["inputs"][k] == v for k, v in inputs.items())]
    assert len(rows) == 1
    return rows[0]


def capsule_limbs(a, b, radius) -> Limbs:
    return Limbs(np.array([a], float), np.array([b], float), np.array([radius]), np.array([radius]), np.zeros(1, np.int32))


def bumpy(a, b, radius, seed, n=900, bump=0.0):
    """Vertices and outward normals on a cylinder (no caps), triangles by strips."""
    rng = np.random.default_rng(seed)
    around, along = 30, n // 30
    axis = np.asarray(b, float) - a
    w = axis / np.linalg.norm(axis)
    u = np.cross(w, [0.3, 0.5, 0.8])
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    turn = np.arange(around) * 2 * np.pi / around
    out = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    s = np.linspace(0, 1, along)
    r = radius * (1 + bump * rng.uniform(-1, 1, (along, around, 1)))
    p = np.asarray(a) + s[:, None, None] * axis + r * out[None]
    normal = np.broadcast_to(out, p.shape)
    i, j = np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij")
    k = (j + 1) % around
    corners = [i * around + j, i * around + k, (i + 1) * around + k, (i + 1) * around + j]
    t = np.concatenate([np.stack([corners[0], corners[1], corners[2]], -1), np.stack([corners[0], corners[2], corners[3]], -1)])
    return (
        p.reshape(-1, 3).astype(np.float32),
        np.ascontiguousarray(normal.reshape(-1, 3), np.float32),
        t.reshape(-1, 3).astype(np.int32),
    )


class Rod:
    """A deformable capsule with its mesh."""

    def __init__(self, a, b, radius, seed, bump=0.0):
        self.limbs = capsule_limbs(a, b, radius)
        self.rest, self.normal, triangles = bumpy(a, b, radius, seed, bump=bump)
        self.embedding = embed(self.rest, np.zeros(len(self.rest), np.int32), self.limbs)
        self.deformer = Deformer(triangles, self.embedding)

    def deform(self, *ghosts):
        vertices, normals = self.rest.copy(), self.normal.copy()
        report = self.deformer.deform(vertices, normals, self.limbs.a, self.limbs.b, ghosts)
        return vertices, normals, report

    def ghost(self):
        return self.deformer.ghosts(self.limbs.a, self.limbs.b)

    def field(self, p):
        return primitive_field(np.asarray(p, float), self.limbs, self.embedding.fit, 0)


def sphere(centre, radius, compliance=1.0, depth=-1.0):
    shape = PrimitiveSet.of_kinds(["sphere"], [[radius]], np.eye(3)[None], np.array([centre], float))
    return ghosts_of(shape, compliance=compliance, depth=depth)


def test_golden_vertex_solve():
    row = golden("vertex solve")
    limbs = capsule_limbs((-1, 0, 0), (1, 0, 0), 0.5 * SURFACE_RATIO)
    p = np.array([[0, 0.3, 0], [0.9, 0.3, 0], [0, 0, 0.3]], np.float32)
    n = np.array([[0, 1, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    deformer = Deformer(np.array([[0, 1, 2]], np.int32), embed(p, np.zeros(3, np.int32), limbs))
    moved = p.copy()
    deformer.deform(moved, n.copy(), limbs.a, limbs.b, [sphere((0, 0.6, 0), 0.7 * SURFACE_RATIO, depth=0.2 / 3)])
    assert moved[0, 1] - 0.3 == pytest.approx(row["expected"], abs=1e-5)
    np.testing.assert_array_equal(moved[1], p[1])


@pytest.mark.parametrize("degrees, ye", [(60, 0.5), (60, 0.2), (45, 0.3), (40, 0.2)])
def test_golden_bulge_beside_the_contact_of_two_spheres(degrees, ye):
    row = golden(f"two_spheres.bulged_radius_{degrees}deg", ye=ye)
    limbs = Limbs(np.zeros((1, 3)), np.zeros((1, 3)), np.array([SURFACE_RATIO]), np.array([SURFACE_RATIO]), np.zeros(1, np.int32))
    angle = np.radians(degrees)
    n = np.array([[np.cos(angle), np.sin(angle), 0], [-1, 0, 0], [0, 0, 1]], np.float32)
    p = (n * SURFACE_RATIO).astype(np.float32)
    deformer = Deformer(np.array([[0, 1, 2]], np.int32), embed(p, np.zeros(3, np.int32), limbs))
    moved = p.copy()
    deformer.deform(moved, n.copy(), limbs.a, limbs.b, [sphere((0.9, 0, 0), SURFACE_RATIO, depth=ye / 3)])
    assert np.linalg.norm(moved[0]) == pytest.approx(row["expected"], abs=1e-5)


@pytest.mark.parametrize("w", [0.5, 0.25, 0.1, 0])
def test_golden_contact_of_unequal_compliances(w):
    row = golden("rigidity.contact_x", w=w)
    limbs = Limbs(np.zeros((1, 3)), np.zeros((1, 3)), np.array([SURFACE_RATIO]), np.array([SURFACE_RATIO]), np.zeros(1, np.int32))
    n = np.eye(3, dtype=np.float32)
    p = n * np.float32(SURFACE_RATIO)
    deformer = Deformer(np.array([[0, 1, 2]], np.int32), embed(p, np.zeros(3, np.int32), limbs))
    moved = p.copy()
    deformer.deform(moved, n.copy(), limbs.a, limbs.b, [sphere((0.9, 0, 0), SURFACE_RATIO, compliance=2 * w)])
    assert moved[0, 0] == pytest.approx(row["expected"], abs=2e-5)


def test_nothing_moves_when_nothing_touches():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0, bump=0.1)
    for ghosts in ((), (sphere((0, 1, 0), 0.1),), (sphere((0.15, 0.16, 0), 0.1),)):
        vertices, normals, report = rod.deform(*ghosts)
        np.testing.assert_array_equal(vertices, rod.rest)
        np.testing.assert_array_equal(normals, rod.normal)
        assert report.moved == 0


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 0.05))
def test_two_limbs_share_their_contact_surface_and_never_overlap(seed, bump):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    a = Rod((0, 0, 0), (0.3, 0, 0), rng.uniform(0.03, 0.05), seed, bump)
    across = np.cross(direction, [1, 0, 0])
    across /= np.linalg.norm(across)
    middle = np.array((0.15, 0, 0)) + across * rng.uniform(0.05, 0.08)
    b = Rod(middle - 0.15 * direction, middle + 0.15 * direction, rng.uniform(0.03, 0.05), seed + 1, bump)
    for one, other in ((a, b), (b, a)):
        vertices, _, report = one.deform(other.ghost())
        assert np.isfinite(vertices).all()
        own, theirs = one.field(vertices), other.field(vertices)
        moved = one.deformer.moved > 0
        pushed = moved & (one.field(one.rest) < own - 1e-5) & (one.embedding.weight * theirs > T)
        if report.lost == 0:
            assert np.all(np.abs(own - theirs)[pushed] <= 1e-4)
            # Whoever is inside the other's undeformed body is on the contact surface, not beyond it.
            assert np.all((theirs - own)[theirs * one.embedding.weight > T + 1e-3] <= 2e-4)
        np.testing.assert_array_equal(vertices[~moved], one.rest[~moved])


def test_a_rigid_ball_is_touched_exactly_at_its_surface_and_the_skin_bulges_round_it():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0)
    centre, radius = np.array((0.15, 0.07, 0.0)), 0.05
    vertices, _, report = rod.deform(sphere(centre, radius, compliance=0.0))
    distance = np.linalg.norm(vertices - centre, axis=1)
    assert report.lost == 0
    assert distance.min() > radius - 2e-5
    assert np.count_nonzero(np.abs(distance - radius) < 2e-5) > 10
    grown = np.linalg.norm(vertices[:, 1:], axis=1) - np.linalg.norm(rod.rest[:, 1:], axis=1)
    assert grown.max() > 2e-4


def test_the_bulge_grows_from_nothing_as_the_bodies_come_together():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0)
    raised = []
    for depth in np.linspace(0.0, 0.01, 11):
        vertices, _, _ = rod.deform(sphere((0.15, 0.09 - depth, 0.0), 0.05))
        raised.append(float(np.max(np.linalg.norm(vertices[:, 1:], axis=1)) - 0.04))
    assert raised[0] < 1e-6
    assert np.max(np.abs(np.diff(raised))) < 6e-4
    assert raised[-1] > raised[3] > 0.0


def test_the_skin_is_smooth_across_the_contact_circle():
    """C1 (mathematics M3.3): along the rod's top line the slope does not jump where the contact begins."""
    limbs = capsule_limbs((0, 0, 0), (0.4, 0, 0), 0.04)
    x = np.linspace(0.1, 0.3, 801)
    p = np.stack([x, np.full_like(x, 0.04), 0 * x], axis=1).astype(np.float32)
    n = np.broadcast_to(np.float32([0, 1, 0]), p.shape).copy()
    index = np.arange(len(x) - 2)
    deformer = Deformer(np.stack([index, index + 1, index + 2], 1).astype(np.int32), embed(p, np.zeros(len(x), np.int32), limbs))
    moved = p.copy()
    deformer.deform(moved, n, limbs.a, limbs.b, [sphere((0.2, 0.1, 0), 0.08)])
    height = moved[:, 1].astype(float)
    kernel = np.ones(9) / 9
    slope = np.diff(np.convolve(height, kernel, "valid")) / (x[1] - x[0])
    assert np.ptp(slope) > 0.2
    assert np.max(np.abs(slope[8:] - slope[:-8])) < 0.12


def test_many_bodies_in_one_spot_neither_explode_nor_give_nan():
    rng = np.random.default_rng(0)
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0)
    ghosts = [sphere(rng.normal(size=3) * 0.02 + (0.15, 0.03, 0), 0.05, float(c)) for c in rng.uniform(0, 2, 50)]
    vertices, normals, report = rod.deform(*ghosts)
    assert np.isfinite(vertices).all()
    assert np.isfinite(normals).all()
    assert np.max(np.linalg.norm(vertices - rod.rest, axis=1)) <= 0.08
    assert report.lost > 0


def test_penetration_past_the_skeleton_is_flagged_and_stays_in_the_limb():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0)
    vertices, _, report = rod.deform(sphere((0.15, 0.0, 0), 0.1, compliance=0.0))
    assert report.lost > 0
    assert np.max(np.linalg.norm(vertices[:, 1:], axis=1)) < 0.08


def test_a_ghost_with_a_target_acts_on_nothing_else():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0)
    ball = PrimitiveSet.of_kinds(["sphere"], [[0.05]], np.eye(3)[None], np.array([[0.15, 0.07, 0]]))
    _, _, off = rod.deform(ghosts_of(ball, target=np.array([False])))
    _, _, on = rod.deform(ghosts_of(ball, target=np.array([True])))
    assert off.moved == 0
    assert on.moved > 0


def test_the_same_frame_twice_is_the_same_to_the_last_bit():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0, bump=0.05)
    ball = sphere((0.15, 0.07, 0), 0.05)
    first, _, _ = rod.deform(ball)
    rod.deform(sphere((0.1, 0.0, 0.06), 0.05), sphere((0.2, 0.0, 0.06), 0.05))
    again, _, _ = rod.deform(ball)
    np.testing.assert_array_equal(first, again)


def test_solves_take_few_evaluations():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0, bump=0.05)
    _, _, report = rod.deform(sphere((0.15, 0.08, 0), 0.05))
    assert report.moved > 20
    assert report.evaluations <= 6.0


def test_normals_follow_the_moved_surface():
    rod = Rod((0, 0, 0), (0.3, 0, 0), 0.04, 0)
    vertices, normals, _ = rod.deform(sphere((0.15, 0.07, 0), 0.05, 0.0))
    deepest = np.argmin(np.linalg.norm(vertices - (0.15, 0.02, 0), axis=1))
    assert rod.deformer.moved[deepest]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-4)
    away = (0.15, 0.07, 0) - vertices[deepest]
    assert normals[deepest] @ away / np.linalg.norm(away) > 0.9
