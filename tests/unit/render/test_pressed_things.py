"""Soft things that give way, as pages are told it."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from vistel.conference.model import Conference
from vistel.geometry.pose import Pose
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.render.glb_files import GlbFiles, ThingFile
from vistel.render.pressed_skin import Pressed
from vistel.render.pressed_things import MOST_CORNERS, MOST_THINGS, STEP_BYTES, PressedThings, pressed_thing
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.things.soft import SoftThing
from vistel.space.room import Extra
from vistel.space.things.things import Thing, ThingPrimitive
from vistel.v1 import world_pb2

R = 0.045
TURNED = Pose(np.array([0.3, 0.8, 0.1]), np.array([0.0, 0.0, math.sin(0.6), math.cos(0.6)]))
STEP_NS = 33_333_333


def lump(name: str = "clay", shape: str = "lump", size: float = R) -> Thing:
    return Extra(name, name, shape, size, 1.0, 0.3, 0xB5A48FFF, 0.0, 0.0).thing()


def dent(number: int, thing: str, x: float = 0.0, depth: float = 0.15) -> world_pb2.Dent:
    """A finger laid across its top."""
    shape = world_pb2.Primitive(kind="cone_sphere", params=[x, R, -0.02, x, R, 0.02, 0.008, 0.008])
    return world_pb2.Dent(number=number, thing=thing, shape=shape, depth=depth)


def room(things: Mapping[str, Thing], *dents: world_pb2.Dent, at: int = 0) -> Instant:
    """After so many frames."""
    world = PlayoutWorld(poses=dict.fromkeys(things, TURNED), dents={d.number: d for d in dents})
    return Instant(at * STEP_NS, world=world, things=things)


class Made:
    """Files of things, and which are there."""

    def __init__(self, *things: Thing) -> None:
        self.there = {t.id: ThingFile(f"file of {t.id}", SoftThing(t)) for t in things}
        self.things = {t.id: t for t in things}

    def told(self) -> PressedThings:
        return PressedThings(lambda about: None, lambda thing: self.there.get(thing.id))

    def soft(self, name: str) -> SoftThing:
        soft = self.there[name].soft
        assert soft is not None
        return soft


def shown(told: PressedThings, now: Instant) -> dict[str, str]:
    """What is told once time stands still."""
    list(told.words(now))
    return dict(told.words(now))


def rows(told: PressedThings, now: Instant) -> dict[str, dict[str, Any]]:
    """What a page has of each thing that is dented."""
    words = shown(told, now)
    assert words.keys() == {f"dents{n}" for n in range(MOST_THINGS)}
    places = [json.loads(said) for said in words.values()]
    assert [p["place"] for p in places] == list(range(MOST_THINGS)) and {p["kind"] for p in places} == {"dents"}
    return {p["thing"]["who"]: p["thing"] for p in places if p["thing"] is not None}


def read(row: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    corners = np.frombuffer(base64.b64decode(row["corners"]), "<u4")
    offsets = np.frombuffer(base64.b64decode(row["offsets"]), np.int8).reshape(-1, 3) * row["step_m"]
    return corners, offsets, np.frombuffer(base64.b64decode(row["normals"]), np.int8).reshape(-1, 3) / 127


def test_a_page_has_a_dented_thing_as_the_engine_has_it_and_what_is_not_moved_is_not_sent() -> None:
    made = Made(lump())
    row = rows(made.told(), room(made.things, dent(1, "clay")))["clay"]
    assert row["file"] == "file of clay"
    soft = made.soft("clay")
    shape = soft.reshape([dent(1, "clay")], [], TURNED, 0)
    assert shape is not None
    corners, offsets, normals = read(row)
    back = np.concatenate(soft.skin.back)
    page = soft.surface.vertices[back]
    page[corners] += offsets
    assert np.abs(page - shape.positions[back]).max() < 2e-4
    assert np.abs(offsets).max() > 4e-3
    assert 50 < len(corners) < len(back) / 2
    assert np.einsum("ij,ij->i", normals, shape.normals[back[corners]]).min() > 0.995


def test_where_something_presses_the_same_is_sent_however_the_thing_lies() -> None:
    """While something presses, the engine works in the room."""
    soft, far = SoftThing(lump()), np.full((1, 3), 9.0)
    away = ghosts_of(PrimitiveSet.of_cone_spheres(far, far + 0.1, np.array([0.01]), np.array([0.01])))
    found: list[Pressed] = []
    for live in ([], [away]):
        shape = soft.reshape([dent(1, "clay")], live, TURNED, 0)
        assert shape is not None
        assert shape.in_room is bool(live)
        pressed = pressed_thing(soft, shape, TURNED)
        assert pressed is not None
        found.append(pressed)
    assert not found[0].differs(found[1], 1e-4)


def test_a_dent_that_is_gone_is_gone_from_the_page_and_so_is_a_thing() -> None:
    made = Made(lump())
    told = made.told()
    assert rows(told, room(made.things, dent(1, "clay"))).keys() == {"clay"}
    assert rows(told, room(made.things, at=60)) == {}
    assert rows(told, room(made.things, dent(2, "clay"), at=120)).keys() == {"clay"}
    assert rows(told, room({}, dent(2, "clay"), at=180)) == {}


def test_what_changes_on_one_thing_sends_no_other_one_again() -> None:
    made = Made(lump("clay"), lump("dough"))
    told = made.told()
    before = shown(told, room(made.things, dent(1, "clay"), dent(2, "dough")))
    after = shown(told, room(made.things, dent(1, "clay"), dent(3, "dough", 0.02), at=60))
    changed = [kind for kind in before if before[kind] != after[kind]]
    assert len(changed) == 1
    assert json.loads(after[changed[0]])["thing"]["who"] == "dough"
    assert shown(told, room(made.things, dent(1, "clay"), dent(3, "dough", 0.02, 0.151), at=120)) == after  # nobody sees it


def test_after_much_has_been_sent_the_next_look_is_later_but_what_stands_still_is_complete() -> None:
    made = Made(lump())
    told = made.told()
    many = [dent(n, "clay", -0.07 + 0.01 * n) for n in range(1, 15)]
    first = dict(told.words(room(made.things, *many)))
    frames = len(first["dents0"]) // STEP_BYTES
    assert frames > 2
    during = [dict(told.words(room(made.things, *many[:7], at=2 * at))) for at in range(1, frames + 1)]
    assert all(words == first for words in during[:-1]) and during[-1] != first
    now = room(made.things, at=2 * frames + 3)
    assert dict(told.words(now)) == during[-1]
    assert dict(told.words(now)) != during[-1]


def test_a_thing_whose_file_is_being_made_is_dented_as_soon_as_that_is_there() -> None:
    made = Made(lump())
    file = made.there.pop("clay")
    told = made.told()
    now = room(made.things, dent(1, "clay"))
    assert rows(told, now) == {}
    made.there["clay"] = file
    assert rows(told, now).keys() == {"clay"}


def test_many_dented_things_and_large_ones_are_bounded() -> None:
    some = [lump(f"ball-{n}", "ball", 0.02) for n in range(MOST_THINGS + 2)]
    made = Made(*some)
    shape = world_pb2.Primitive(kind="sphere", params=[0.01])
    shape.pose.position.y = 0.02
    dents = [world_pb2.Dent(number=n, thing=t.id, shape=shape, depth=0.2) for n, t in enumerate(some)]
    assert len(rows(made.told(), room(made.things, *dents))) == MOST_THINGS
    box = ThingPrimitive("superellipsoid", (0.15, 0.04, 0.15, 0.2, 0.2))
    made = Made(Thing("box", "box", "box", (box,), 1.0, 0.9, 0xB5A48FFF, np.zeros(3)))
    wide = world_pb2.Primitive(kind="superellipsoid", params=[0.2, 0.04, 0.2, 0.3, 0.3])
    wide.pose.position.y = 0.05
    row = rows(made.told(), room(made.things, world_pb2.Dent(number=1, thing="box", shape=wide, depth=0.3)))["box"]
    assert len(read(row)[0]) <= MOST_CORNERS


def test_a_soft_thing_is_drawn_by_the_corners_that_are_told() -> None:
    files = GlbFiles(
        Conference.model_validate({"sites": [{"name": "tokyo", "participants": [{"name": "aiko"}]}]}), lambda digest: b"", {}
    )
    file = files.thing(lump())
    assert file.soft is not None
    data = files.bytes[file.digest]
    size = int.from_bytes(data[12:16], "little")
    tree = json.loads(data[20 : 20 + size])
    drawn: list[np.ndarray] = []
    for piece in tree["meshes"][0]["primitives"]:
        accessor = tree["accessors"][piece["attributes"]["POSITION"]]
        view = tree["bufferViews"][accessor["bufferView"]]
        begin = 28 + size + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        drawn.append(np.frombuffer(data, "<f4", 3 * accessor["count"], begin).reshape(-1, 3))
    back = np.concatenate(file.soft.skin.back)
    assert np.abs(np.concatenate(drawn) - file.soft.surface.vertices[back]).max() < 1e-6
    assert files.thing(Extra("rock", "rock", "ball", 0.03, 1.0, 1.0, 0xFF, 0.0, 0.0).thing()).soft is None
