"""Joints on file: UsdPhysics' own schemas, read as they were written to the last bit; those of others; faults in one line."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdPhysics

from vistel.space.files import Interior, RoomFileError, load_room, save_usd
from vistel.space.files.edit import edited
from vistel.space.files.place import FromFile, put_into
from vistel.space.inputs import StepInputs
from vistel.space.joints.joined import joined
from vistel.space.joints.joint import JointKind
from vistel.space.joints.json_values import from_joint, to_joint
from vistel.space.room import Room
from vistel.space.things.json_values import from_thing
from vistel.space.world import World

SCRIPT = Path(__file__).parents[4] / "examples/rooms/workshop.py"


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture(scope="module")
def workshop() -> Interior:
    spec = importlib.util.spec_from_file_location("workshop", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.workshop()


def test_the_committed_room_is_what_its_script_writes(workshop: Interior) -> None:
    kept = load_room(SCRIPT.with_suffix(".usdz")).room
    assert [from_joint(j) for j in kept.joints] == [from_joint(j) for j in workshop.room.joints]
    assert [from_thing(t) for t in kept.things] == [from_thing(t) for t in workshop.room.things]


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".usdz"])
def test_joints_are_read_as_they_were_written_to_the_last_bit(ending: str, tmp_path: Path, workshop: Interior) -> None:
    save_usd(workshop, tmp_path / f"room{ending}")
    back = load_room(tmp_path / f"room{ending}")
    assert [from_joint(j) for j in back.room.joints] == [from_joint(j) for j in workshop.room.joints]
    assert [from_thing(t) for t in back.room.things] == [from_thing(t) for t in workshop.room.things]
    assert [from_joint(to_joint(from_joint(j))) for j in back.room.joints] == [from_joint(j) for j in workshop.room.joints]


def test_other_programs_find_joints_of_the_standard(tmp_path: Path, workshop: Interior) -> None:
    save_usd(workshop, tmp_path / "room.usda")
    stage = Usd.Stage.Open(str(tmp_path / "room.usda"))
    lid: Any = UsdPhysics.RevoluteJoint(stage.GetPrimAtPath("/Room/Joints/chest_hinge"))
    assert lid.GetAxisAttr().Get() == "X"
    assert lid.GetUpperLimitAttr().Get() == pytest.approx(105.0)
    assert [str(p) for p in lid.GetBody0Rel().GetTargets()] == ["/Room/Things/chest"]
    assert [str(p) for p in lid.GetBody1Rel().GetTargets()] == ["/Room/Things/chest_lid"]
    drive: Any = UsdPhysics.DriveAPI(lid.GetPrim(), "angular")
    assert drive.GetMaxForceAttr().Get() == pytest.approx(0.7)
    spring: Any = UsdPhysics.DriveAPI(stage.GetPrimAtPath("/Room/Joints/switch"), "linear")
    assert spring.GetStiffnessAttr().Get() == pytest.approx(300.0)
    assert UsdPhysics.PrismaticJoint(stage.GetPrimAtPath("/Room/Joints/drawer_slide"))


def test_what_another_program_changes_is_changed_and_the_rest_stays_exact(tmp_path: Path, workshop: Interior) -> None:
    path = tmp_path / "room.usda"
    save_usd(workshop, path)
    stage = Usd.Stage.Open(str(path))
    stage.GetPrimAtPath("/Room/Joints/chest_hinge").GetAttribute("physics:upperLimit").Set(90.0)
    stage.GetRootLayer().Save()
    new, old = (next(j for j in i.room.joints if j.id == "chest-hinge") for i in (load_room(path), workshop))
    assert new.upper == pytest.approx(0.5 * math.pi)
    assert new.lower == old.lower
    assert new.on_base.point.tolist() == old.on_base.point.tolist()


_BAD: list[tuple[str, Any, str]] = [
    ("chest_hinge", lambda p: p.RemoveProperty("physics:axis"), "physics:axis: expected X, Y or Z, got none"),
    ("chest_hinge", lambda p: p.GetAttribute("physics:axis").Set("W"), "physics:axis: expected X, Y or Z, got W"),
    ("drawer_slide", lambda p: p.GetAttribute("physics:lowerLimit").Set(0.5), "limits: expected the lower one below the upper one"),
    ("drawer_slide", lambda p: p.GetAttribute("physics:lowerLimit").Set(math.nan), "physics:lowerLimit: expected a number"),
    ("drawer_slide", lambda p: p.GetAttribute("physics:localPos0").Set(Gf.Vec3f(math.nan)), "expected finite numbers"),
    ("drawer_slide", lambda p: p.GetRelationship("physics:body1").SetTargets(["/Room/Things/nobody"]), "there is no thing"),
    ("drawer_slide", lambda p: p.GetRelationship("physics:body0").SetTargets(["/Room/Things/drawer"]), "joins drawer to itself"),
    ("drawer_slide", lambda p: p.GetRelationship("physics:body1").SetTargets(["/Room/Things/door"]), "hangs on another joint"),
    ("switch", lambda p: p.GetAttribute("vistel:button").Set([0.1]), "vistel:button: expected two numbers"),
    ("switch", lambda p: p.GetAttribute("vistel:button").Set([0.0, -1.0]), "button: expected a press below its release"),
    ("switch", lambda p: p.GetAttribute("drive:linear:physics:stiffness").Set(-5.0), "stiffness and damping"),
]


@pytest.mark.parametrize(("prim", "spoil", "line"), _BAD)
def test_bad_joints_are_refused_in_one_line_with_file_and_prim(
    prim: str, spoil: Any, line: str, tmp_path: Path, workshop: Interior
) -> None:
    path = tmp_path / "room.usda"
    save_usd(workshop, path)
    stage = Usd.Stage.Open(str(path))
    spoil(stage.GetPrimAtPath(f"/Room/Joints/{prim}"))
    stage.GetRootLayer().Save()
    with pytest.raises(RoomFileError) as told:
        load_room(path)
    text = str(told.value)
    assert line in text
    assert "\n" not in text
    assert str(path) in text
    assert prim in text or prim.replace("_", "-") in text


def _cube(stage: Any, at: str, half: tuple[float, float, float], place: tuple[float, float, float], mass: float | None) -> None:
    form = UsdGeom.Xform.Define(stage, at)
    form.AddTranslateOp().Set(Gf.Vec3d(*place))
    Usd.ModelAPI(form.GetPrim()).SetKind("component")
    if mass is not None:
        UsdPhysics.RigidBodyAPI.Apply(form.GetPrim())
        UsdPhysics.MassAPI.Apply(form.GetPrim()).CreateMassAttr(mass)
    mesh = UsdGeom.Mesh.Define(stage, f"{at}/Shape")
    corners = [Gf.Vec3f(x * half[0], y * half[1], z * half[2]) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    mesh.CreatePointsAttr(corners)
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr([v for quad in quads for v in quad])
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)


def _of_others(path: Path) -> None:
    """A desk and a drawer in centimetres, Z up, by a program that knows nothing of us; the desk is named as the one that moves."""
    stage: Any = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    _cube(stage, "/World/desk", (60.0, 30.0, 35.0), (0.0, 0.0, 35.0), None)
    _cube(stage, "/World/drawer", (15.0, 15.0, 5.0), (0.0, -46.0, 50.0), 1.5)
    slide: Any = UsdPhysics.PrismaticJoint.Define(stage, "/World/slide")
    slide.CreateAxisAttr("Y")
    slide.CreateBody0Rel().SetTargets(["/World/drawer"])
    slide.CreateBody1Rel().SetTargets(["/World/desk"])
    slide.CreateLocalPos0Attr(Gf.Vec3f(0.0, 0.0, 0.0))
    slide.CreateLocalPos1Attr(Gf.Vec3f(0.0, -46.0, 15.0))
    slide.CreateLowerLimitAttr(0.0)
    slide.CreateUpperLimitAttr(25.0)
    ball: Any = UsdPhysics.SphericalJoint.Define(stage, "/World/ball")
    ball.CreateBody1Rel().SetTargets(["/World/drawer"])
    stage.GetRootLayer().Save()


def test_joints_of_others_are_put_into_metres_with_y_up_and_seen_from_what_stands_fast(tmp_path: Path) -> None:
    _of_others(tmp_path / "desk.usda")
    for _ in range(2):  # as read, and as kept
        found = load_room(tmp_path / "desk.usda")
        (joint,) = found.room.joints
        assert (joint.thing, joint.base, joint.kind) == ("drawer", "desk", JointKind.SLIDER)
        assert (joint.lower, joint.upper) == (pytest.approx(-0.25), pytest.approx(0.0))
        assert any("PhysicsSphericalJoint is left out" in note for note in found.notes)
        whole = joined(found.room.joints, found.room.things)
        position = np.array([t.position for t in found.room.things])
        rotation = np.array([t.rotation for t in found.room.things])
        out, _ = whole.posed(0, -0.25, position, rotation)
        n = int(whole.ends[0, 1])
        np.testing.assert_allclose(out - position[n], [0.0, 0.0, 0.25], atol=1e-6)  # their -Y is our +Z
    world = World(found.room)
    for k in range(1, 60):
        view = world.step(StepInputs(k, k * 16_666_667))
    drawer = next(s for s in view.states if s.id == "drawer")
    np.testing.assert_allclose(drawer.position, found.room.thing("drawer").position, atol=1e-4)


def test_words_that_change_a_room_keep_its_joints(workshop: Interior) -> None:
    renamed, _ = edited(workshop, ["set", "drawer", "id=tray"])
    assert next(j for j in renamed.room.joints if j.id == "drawer-slide").thing == "tray"
    moved, _ = edited(workshop, ["move", "chest", "by=0.1,0,0.05", "turn=30"])
    whole = joined(moved.room.joints, moved.room.things)
    position, rotation = (np.array([getattr(t, name) for t in moved.room.things]) for name in ("position", "rotation"))
    k = whole.of_thing["chest-lid"]
    there, _ = whole.posed(k, 0.0, position, rotation)
    np.testing.assert_allclose(moved.room.thing("chest-lid").position, there, atol=1e-12)
    assert np.linalg.norm(there - workshop.room.thing("chest-lid").position) > 0.05
    gone, _ = edited(workshop, ["remove", "chest"])
    assert "chest-hinge" not in [j.id for j in gone.room.joints]
    with pytest.raises(RoomFileError, match="chest-lid hangs on the joint chest-hinge; move chest"):
        edited(workshop, ["move", "chest-lid", "by=1,0,0"])


def test_a_thing_from_a_file_brings_its_joints_into_a_room(tmp_path: Path, workshop: Interior) -> None:
    alone = tuple(t for t in workshop.room.things if t.id in ("tin", "tin-lid"))
    save_usd(Interior(Room((), (), joints=workshop.room.joints)).with_things(alone), tmp_path / "tin.usda")
    den = Interior(Room((), tuple(t for t in workshop.room.things if t.id == "bench")))
    room, ids = put_into(den, FromFile(tmp_path / "tin.usda", "box", at=(0.2, 0.1), turn=40.0))
    assert ids == ("box-tin", "box-tin-lid")
    (joint,) = room.room.joints
    assert (joint.id, joint.thing, joint.base) == ("box-tin-hinge", "box-tin-lid", "box-tin")
    whole = joined(room.room.joints, room.room.things)
    position, rotation = (np.array([getattr(t, name) for t in room.room.things]) for name in ("position", "rotation"))
    there, _ = whole.posed(0, 0.0, position, rotation)
    np.testing.assert_allclose(there, room.room.thing("box-tin-lid").position, atol=1e-9)
