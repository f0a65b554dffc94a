"""Constraints, dents and force fields on meshes: the same surfaces as the fields of shapes have."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import vistel.implicit as vi
from vistel.implicit.constraint import Constraint
from vistel.implicit.contact_set import PrimitiveSet
from vistel.implicit.deform import Deformer
from vistel.implicit.deformable import Deformable, collisions, deformed
from vistel.implicit.embedding import Limbs, embed
from vistel.implicit.force_field import Directional, Force, Shear, compression, expansion
from vistel.implicit.ghost import GhostSource, ghosts_of
from vistel.implicit.mesh_ghosts import blown, dents, faded, pulled
from vistel.implicit.temporal import Decay, Memory, Plastic

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
    # Skins are calibrated vertex by vertex, so a thousandth of the field is what can be asked.
    assert residual(shape, vertices)[moved].max() < 5e-3
    tip = held.held(body, ROD.body).point
    assert vertices[:, 1].max() == pytest.approx(tip[1], abs=4e-3)


def test_a_pull_without_reach_moves_nothing() -> None:
    source, body = ball((0.02, 0.5, 0.01))
    held = Constraint("ball", "rod", (0.0, -0.08, 0.0), (0.02, RADIUS, 0.01), 0.05, 0.05)
    vertices = ROD.under(pulled(source, [p for p in held.pulls(body, ROD.body) if p.target == "rod"]))
    np.testing.assert_array_equal(vertices, ROD.rest)


@pytest.mark.parametrize(
    "field", [Directional((0, 1, 0), 2.0), Shear((1, 0, 0), (0, 1, 0), 8.0), compression((0.05, 0.0, 0.0), 0.3, 0.3),
              expansion((0.0, 0.05, 0.0), 0.25, 0.6)], ids=["wind", "shear", "compression", "expansion"])  # fmt: skip
def test_force_fields_move_skins_as_they_move_shapes(field: Directional | Shear) -> None:
    vertices = ROD.under(blown(field, BOX))
    shape = deformed([ROD.body], [Force("weather", "rod", field)])["rod"]
    moved = np.any(vertices != ROD.rest, axis=1)
    assert moved.mean() > 0.3
    assert residual(shape, vertices).max() < 8e-3


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
    assert residual(live, ROD.under(faded(source, 1.0)))[inside].max() < 5e-3


def test_a_plastic_mesh_keeps_the_dent_of_a_ball_that_left_until_it_has_faded() -> None:
    primitives = PrimitiveSet.of_kinds(["sphere"], [[0.08]], np.eye(3)[None], np.zeros((1, 3)))
    _, near = ball((0.0, 0.165, 0.0))
    memory = Memory({"rod": Plastic(decay=Decay(2.0))}).step([near, ROD.body], 0.0, 1.0)
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
