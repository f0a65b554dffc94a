"""Deformation under odd input, and what random contact poses may leave."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.implicit.meshes.embedding import Limbs, embed, primitive_field

SLOPE = 4.0 * SURFACE_RATIO * (1.0 - SURFACE_RATIO**2)
"""-dF / d(distance / influence radius) of the quartic at the surface."""


def sphere(centre, radius, compliance=1.0) -> GhostSource:
    shape = PrimitiveSet.of_kinds(["sphere"], [[radius]], np.eye(3)[None], np.array([centre], float))
    return ghosts_of(shape, compliance=compliance)


class Rod:
    """A capsule of radius r along X from -0.1 to 0.1 with a mesh of about 600 vertices, rigidly placed."""

    def __init__(self, radius=0.04, turn=None, shift=(0.0, 0.0, 0.0)):
        turn = np.eye(3) if turn is None else turn
        around, along = 20, 30
        x, angle = np.linspace(-0.1, 0.1, along), np.arange(around) * 2 * np.pi / around
        out = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
        rest = (x[:, None, None] * np.array([1.0, 0, 0]) + radius * out[None]).reshape(-1, 3)
        i, j = np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij")
        k = (j + 1) % around
        p, q, r, s = i * around + j, i * around + k, (i + 1) * around + k, (i + 1) * around + j
        self.triangles = np.concatenate([np.stack([p, q, r], -1).reshape(-1, 3), np.stack([p, r, s], -1).reshape(-1, 3)]).astype(
            np.int32
        )
        ends = np.array([[-0.1, 0, 0]]), np.array([[0.1, 0, 0]])
        size = np.array([radius])
        embedding = embed(rest.astype(np.float32), np.zeros(len(rest), np.int32), Limbs(*ends, size, size, np.zeros(1, np.int32)))
        self.embedding, self.deformer = embedding, Deformer(self.triangles, embedding)
        self.rest = (rest @ turn.T + shift).astype(np.float32)
        self.normals = (np.tile(out, (along, 1)) @ turn.T).astype(np.float32)
        self.a, self.b = ends[0] @ turn.T + shift, ends[1] @ turn.T + shift

    def deform(self, *ghosts, normals=None, vertices=None):
        v = (self.rest if vertices is None else vertices).copy()
        n = (self.normals if normals is None else normals).copy()
        return v, n, self.deformer.deform(v, n, self.a, self.b, ghosts)

    def field(self, points):
        e = self.embedding
        limbs = Limbs(self.a, self.b, e.limbs.radius_a, e.limbs.radius_b, e.limbs.group)
        return primitive_field(points.astype(np.float64), limbs, e.fit, 0)


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 10**6))
def test_no_vertex_is_left_deeper_than_a_thousandth_of_the_radius(seed):
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    away = rng.normal(size=3) * (0.3, 1.0, 1.0)
    one = Rod(0.05)
    two = Rod(0.04, turn, away / np.linalg.norm(away) * rng.uniform(0.055, 0.095))
    for mine, other in ((one, two), (two, one)):
        vertices, _, _ = mine.deform(other.deformer.ghosts(other.a, other.b))
        over = (other.field(vertices) - mine.field(vertices))[mine.deformer.lost == 0]
        depth = over.max() / SLOPE * mine.embedding.fit.reach[0]  # in radii
        assert depth <= 1e-3


def test_normals_that_point_inwards_do_not_turn_the_skin_inside_out():
    rod = Rod()
    ball = sphere((0.0, 0.08, 0.0), 0.05)
    expected, _, _ = rod.deform(ball)
    vertices, _, report = rod.deform(ball, normals=-rod.normals)
    assert report.lost == 0
    np.testing.assert_allclose(vertices, expected, atol=2e-6)


def test_vertices_without_a_normal_stay_and_are_flagged():
    rod = Rod()
    normals = rod.normals.copy()
    deepest = int(np.argmin(np.linalg.norm(rod.rest - (0.0, 0.04, 0.0), axis=1)))
    normals[deepest] = 0.0
    vertices, _, _ = rod.deform(sphere((0.0, 0.08, 0.0), 0.05), normals=normals)
    np.testing.assert_array_equal(vertices[deepest], rod.rest[deepest])
    assert rod.deformer.lost[deepest]
    assert np.count_nonzero(rod.deformer.lost) == 1


def test_a_vertex_that_is_not_finite_spoils_no_other():
    rod = Rod()
    ball = sphere((0.0, 0.08, 0.0), 0.05)
    expected, _, _ = rod.deform(ball)
    given_vertices = rod.rest.copy()
    deepest = int(np.argmin(np.linalg.norm(rod.rest - (0.0, 0.04, 0.0), axis=1)))
    given_vertices[deepest] = np.nan
    vertices, _, report = rod.deform(ball, vertices=given_vertices)
    fine = np.ones(len(vertices), bool)
    fine[deepest] = False
    np.testing.assert_allclose(vertices[fine], expected[fine], atol=2e-6)
    assert report.lost <= 1


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_ghost_that_is_not_finite_moves_nothing(bad):
    rod = Rod()
    vertices, _, _ = rod.deform(sphere((0.0, bad, 0.0), 0.05))
    np.testing.assert_array_equal(vertices, rod.rest)


def test_duplicate_vertices_and_triangles_without_area_do_no_harm():
    rod = Rod()
    vertices = np.concatenate([rod.rest, rod.rest[:40]])
    triangles = np.concatenate([rod.triangles, [[0, 0, 1], [600, 600, 600], [2, 602, 2]]]).astype(np.int32)
    e = embed(vertices, np.zeros(len(vertices), np.int32), rod.embedding.limbs)
    deformer = Deformer(triangles, e)
    moved, normals = vertices.copy(), np.concatenate([rod.normals, rod.normals[:40]])
    report = deformer.deform(moved, normals, rod.a, rod.b, [sphere((-0.1, 0.06, 0.0), 0.05)])
    assert report.moved > 10
    assert np.isfinite(moved).all()
    assert np.isfinite(normals).all()
    np.testing.assert_allclose(moved[600:640], moved[:40], atol=1e-5)


def test_primitives_that_swallow_a_body_flag_it_and_leave_it_in_its_room():
    rod = Rod()
    vertices, normals, report = rod.deform(sphere((0.0, 0.0, 0.0), 0.5), sphere((0.0, 0.0, 0.0), 0.01, 0.0))
    assert report.lost > 0
    assert np.isfinite(vertices).all()
    assert np.isfinite(normals).all()
    assert np.max(np.linalg.norm(vertices - rod.rest, axis=1)) < 0.05


def test_fifty_bodies_in_one_spot_flag_what_cannot_be_solved():
    rod = Rod()
    shapes = PrimitiveSet.of_cone_spheres(rod.a, rod.b, np.array([0.04]), np.array([0.04]))
    vertices, _, report = rod.deform(*[ghosts_of(shapes) for _ in range(50)])
    assert np.isfinite(vertices).all()
    assert np.max(np.linalg.norm(vertices - rod.rest, axis=1)) < 0.05
    assert report.delta.max() < 1e-3 or report.moved > 0


def test_a_thing_of_a_hundred_primitives_is_felt_whole():
    rod = Rod()
    x = np.linspace(-0.1, 0.1, 100)
    centres = np.stack([x, np.full(100, 0.065), 0 * x], axis=1)
    shapes = PrimitiveSet.of_kinds(["sphere"] * 100, [[0.03]] * 100, np.tile(np.eye(3), (100, 1, 1)), centres)
    vertices, _, report = rod.deform(ghosts_of(shapes, compliance=0.0))
    assert report.lost == 0
    top = np.abs(rod.rest[:, 2]) < 1e-4
    top &= rod.rest[:, 1] > 0
    assert np.all(vertices[top][:, 1] < rod.rest[top][:, 1] - 1e-3)
