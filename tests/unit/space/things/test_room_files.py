"""Rooms and things on file: written and read to the last bit, files of others made sense of, faults in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdShade

from vistel.colour import linear
from vistel.figure.making.source import SourceMaterial
from vistel.space.commands.reshape import curved, joined, painted, scaled, stretched
from vistel.space.files import Interior, Polymesh, RoomFileError, load_room, load_seats, load_things, save_usd
from vistel.space.files.edit import edited
from vistel.space.files.gltf_write import save_glb
from vistel.space.files.model import bulk_of_mesh
from vistel.space.files.surfaces import height_at, pieces_of
from vistel.space.inputs import ParticipantBody, StepInputs
from vistel.space.room import Room, Seat, meeting_room
from vistel.space.things.json_values import from_thing, to_thing
from vistel.space.things.things import Look, Thing
from vistel.space.world import World

CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))], np.int32)


NEWER = """#usda 1.0
(
    defaultPrim = "Room"
)
def Xform "Room"
{
    bool vistel:shell = 1
    int vistel:format = 9
}
"""


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def block(half: tuple[float, float, float] = (0.1, 0.05, 0.03)) -> Polymesh:
    """A box in two materials, one with a picture, two of its faces without a place in it."""
    picture = np.random.default_rng(1).integers(0, 256, (8, 16, 3)).astype(np.uint8)
    uv = np.array(((0, 0), (1, 0), (1, 1)), np.float32)
    places = np.tile(np.array((0, 1, 2), np.int32), (12, 1))
    places[:2] = -1
    material = np.array([0] * 6 + [1] * 6, np.int32)
    materials = (SourceMaterial("wood", (10, 20, 30), picture), SourceMaterial("metal ö", (200, 200, 210)))
    return Polymesh((CORNERS * half).astype(np.float32), TRIANGLES, uv, places, material, materials)


def looking(thing: Thing, model: Polymesh) -> Thing:
    hidden = tuple(replace(p, colour=0x80808000) for p in thing.primitives)
    return replace(thing, primitives=hidden, looks=(Look(model.digest),), inertia=np.diag([1.0, 2.0, 2.5]) * 1e-3 / 3.0)


@pytest.mark.parametrize("ending", ["usda", "usdc", "usdz"])
def test_a_room_is_read_as_it_was_written_to_the_last_bit(ending: str, tmp_path: Path) -> None:
    room, model = meeting_room(5), block()
    side = np.array([0.0, 1.0, 0.0])
    box = looking(replace(room.thing("box"), compliance=1.0 / 3.0), model)
    bent = curved(replace(room.thing("baton"), id="bent"), 0.7, 0.1, side)
    both, where = joined(room.thing("ball"), (side, room.thing("ball").rotation), box, (0.1 * side, box.rotation))
    pulled = painted(stretched(scaled(replace(box, id="1 odd/id"), 1.1), 1.3, np.array([0.0, 0.0, 1.0])), 0x11223344)
    things = (*room.things[:4], box, bent, replace(both, id="both", position=where), pulled)
    seats = (Seat(np.array([0.1, 0.0, 1.0 / 3.0]), 0.1), *room.seats)
    interior = Interior(Room(seats, things, shell=False)).with_things(things, {model.digest: model})
    save_usd(interior, tmp_path / f"room.{ending}")
    back = load_room(tmp_path / f"room.{ending}")
    assert [from_thing(t) for t in back.room.things] == [from_thing(t) for t in interior.room.things]
    assert [(s.position.tolist(), s.heading) for s in back.room.seats] == [(s.position.tolist(), s.heading) for s in seats]
    assert not back.room.shell
    assert list(back.models) == [model.digest]
    assert back.notes == ()
    assert load_seats(tmp_path / f"room.{ending}")[0].heading == 0.1


def test_writing_over_a_room_leaves_nothing_behind(tmp_path: Path) -> None:
    model = block()
    interior = Interior(Room((), ())).with_things((looking(meeting_room(1).thing("box"), model),), {model.digest: model})
    file = tmp_path / "room.usda"
    save_usd(interior, file)
    assert len(list((tmp_path / "room_textures").iterdir())) == 1
    save_usd(interior.with_things(()), file)
    assert [p.name for p in tmp_path.iterdir() if p.name != "cache"] == ["room.usda"]
    with pytest.raises(ValueError, match="usda"):
        save_usd(interior, tmp_path / "room.txt")


def test_other_programs_find_bodies_units_and_materials(tmp_path: Path) -> None:
    model = block()
    things = (looking(meeting_room(1).thing("box"), model), meeting_room(1).thing("ball"))
    save_usd(Interior(Room((), ())).with_things(things, {model.digest: model}), tmp_path / "room.usda")
    stage: Any = Usd.Stage.Open(str(tmp_path / "room.usda"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    prim = stage.GetPrimAtPath("/Room/Things/box")
    assert UsdPhysics.MassAPI(prim).GetMassAttr().Get() == pytest.approx(0.25)
    box = UsdGeom.Imageable(prim).ComputeWorldBound(Usd.TimeCode.Default(), "default").ComputeAlignedRange()
    assert box.GetMidpoint()[1] == pytest.approx(things[0].position[1], abs=1e-4)
    assert stage.GetPrimAtPath("/Room/Things/ball/Body").IsA(UsdGeom.Mesh)


def test_every_face_has_a_material_with_its_colour_or_picture(tmp_path: Path) -> None:
    model, room = block(), meeting_room(3)
    still = np.array([0.0, 0.0, 0.0, 1.0])
    both, _ = joined(room.thing("box"), (np.zeros(3), still), room.thing("can"), (np.array([0.08, 0.0, 0.0]), still))
    things = (
        room.thing("ball"),
        replace(both, id="both"),
        looking(replace(room.thing("box"), id="pictured"), model),
        painted(looking(replace(room.thing("box"), id="painted"), model), 0xFF0000FF),
    )
    save_usd(Interior(Room((), ())).with_things(things, {model.digest: model}), tmp_path / "room.usda")
    stage: Any = Usd.Stage.Open(str(tmp_path / "room.usda"))

    def shown(path: str) -> Any:
        material = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(path)).ComputeBoundMaterial()[0]
        surface = material.ComputeSurfaceSource()[0]
        assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
        colour = surface.GetInput("diffuseColor")
        source = colour.GetConnectedSource()
        return source[0].GetPrim().GetName() if source else [round(v, 3) for v in colour.Get()]

    at = "/Room/Things"
    assert shown(f"{at}/ball/Body") == [round(v, 3) for v in linear(np.array([0xE8, 0xB9, 0x23]) / 255.0).tolist()]
    parts = [shown(f"{at}/both/Body/part_{n}") for n in range(2)]
    assert len({tuple(p) for p in parts}) == 2
    assert shown(f"{at}/pictured/Look_0/part_0") == "Texture"
    assert shown(f"{at}/painted/Look_0") == [1.0, 0.0, 0.0]
    faces = sum(len(UsdGeom.Subset(stage.GetPrimAtPath(f"{at}/both/Body/part_{n}")).GetIndicesAttr().Get()) for n in range(2))
    assert faces == len(UsdGeom.Mesh(stage.GetPrimAtPath(f"{at}/both/Body")).GetFaceVertexCountsAttr().Get())


def foreign(path: Path, *, unit: float | None, up: str, closed: bool = True, mass: float = 0.0) -> None:
    """A table, a crate on it and a node called seat, as another program would write them."""
    stage: Any = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    if unit is not None:
        UsdGeom.SetStageMetersPerUnit(stage, unit)
    scale = 1.0 / (unit or 1.0)
    for name, half, at in (("Table", (0.5, 0.02, 0.4), (0, 0.7, 0)), ("crate", (0.1, 0.05, 0.06), (0.1, 0.77, 0))):
        points = (CORNERS * half + at) * scale
        points = points if up == "Y" else points[:, [0, 2, 1]] * (1, -1, 1)
        mesh: Any = UsdGeom.Mesh.Define(stage, f"/World/{name}/Mesh")
        UsdGeom.Xform.Define(stage, f"/World/{name}")
        quads = QUADS if closed else QUADS[:-1]
        mesh.CreatePointsAttr([Gf.Vec3f(*p) for p in points.tolist()])
        mesh.CreateFaceVertexCountsAttr([4] * len(quads))
        mesh.CreateFaceVertexIndicesAttr([i for q in quads for i in q])
        if mass and name == "crate":
            UsdPhysics.RigidBodyAPI.Apply(mesh.GetPrim().GetParent())
            UsdPhysics.MassAPI.Apply(mesh.GetPrim().GetParent()).CreateMassAttr(mass)
    seat: Any = UsdGeom.Xform.Define(stage, "/World/seat_1")
    at = np.array((0.0, 0.0, -0.8)) * scale
    at = at if up == "Y" else at[[0, 2, 1]] * (1, -1, 1)
    seat.AddTranslateOp().Set(Gf.Vec3d(*at.tolist()))
    stage.GetRootLayer().Save()


@pytest.mark.parametrize(("unit", "up"), [(1.0, "Y"), (0.01, "Z"), (None, "Z")])
def test_units_and_axes_of_others_become_metres_with_y_up(unit: float | None, up: str, tmp_path: Path) -> None:
    foreign(tmp_path / "room.usda", unit=unit, up=up)
    interior = load_room(tmp_path / "room.usda")
    crate, table = interior.thing("crate"), interior.thing("table")
    assert table.fixed
    assert crate.mass == pytest.approx(0.2 * 0.1 * 0.12 * 600.0, rel=1e-4)  # volume x density
    np.testing.assert_allclose(crate.position, (0.1, 0.77, 0.0), atol=1e-5)
    assert crate.inertia is not None
    want = [(0.1**2 + 0.12**2) / 12, (0.2**2 + 0.12**2) / 12, (0.2**2 + 0.1**2) / 12]
    np.testing.assert_allclose(np.diag(crate.inertia), want, rtol=1e-5)
    assert [s.position.round(6).tolist() for s in interior.room.seats] == [[0.0, 0.0, -0.8]]
    assert any("Z up" in n for n in interior.notes) == (up == "Z")
    assert any("taken as metres" in n for n in interior.notes) == (unit is None)
    assert height_at(interior.room.things, interior.models, 0.3, 0.1) == pytest.approx(0.72, abs=1e-5)


def test_what_a_file_says_of_weight_is_taken_and_open_meshes_are_reported(tmp_path: Path) -> None:
    foreign(tmp_path / "a.usda", unit=1.0, up="Y", mass=1.25)
    foreign(tmp_path / "b.usda", unit=1.0, up="Y", closed=False)
    assert load_room(tmp_path / "a.usda").thing("crate").mass == 1.25
    assert any("crate: an open mesh" in n for n in load_room(tmp_path / "b.usda").notes)
    again = load_room(tmp_path / "b.usda")  # kept from the first time
    assert any("crate: an open mesh" in n for n in again.notes)


def test_a_box_is_felt_as_one_box_and_rests_where_it_is(tmp_path: Path) -> None:
    foreign(tmp_path / "room.usda", unit=1.0, up="Y")
    interior = load_room(tmp_path / "room.usda")
    crate = interior.thing("crate")
    assert len(crate.primitives) == 1
    np.testing.assert_allclose(sorted(crate.primitives[0].params[:3]), (0.05, 0.06, 0.1), atol=2e-3)
    world = World(replace(interior.room, source="x"))
    n = [t.id for t in interior.room.things].index("crate")
    for step in range(1, 60):
        view = world.step(StepInputs(step, step * 16_666_667))
    assert np.abs(world.things_now[n].position - crate.position).max() < 2e-3
    other = World.restore(world.snapshot())
    assert other.snapshot() == world.snapshot()
    assert other.source == "x"
    assert view.step == 59


def test_a_huge_mesh_is_made_coarser_and_reported(tmp_path: Path) -> None:
    n = 260
    x, z = np.meshgrid(np.linspace(-0.2, 0.2, n), np.linspace(-0.2, 0.2, n))
    lines = [f"v {a:.5f} {0.02 * np.sin(20 * a):.5f} {b:.5f}" for a, b in zip(x.ravel(), z.ravel(), strict=True)]
    for i in range(n - 1):
        lines += [f"f {i * n + j + 1} {i * n + j + 2} {(i + 1) * n + j + 2} {(i + 1) * n + j + 1}" for j in range(n - 1)]
    (tmp_path / "sheet.obj").write_text("\n".join(lines))
    interior = load_things(tmp_path / "sheet.obj", keep=False)
    model = next(iter(interior.models.values()))
    assert len(model.triangles) <= 120_000
    assert any("134,162 triangles, made" in note for note in interior.notes)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("nix.usda", None, "no such file"),
        ("a.blend", "x", "expected a file that ends in"),
        ("a.usda", '#usda 1.0\ndef Xform "World" { broken', "not a whole USD file"),
        ("a.usda", "#usda 1.0\n", "no meshes"),
        ("a.glb", "glTF", "a.glb"),
        ("a.gltf", '{"asset": {"version": "2.0"}}', "no triangles"),
        ("a.obj", "v 0 0\nf 1 1 1\n", "a.obj"),
        ("a.usda", NEWER, "format 9"),
    ],
)
def test_files_that_cannot_be_used_are_refused_in_one_line(name: str, text: str | None, said: str, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(RoomFileError, match=said) as fault:
        load_room(tmp_path / name)
    assert "\n" not in str(fault.value)


def test_looks_follow_what_is_done_to_their_thing() -> None:
    model = block()
    box = looking(meeting_room(1).thing("box"), model)
    models = {model.digest: model}

    def extent(t: Thing) -> list[float]:
        points = np.concatenate([p.surface.vertices.astype(float) for p in pieces_of(t, models)])
        return (0.5 * np.ptp(points, axis=0)).round(4).tolist()

    assert extent(box) == [0.1, 0.05, 0.03]
    assert extent(scaled(box, 1.5)) == [0.15, 0.075, 0.045]
    assert extent(stretched(box, 2.0, np.array([0.0, 0.0, 1.0]))) == [0.1, 0.05, 0.06]
    assert {p.picture is None for p in pieces_of(painted(box, 0xFF0000FF), models)} == {True}
    assert [p.mesh for p in pieces_of(box, {})] == [False]  # without the model its primitive is drawn
    assert from_thing(to_thing(from_thing(box))) == from_thing(box)


def test_the_bulk_of_a_box_is_exact_wherever_it_lies() -> None:
    bulk = bulk_of_mesh(CORNERS * (0.3, 0.2, 0.1) + (5.0, -2.0, 1.0), TRIANGLES)
    assert bulk.volume == pytest.approx(0.6 * 0.4 * 0.2)
    np.testing.assert_allclose(bulk.centre, (5.0, -2.0, 1.0))
    np.testing.assert_allclose(bulk.moments, np.diag([0.09, 0.04, 0.01]) / 3.0, atol=1e-12)


def room() -> Interior:
    return Interior(meeting_room(2))


def test_words_change_a_room() -> None:
    words = "set baton mass=0.2 rigidity=0.8 colour=#102030 then move ball to=0,1,0 turn=90 then remove cone tile "
    words += "then add clay shape=lump elasticity=plastic at=0.1,0 then seat new at=1,1 heading=90 then seat 0 remove"
    interior, told = edited(room(), words.split())
    baton, clay = interior.thing("baton"), interior.thing("clay")
    assert (baton.mass, round(1.0 - baton.compliance, 6), baton.colour) == (0.2, 0.8, 0x102030FF)
    assert interior.thing("ball").position.tolist() == [0.0, 1.0, 0.0]
    assert clay.material.elasticity == "plastic"
    assert clay.position[1] == pytest.approx(0.76, abs=2e-3)
    assert "cone" not in interior.room.by_id
    assert [s.position.tolist() for s in interior.room.seats][-1] == [1.0, 0.0, 1.0]
    assert len(told) == 6


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("set baton mass=-1", "expected a number from 0 to 50"),
        ("set baton weight=1", "expected KEY=VALUE with one of mass"),
        ("set nix mass=1", "no such thing"),
        ("paint baton", "expected set, move"),
        ("set", "after it"),
        ("move ball to=1,2", "expected 3 numbers"),
        ("add ball", "two things have this id"),
        ("add Ball!", "expected an id"),
        ("set baton elasticity=jelly", "elasticity: expected one of"),
        ("add x file=nix.usda", "no such file"),
        ("seat 7 at=0,0", "expected new"),
        ("set baton density=500", "set its mass"),
        ("set all id=x", "its own"),
        ("set baton rigidity=nan", "0 to 1"),
    ],
)
def test_words_that_cannot_be_done_are_refused_in_one_line(words: str, said: str) -> None:
    with pytest.raises(RoomFileError, match=said) as fault:
        edited(room(), words.split())
    assert "\n" not in str(fault.value)


def test_a_room_as_glb_has_each_thing_where_it_is(tmp_path: Path) -> None:
    import trimesh

    model = block()
    things = (looking(meeting_room(1).thing("box"), model), meeting_room(1).thing("ball"))
    interior = Interior(Room((Seat(np.array([0.0, 0.0, 1.0]), 0.5),), ())).with_things(things, {model.digest: model})
    save_glb(interior, tmp_path / "room.glb")
    scene: Any = trimesh.load(tmp_path / "room.glb")
    low, high = scene.bounds
    assert low[1] == pytest.approx(min(things[0].position[1] - 0.05, things[1].position[1] - 0.038), abs=1e-3)
    assert high[1] < 1.0
    assert {"box", "ball", "seat_0"} <= set(scene.graph.nodes)
    assert load_room(tmp_path / "room.glb", keep=False).room.seats[0].heading == pytest.approx(0.5)


def test_real_files_of_others_become_things_that_stand(shared_data: Path) -> None:
    sugar = load_things(shared_data / "object/ycb/004_sugar_box_textured.obj", keep=False)
    (box,) = sugar.room.things
    assert box.mass == pytest.approx(0.38, abs=0.02)
    assert len(box.primitives) <= 2
    assert any("004_sugar_box_textured.png is not there" in n for n in sugar.notes)
    table = load_room(shared_data / "room/wooden_table_02_1k/wooden_table_02_1k.gltf", keep=False)
    assert table.thing("wooden-table-02").fixed
    assert height_at(table.room.things, table.models, 0.0, 0.0) == pytest.approx(0.799, abs=2e-3)


def test_a_room_with_seats_alone_can_be_stepped_and_restored() -> None:
    world = World(Room(meeting_room(2).seats, (), shell=False))
    world.step(StepInputs(1, 16_666_667, (ParticipantBody("ann"),)))
    assert World.restore(world.snapshot()).step(StepInputs(2, 33_333_334)).things == ()
