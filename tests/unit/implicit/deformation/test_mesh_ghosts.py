"""Constraints, dents and force fields on meshes: the same surfaces as the fields of shapes have."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import vistel.implicit as vi
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.contacts.penetration import penetration
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.implicit.ghosts.composition import Imprint, collisions, deformed
from vistel.implicit.ghosts.constraint import Constraint
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.force_field import Directional, Force, Shear, compression, expansion
from vistel.implicit.ghosts.mesh_ghosts import blown, dents, faded, pulled
from vistel.implicit.ghosts.temporal import ContactMemory, Decay, Plastic
from vistel.implicit.meshes.embedding import Limbs, embed

RADIUS = 0.1
BOX = ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


class Rod:
    """A capsule along X with a mesh on its surface, and the same as a body of shapes."""

    def __init__(self) -> None:
        start, end = np.array((-0.15, 0.0, 0.0)), np.array((0.15, 0.0, 0.0))
        along, around = np.linspace(-0.24, 0.24, 64), 2 * np.pi * np.arange(48) / 48
        axis = np.clip(along, -0.15, 0.15)
        out = np.sqrt(RADIUS**2 - (along - axis) ** 2)
        ring = out[:, None] * np.cos(around), out[:, None] * np.sin(around)
        rest = np.stack([np.broadcast_to(along[:, None], (64, 48)), *ring], -1)
        away = (rest - np.stack([axis, 0 * axis, 0 * axis], -1)[:, None]).reshape(-1, 3) / RADIUS
        rest = rest.reshape(-1, 3)
        i, j = (k.ravel() for k in np.meshgrid(np.arange(63), np.arange(48), indexing="ij"))
        corner = np.stack([48 * i + j, 48 * i + 48 + j, 48 * i + 48 + (j + 1) % 48, 48 * i + (j + 1) % 48], -1)
        triangles = np.concatenate([corner[:, (0, 2, 1)], corner[:, (0, 3, 2)]]).astype(np.int32)
        self.limbs = Limbs(start[None], end[None], np.array([RADIUS]), np.array([RADIUS]), np.zeros(1, np.int32))
        self.rest, self.normals = rest.astype(np.float32), away.astype(np.float32)
        self.embedding = embed(self.rest, np.zeros(len(rest), np.int32), self.limbs)
        self.deformer = Deformer(triangles, self.embedding)
        fit = self.embedding.fit
        reach = float(fit.radius_a[0] * fit.reach[0])
        rod = vi.Sphylinder(tuple(start), tuple(end), reach, weight=float(fit.weight[0]))
        self.body = Deformable("rod", rod)

    def under(self, *ghosts: GhostSource) -> np.ndarray:
        vertices, normals = self.rest.copy(), self.normals.copy()
        report = self.deformer.deform(vertices, normals, self.limbs.a, self.limbs.b, ghosts)
        assert report.lost == 0
        assert np.isfinite(vertices).all()
        return vertices


ROD = Rod()


def ball(centre: tuple[float, float, float], radius: float = 0.08) -> tuple[GhostSource, Deformable]:
    shape = PrimitiveSet.of_kinds(["sphere"], [[radius]], np.eye(3)[None], np.array([centre]))
    return ghosts_of(shape, depth=0.0), Deformable("ball", vi.Sphere.of_surface((0, 0, 0), radius), position=centre)


def residual(shape: vi.Shape, vertices: np.ndarray) -> np.ndarray:
    """|F - T| of a shape's field at a mesh's vertices."""
    return np.abs(shape.field(vertices.astype(float)) - vi.THRESHOLD)


def near_moved(moved: np.ndarray) -> np.ndarray:
    """Those moved, and all within 5 mm of one: what should have moved and did not counts as well."""
    gap = np.linalg.norm(ROD.rest[:, None] - ROD.rest[moved][None], axis=2).min(axis=1)
    return gap < 0.005


@pytest.mark.parametrize(
    ("height", "compliance"), [(0.17, 0.05), *((h, c) for h in (0.17, 0.15, 0.13) for c in (0.3, 1.0, 3.0, 20.0))]
)
def test_a_contact_moves_a_skin_as_it_moves_a_shape_however_stiff_the_other_is(height: float, compliance: float) -> None:
    _, body = ball((0.0, height, 0.0))
    body = Deformable("ball", body.shape, compliance, body.position)
    depth = penetration(body.placed, ROD.body.placed).depth
    placed = PrimitiveSet.of_kinds(["sphere"], [[0.08]], np.eye(3)[None], np.array([(0.0, height, 0.0)]))
    vertices = ROD.under(ghosts_of(placed, compliance=compliance, depth=depth))
    shape = deformed([body, ROD.body], [c for c in collisions([body, ROD.body]) if c.target == "rod"])["rod"]
    moved = np.any(vertices != ROD.rest, axis=1)
    assert moved.sum() > 20
    assert residual(shape, vertices)[near_moved(moved)].max() < 1e-4


@pytest.mark.parametrize("share", [1.0, 0.7, 0.3, 0.05])
def test_a_fading_dent_has_its_rim_and_moves_a_skin_as_it_moves_a_shape(share: float) -> None:
    _, body = ball((0.0, 0.15, 0.0))
    depth = penetration(body.placed, ROD.body.placed).depth
    placed = PrimitiveSet.of_kinds(["sphere"], [[0.08]], np.eye(3)[None], np.array([(0.0, 0.15, 0.0)]))
    vertices = ROD.under(faded(ghosts_of(placed, depth=depth), share))
    shape = deformed([ROD.body], [Imprint("ball", "rod", body.placed, share, depth)])["rod"]
    moved = np.any(vertices != ROD.rest, axis=1)
    assert residual(shape, vertices)[near_moved(moved)].max() < 1e-4


@pytest.mark.parametrize("gap", [0.005, 0.02, 0.04, 0.055])
def test_a_constraint_reaches_a_skin_as_far_as_a_shape(gap: float) -> None:
    source, body = ball((0.0, RADIUS + 0.08 + gap, 0.0))
    held = Constraint("ball", "rod", (0.0, -0.08, 0.0), (0.0, RADIUS, 0.0), 0.06, 0.06, plateau=0.4)
    vertices = ROD.under(pulled(source, [p for p in held.pulls(body, ROD.body) if p.target == "rod"]))
    shape = deformed([body, ROD.body], [held])["rod"]
    moved = np.any(vertices != ROD.rest, axis=1)
    assert residual(shape, vertices)[near_moved(moved)].max() < 1e-4
    assert vertices[:, 1].max() > held.held(body, ROD.body).point[1] - 2e-3


@pytest.mark.parametrize("plateau", [0.0, 0.5])
def test_a_constraint_pulls_the_skin_to_the_point_where_the_surfaces_meet(plateau: float) -> None:
    source, body = ball((0.02, 0.21, 0.01))
    held = Constraint("ball", "rod", (0.0, -0.08, 0.0), (0.02, RADIUS, 0.01), 0.05, 0.05, plateau=plateau)
    assert not held.held(body, ROD.body).out_of_reach
    vertices = ROD.under(pulled(source, [p for p in held.pulls(body, ROD.body) if p.target == "rod"]))
    moved = np.any(vertices != ROD.rest, axis=1)
    assert moved.any()
    assert np.linalg.norm((ROD.rest - (0.02, RADIUS, 0.01))[moved], axis=1).max() < 0.08  # nothing far from the axis
    shape = deformed([body, ROD.body], [held])["rod"]
    assert residual(shape, vertices)[near_moved(moved)].max() < 1e-4
    tip = held.held(body, ROD.body).point
    assert vertices[:, 1].max() == pytest.approx(tip[1], abs=4e-3)


def test_a_pull_without_reach_moves_nothing() -> None:
    source, body = ball((0.02, 0.5, 0.01))
    held = Constraint("ball", "rod", (0.0, -0.08, 0.0), (0.02, RADIUS, 0.01), 0.05, 0.05)
    vertices = ROD.under(pulled(source, [p for p in held.pulls(body, ROD.body) if p.target == "rod"]))
    np.testing.assert_array_equal(vertices, ROD.rest)


@pytest.mark.parametrize(
    "field",
    [
        Directional((0, 1, 0), 2.0),
        Shear((1, 0, 0), (0, 1, 0), 8.0),
        compression((0.05, 0.0, 0.0), 0.3, 0.3),
        expansion((0.0, 0.05, 0.0), 0.25, 0.6),
    ],
    ids=["wind", "shear", "compression", "expansion"],
)
def test_force_fields_move_skins_as_they_move_shapes(field: Directional | Shear) -> None:
    vertices = ROD.under(blown(field, BOX))
    shape = deformed([ROD.body], [Force("weather", "rod", field)])["rod"]
    moved = np.any(vertices != ROD.rest, axis=1)
    assert moved.mean() > 0.3
    assert residual(shape, vertices).max() < 1e-4


def test_a_force_field_elsewhere_moves_nothing() -> None:
    far = ((5.0, 5.0, 5.0), (6.0, 6.0, 6.0))
    np.testing.assert_array_equal(ROD.under(blown(Directional((0, 1, 0), 2.0, 0.0), far)), ROD.rest)


def test_a_dent_fades_with_its_share() -> None:
    source, body = ball((0.0, 0.165, 0.0))
    deep = np.array([np.linalg.norm(ROD.under(faded(source, share)) - ROD.rest, axis=1).max() for share in (1.0, 0.5, 0.1, 0.0)])
    assert np.all(np.diff(deep) < 0)
    assert deep[-1] == 0.0
    live = deformed([body, ROD.body], [c for c in collisions([body, ROD.body]) if c.target == "rod"])["rod"]
    inside = body.placed.field(ROD.rest.astype(float)) > vi.THRESHOLD
    assert residual(live, ROD.under(faded(source, 1.0)))[inside].max() < 1e-4


def test_a_plastic_mesh_keeps_the_dent_of_a_ball_that_left_until_it_has_faded() -> None:
    primitives = PrimitiveSet.of_kinds(["sphere"], [[0.08]], np.eye(3)[None], np.zeros((1, 3)))
    _, near = ball((0.0, 0.165, 0.0))
    memory = ContactMemory({"rod": Plastic(decay=Decay(2.0))}).step([near, ROD.body], 0.0, 1.0)
    memory = memory.step([near.at((0.0, 1.0, 0.0)), ROD.body], 1.0, 1.0)
    deep = [
        float(np.linalg.norm(ROD.under(*dents(memory, "ball", ROD.body, primitives, t)) - ROD.rest, axis=1).max())
        for t in (1.0, 2.0, 2.9, 3.0)
    ]
    assert deep[0] > 0.005
    assert all(a > b for a, b in pairwise(deep))
    assert deep[-1] == 0.0
    live = ROD.under(ghosts_of(primitives.moved(np.eye(3), np.array((0.0, 0.165, 0.0)))))
    np.testing.assert_allclose(ROD.under(*dents(memory, "ball", ROD.body, primitives, 1.0)), live, atol=1e-6)
