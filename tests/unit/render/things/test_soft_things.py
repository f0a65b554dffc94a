"""Things that give way in the picture: dents the world tells of, the same for whoever comes late, fading without a jump."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from vistel.figure.making.source import SourceMaterial
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.render.things.soft import SoftThing, bond_pulls, is_soft
from vistel.space.files.model import Polymesh
from vistel.space.room import Extra
from vistel.space.things.things import Look, PhysicsMaterial, Thing, ThingPrimitive
from vistel.v1 import geometry_pb2, world_pb2

R = 0.045
STILL = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
SECOND = 1_000_000_000


def lump(shape: str = "lump", rigidity: float = 0.3, **material: object) -> Thing:
    return Extra("clay", "clay", shape, R, 1.0, rigidity, 0xB5A48FFF, 0.0, 0.0, PhysicsMaterial(**material)).thing()  # type: ignore[arg-type]


def dent(number: int = 1, x: float = 0.0, *, at: float = R, depth: float = 0.15, **more: object) -> world_pb2.Dent:
    """A finger laid across the lump's top."""
    shape = world_pb2.Primitive(kind="cone_sphere", params=[x, at, -0.02, x, at, 0.02, 0.008, 0.008])
    return world_pb2.Dent(number=number, thing="clay", shape=shape, depth=depth, **more)  # type: ignore[arg-type]


def below(soft: SoftThing, positions: np.ndarray) -> np.ndarray:
    """How far each vertex lies under the surface at rest [m]."""
    return ((soft.surface.vertices - positions) * soft.surface.normals).sum(axis=1)


def test_a_dent_presses_the_skin_in_where_it_is_and_nowhere_else() -> None:
    soft = SoftThing(lump())
    now = soft.reshape([dent()], [], STILL, 0)
    assert now is not None
    assert not now.in_room
    sunk = below(soft, now.positions)
    middle = np.linalg.norm(soft.surface.vertices - (0.0, R, 0.0), axis=1).argmin()
    assert 0.004 < sunk[middle] < 0.008
    assert sunk.min() > -0.004  # the rim
    away = np.abs(soft.surface.vertices[:, 0]) > 0.04
    assert np.array_equal(now.positions[away], soft.surface.vertices[away])
    assert np.linalg.norm(now.normals, axis=1) == pytest.approx(1.0, abs=1e-4)


def test_where_a_finger_presses_both_surfaces_are_one() -> None:
    """A vertex under the finger lies where (F - T) / c of the lump and of the finger are equal."""
    soft, finger = SoftThing(lump()), np.array([[0.0, R, -0.02], [0.0, R, 0.02]])
    limb = ghosts_of(PrimitiveSet.of_cone_spheres(finger[:1], finger[1:], np.array([0.008]), np.array([0.008])))
    now = soft.reshape([], [limb], STILL, 0)
    assert now is not None
    p = now.positions.astype(np.float64)

    def field(a: np.ndarray, b: np.ndarray, r: float) -> np.ndarray:
        s = np.clip(((p - a) @ (b - a)) / ((b - a) @ (b - a)), 0, 1)
        d = np.linalg.norm(p - a - s[:, None] * (b - a), axis=1) * 0.5411961 / r
        return np.maximum(1 - d * d, 0) ** 2

    mine = field(np.array([-R, 0, 0]), np.array([R, 0, 0]), R)
    theirs = field(finger[0], finger[1], 0.008)
    inside = theirs > 0.505
    assert inside.sum() > 20
    assert np.abs((mine - 0.5) / 0.7 - (theirs - 0.5))[inside].max() < 1e-3


def test_the_same_dents_give_the_same_surface_however_they_were_heard_of() -> None:
    dents = [dent(1), dent(2, 0.02), dent(3, -0.02, depth=0.3)]
    one, late = SoftThing(lump()), SoftThing(lump())
    one.reshape(dents[:1], [], STILL, 0)
    one.reshape(dents[:2], [], STILL, 5)
    a, b = one.reshape(dents, [], STILL, 9), late.reshape(dents, [], STILL, 9)
    assert a is not None
    assert b is not None
    assert np.array_equal(a.positions, b.positions)
    assert late.reshape(dents, [], STILL, 10) is b  # nothing has changed: nothing is done


def test_dents_turn_with_the_thing() -> None:
    soft = SoftThing(lump())
    rest = soft.reshape([dent()], [], STILL, 0)
    assert rest is not None
    turn = np.array([0.0, 0.0, math.sin(0.6), math.cos(0.6)])
    away = PrimitiveSet.of_cone_spheres(np.full((1, 3), 9.0), np.full((1, 3), 9.1), np.array([0.01]), np.array([0.01]))
    room = soft.reshape([dent()], [ghosts_of(away)], (np.array([0.3, 0.8, 0.1]), turn), 0)
    assert room is not None
    assert room.in_room
    r = np.array([[math.cos(1.2), -math.sin(1.2), 0], [math.sin(1.2), math.cos(1.2), 0], [0, 0, 1]])
    assert room.positions == pytest.approx(rest.positions @ r.T + (0.3, 0.8, 0.1), abs=2e-5)


def test_a_dent_that_fades_goes_smoothly_and_wholly() -> None:
    soft, deep = SoftThing(lump()), []
    for k in range(61):
        now = soft.reshape([dent(left_ns=SECOND, fade_s=1.0)], [], STILL, SECOND + k * SECOND // 60)
        deep.append(0.0 if now is None else float(below(soft, now.positions).max()))
    assert deep[0] > 0.004
    assert deep[-1] < 1e-6
    assert np.abs(np.diff(deep)).max() < 0.0008
    assert (np.diff(deep) < 1e-5).all()


def test_what_is_hard_is_drawn_as_it_is() -> None:
    assert is_soft(lump())
    assert is_soft(lump("ball"))
    assert not is_soft(lump(rigidity=1.0))
    assert is_soft(solid(ThingPrimitive("superellipsoid", (0.1, 0.1, 0.1, 0.2, 0.2))))
    assert not is_soft(replace(solid(ThingPrimitive("superellipsoid", (0.1, 0.1, 0.1, 0.2, 0.2))), compliance=0.05))
    assert not is_soft(replace(solid(ThingPrimitive("sphere", (0.1,))), primitives=()))


def solid(*primitives: ThingPrimitive) -> Thing:
    return Thing("clay", "clay", "thing", primitives, 1.0, 0.9, 0xB5A48FFF, np.zeros(3))


LYING = np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])
SHAPES = {
    "box": (ThingPrimitive("superellipsoid", (0.12, 0.04, 0.09, 0.2, 0.2)),),
    "slab": (ThingPrimitive("superellipsoid", (0.2, 0.04, 0.2, 0.2, 0.2)),),
    "polygon": (ThingPrimitive("rounded_polygon", (0.04, -0.1, 0.0, -0.1, 0.1, 0.0, -0.1, 0.1, 0.0, 0.1, -0.1, 0.0, 0.1)),),
    "two": (
        ThingPrimitive("sphere", (0.04,), np.array([-0.03, 0.0, 0.0])),
        ThingPrimitive("sphere", (0.04,), np.array([0.03, 0.0, 0.0])),
    ),
    "ring": (ThingPrimitive("supertoroid", (0.04, 0.04, 0.04, 2.0, 1.0, 1.0), np.array([-0.05, 0.0, 0.0]), LYING),),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_finger_dents_every_shape_where_it_is_and_nowhere_else(shape: str) -> None:
    soft = SoftThing(solid(*SHAPES[shape]))
    v = soft.surface.vertices
    over = np.flatnonzero(np.hypot(v[:, 0] - 0.03, v[:, 2]) < 0.012)
    top = float(v[over, 1].max())
    now = soft.reshape([dent(x=0.03, at=top - 0.002)], [], STILL, 0)
    assert now is not None
    sunk = below(soft, now.positions)
    assert 0.004 < sunk[over].max() < 0.015, sunk[over].max()
    away = np.linalg.norm(v - (0.03, top, 0.0), axis=1) > 0.08
    assert np.array_equal(now.positions[away], v[away])
    assert np.isfinite(now.positions).all() and np.linalg.norm(now.normals, axis=1) == pytest.approx(1.0, abs=1e-4)


def test_a_polymesh_is_dented_with_its_picture_and_its_edges_stay_sharp() -> None:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64) * (0.15, 0.05, 0.12)
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
    picture = np.zeros((4, 4, 3), np.uint8)
    places = np.tile(np.array((0, 1, 2), np.int32), (12, 1))
    uv = np.array(((0, 0), (1, 0), (1, 1)), np.float32)
    model = Polymesh(corners.astype(np.float32), faces, uv, places, np.zeros(12, np.int32), (SourceMaterial("m", None, picture),))
    felt = ThingPrimitive("superellipsoid", (0.15, 0.05, 0.12, 0.2, 0.2), colour=0x80808000)
    soft = SoftThing(replace(solid(felt), looks=(Look(model.digest),)), {model.digest: model})
    (piece,) = soft.skin.pieces
    assert piece.mesh and piece.uv is not None and piece.picture is picture
    assert len(piece.surface.triangles) > 3000
    assert np.allclose(soft.surface.vertices[soft.skin.back[0]], piece.surface.vertices, atol=1e-5)
    assert len(soft.surface.vertices) < len(piece.surface.vertices)
    now = soft.reshape([dent(x=0.0, at=0.048)], [], STILL, 0)
    assert now is not None
    assert below(soft, now.positions).max() > 0.004
    edge = np.abs(piece.surface.vertices[:, 0]) > 0.149
    assert not now.bent[soft.skin.back[0]][edge].any()
    assert set(np.round(np.abs(piece.surface.normals[edge]).max(axis=1), 3).tolist()) == {1.0}


@pytest.mark.parametrize("params", [[0, R, 0, 0, R, 0, 0.008, 0.008], [0, 0, 0, 0, 0, 0, 0.2, 0.2], [0, 9, 0, 0, 9, 0, 0.01, 0.01]])
def test_dents_of_no_length_round_the_whole_thing_or_far_away_leave_it_finite(params: list[float]) -> None:
    soft = SoftThing(lump("ball"))
    bad = world_pb2.Dent(number=1, thing="clay", shape=world_pb2.Primitive(kind="cone_sphere", params=params), depth=0.5)
    now = soft.reshape([bad] * 48, [], STILL, 0)
    assert now is not None
    assert np.isfinite(now.positions).all()
    assert np.isfinite(now.normals).all()
    assert np.linalg.norm(now.positions, axis=1).max() < 2 * R


def test_a_bond_pulls_both_sides_once_it_is_drawn_out_and_lets_go_when_torn() -> None:
    thing = lump(sticky=0.02)
    limb = ThingPrimitive("cone_sphere", (0.0, R + 0.018, -0.02, 0.0, R + 0.018, 0.02, 0.008, 0.008))
    point = geometry_pb2.Vec3(x=0.0, y=R, z=0.0)
    bond = world_pb2.Bond(number=1, thing="clay", body="ann", point_thing=point, reach=0.012)
    near, drawn = np.array([0.0, R + 0.0002, 0.0]), np.array([0.0, R + 0.010, 0.0])
    assert bond_pulls(bond, thing, STILL, limb, near, 0) == []
    assert {p.target for p in bond_pulls(bond, thing, STILL, limb, drawn, 0)} == {"thing", "limb"}
    bond.torn_ns = SECOND
    strengths = [
        max((p.strength for p in bond_pulls(bond, thing, STILL, limb, drawn, SECOND + k * SECOND // 60)), default=0.0)
        for k in range(14)
    ]
    assert strengths[0] > 0.3
    assert strengths[-1] == 0.0
    assert (np.diff(strengths) <= 1e-12).all()
