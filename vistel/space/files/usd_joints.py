"""Joints in USD: PhysicsRevoluteJoint and PhysicsPrismaticJoint with their DriveAPI, as usdview and simulators know them.

Standard attributes are float32 and of degrees. `vistel:exact` keeps the numbers to the last bit; each counts only while it agrees
with its standard attribute, so what another program changes is changed. Of ours are also `vistel:detents` and `vistel:button`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y, rotation_z
from vistel.space.files.faults import RoomFileError
from vistel.space.joints.joint import Button, Detent, Drive, Joint, JointFrame, JointKind, check_joints
from vistel.space.things.things import Thing

_KINDS = {"PhysicsRevoluteJoint": JointKind.HINGE, "PhysicsPrismaticJoint": JointKind.SLIDER}
_ALONG = {"X": np.eye(3), "Y": rotation_z(0.5 * math.pi), "Z": rotation_y(-0.5 * math.pi)}
"""Turns X to where the axis of that name is."""
_DEGREE = math.pi / 180.0


def write_joint(stage: Any, j: Joint, at: str, path_of: Mapping[str, str]) -> None:
    """Write a joint as the prim `at`. path_of: paths of the prims of things, by id."""
    from pxr import Gf, Sdf, UsdPhysics

    hinge = j.kind is JointKind.HINGE
    made = (UsdPhysics.RevoluteJoint if hinge else UsdPhysics.PrismaticJoint).Define(stage, at)
    prim, unit = made.GetPrim(), _DEGREE if hinge else 1.0
    made.CreateAxisAttr("X")
    made.CreateCollisionEnabledAttr(j.collides)
    made.CreateBody1Rel().SetTargets([path_of[j.thing]])
    if j.base:
        made.CreateBody0Rel().SetTargets([path_of[j.base]])
    for place, turn, frame in (
        (made.CreateLocalPos0Attr(), made.CreateLocalRot0Attr(), j.on_base),
        (made.CreateLocalPos1Attr(), made.CreateLocalRot1Attr(), j.on_thing),
    ):
        x, y, z, w = frame.rotation.tolist()
        place.Set(Gf.Vec3f(*frame.point.tolist()))
        turn.Set(Gf.Quatf(w, x, y, z))
    made.CreateLowerLimitAttr(j.lower / unit)
    made.CreateUpperLimitAttr(j.upper / unit)
    if j.drive != Drive():
        drive = UsdPhysics.DriveAPI.Apply(prim, "angular" if hinge else "linear")
        drive.CreateTypeAttr("force")
        drive.CreateStiffnessAttr(j.drive.stiffness * unit)
        drive.CreateDampingAttr(j.drive.damping * unit)
        drive.CreateTargetPositionAttr(j.drive.target / unit)
        drive.CreateMaxForceAttr(j.drive.most)

    def own(name: str, kind: Any, value: Any) -> None:
        prim.CreateAttribute(f"vistel:{name}", kind, True, Sdf.VariabilityUniform).Set(value)

    types = Sdf.ValueTypeNames
    own("id", types.String, j.id)
    own("exact", types.DoubleArray, _numbers(j))
    if j.detents:
        own("detents", types.DoubleArray, [v for d in j.detents for v in (d.at, d.reach, d.force)])
    if j.button:
        own("button", types.DoubleArray, [j.button.press, j.button.release])
        if j.button.lights:
            own("lights", types.String, j.button.lights)
            own("lit", types.String, f"#{j.button.lit:08x}")


def _numbers(j: Joint) -> list[float]:
    """All numbers that standard attributes round: frames, limits, drive."""
    frames = [v for f in (j.on_base, j.on_thing) for v in (*f.point.tolist(), *f.rotation.tolist())]
    return [*frames, j.lower, j.upper, j.drive.stiffness, j.drive.damping, j.drive.target, j.drive.most]


def _exact(stated: list[float], prim: Any, unit: float) -> list[float]:
    """The exact numbers where they agree with what the standard attributes say."""
    kept = prim.GetAttribute("vistel:exact").Get() if prim.HasAttribute("vistel:exact") else None
    if kept is None or len(kept) != len(stated):
        return stated
    # In the unit of the file, since there it was rounded.
    scale = [1.0] * 14 + [1.0 / unit] * 2 + [unit] * 2 + [1.0 / unit, 1.0]
    return [
        float(exact) if np.float32(exact * s) == np.float32(number * s) else number
        for exact, number, s in zip(kept, stated, scale, strict=True)
    ]


@dataclass(frozen=True)
class Bodies:
    """The things of a stage. id_of: their ids by the paths of their prims; prims below those count as them.

    frame: (4, 4) from a prim's own frame (None: the stage's) to that of a thing (empty: the room's), in metres; None where that
    is as it is. unit: metres of one unit of the stage.
    """

    id_of: Mapping[str, str]
    frame: Callable[[Any, str], F64 | None] = lambda prim, thing: None
    unit: float = 1.0


def read_joints(stage: Any, path: Path, bodies: Bodies, things: tuple[Thing, ...], notes: list[str]) -> tuple[Joint, ...]:
    """The joints of a stage between its things.

    What no joint here can be is left out, with a note. Raises RoomFileError, one line with file and prim.
    """
    out: list[Joint] = []
    fixed = {t.id for t in things if t.fixed}
    for prim in stage.Traverse():
        kind = str(prim.GetTypeName())
        where = f"{path}: {prim.GetPath()}"
        if kind not in _KINDS:
            if kind.startswith("Physics") and kind.endswith("Joint"):
                notes.append(f"{prim.GetPath()}: a {kind} is left out; hinges (Revolute) and sliders (Prismatic) are understood")
            continue
        if prim.GetAttribute("physics:jointEnabled").Get() is False:
            notes.append(f"{prim.GetPath()}: switched off, left out")
            continue
        try:
            joint = _read(prim, _KINDS[kind], bodies)
            if {joint.thing, joint.base} <= fixed | {""}:
                notes.append(f"{prim.GetPath()}: both of its bodies stand fast, left out; make one a rigid body with a mass")
                continue
            out.append(_swapped(joint) if joint.thing in fixed | {""} else joint)
        except ValueError as fault:
            raise RoomFileError(f"{where}: {fault}") from fault
    try:
        check_joints(out, things)
    except ValueError as fault:
        raise RoomFileError(f"{path}: {fault}") from fault
    return tuple(out)


def _read(prim: Any, kind: JointKind, bodies: Bodies) -> Joint:
    (base_prim, base), (thing_prim, thing) = (_body(prim, name, bodies.id_of) for name in ("physics:body0", "physics:body1"))
    axis = prim.GetAttribute("physics:axis")
    if not axis.HasAuthoredValue() or axis.Get() not in _ALONG:
        raise ValueError(f"physics:axis: expected X, Y or Z, got {axis.Get() if axis.HasAuthoredValue() else 'none'}")
    along, unit = _ALONG[str(axis.Get())], _DEGREE if kind is JointKind.HINGE else 1.0
    drive = "angular" if kind is JointKind.HINGE else "linear"

    def number(name: str, usual: float) -> float:
        attribute = prim.GetAttribute(name)
        value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
        if value is None:
            return usual
        if math.isnan(value):
            raise ValueError(f"{name}: expected a number, got {value}")
        return float(value)

    frames = [v for end in (0, 1) for v in _frame(prim, end)]
    stated = [
        *frames,
        number("physics:lowerLimit", -math.inf) * unit,
        number("physics:upperLimit", math.inf) * unit,
        number(f"drive:{drive}:physics:stiffness", 0.0) / unit,
        number(f"drive:{drive}:physics:damping", 0.0) / unit,
        number(f"drive:{drive}:physics:targetPosition", 0.0) * unit,
        number(f"drive:{drive}:physics:maxForce", math.inf),
    ]
    n = _exact(stated, prim, unit)
    on_base, on_thing = (
        _moved(JointFrame(np.array(n[k : k + 3]), _turned(np.array(n[k + 3 : k + 7]), along)), bodies.frame(body, name))
        for k, body, name in ((0, base_prim, base), (7, thing_prim, thing))
    )
    if kind is JointKind.SLIDER:
        n[14:16], n[18:20] = (v * bodies.unit for v in n[14:16]), (v * bodies.unit for v in n[18:20])
    else:
        n[16:18], n[19] = (v * bodies.unit**2 for v in n[16:18]), n[19] * bodies.unit**2
    detents = list(prim.GetAttribute("vistel:detents").Get() or ()) if prim.HasAttribute("vistel:detents") else []
    named = prim.GetAttribute("vistel:id").Get() if prim.HasAttribute("vistel:id") else prim.GetName().lower().replace("_", "-")
    return Joint(
        str(named),
        kind,
        thing,
        base,
        on_base,
        on_thing,
        n[14],
        n[15],
        Drive(n[16], n[17], n[18], n[19]),
        tuple(Detent(*map(float, detents[k : k + 3])) for k in range(0, len(detents), 3)),
        _button(prim),
        bool(prim.GetAttribute("physics:collisionEnabled").Get()),
    )


def _body(prim: Any, name: str, id_of: Mapping[str, str]) -> tuple[Any, str]:
    """The prim that a relationship names, and the id of its thing; None and empty for the room."""
    relationship = prim.GetRelationship(name)
    targets: list[Any] = list(relationship.GetTargets()) if relationship else []
    if not targets:
        return None, ""
    at: Any = targets[0]
    while not at.isEmpty and str(at) not in ("/", "."):
        if str(at) in id_of:
            return prim.GetStage().GetPrimAtPath(targets[0]), id_of[str(at)]
        at = at.GetParentPath()
    raise ValueError(f"{name}: there is no thing {targets[0]}")


def _frame(prim: Any, end: int) -> list[float]:
    """Point and quaternion (x, y, z, w) of a joint on a body."""
    place = prim.GetAttribute(f"physics:localPos{end}").Get()
    turn = prim.GetAttribute(f"physics:localRot{end}").Get()
    point = [float(v) for v in place] if place is not None else [0.0] * 3
    quaternion = [*map(float, turn.GetImaginary()), float(turn.GetReal())] if turn is not None else [0.0, 0.0, 0.0, 1.0]
    if not all(map(math.isfinite, (*point, *quaternion))):
        raise ValueError(f"physics:localPos{end} and localRot{end}: expected finite numbers")
    return [*point, *quaternion]


def _moved(frame: JointFrame, by: F64 | None) -> JointFrame:
    """The frame in another one; by: (4, 4), whose scale only moves its point."""
    if by is None:
        return frame
    turn = by[:3, :3] @ frame.matrix
    turn = turn / np.sqrt((turn * turn).sum(axis=0))
    return JointFrame(by[:3, :3] @ frame.point + by[:3, 3], quaternion_from_matrix(np.ascontiguousarray(turn)))


def _turned(quaternion: F64, along: F64) -> F64:
    """A frame whose X is the axis; unchanged where it is X already."""
    if along is _ALONG["X"]:
        return quaternion
    return quaternion_from_matrix(np.ascontiguousarray(matrix_from_quaternion(quaternion) @ along))


def _button(prim: Any) -> Button | None:
    stated = prim.GetAttribute("vistel:button").Get() if prim.HasAttribute("vistel:button") else None
    if stated is None:
        return None
    if len(stated) != 2:
        raise ValueError("vistel:button: expected two numbers, where it is pressed and where it is released")
    lights = str(prim.GetAttribute("vistel:lights").Get()) if prim.HasAttribute("vistel:lights") else ""
    lit = str(prim.GetAttribute("vistel:lit").Get()) if prim.HasAttribute("vistel:lit") else ""
    button = Button(float(stated[0]), float(stated[1]), lights)
    return replace(button, lit=int(lit.removeprefix("#"), 16)) if lit else button


def _swapped(j: Joint) -> Joint:
    """The joint seen from its other body: that one moves."""
    limits = -j.upper, -j.lower
    button = j.button and Button(-j.button.release, -j.button.press, j.button.lights, j.button.lit)
    return replace(
        j,
        thing=j.base,
        base=j.thing,
        on_base=j.on_thing,
        on_thing=j.on_base,
        lower=limits[0],
        upper=limits[1],
        drive=replace(j.drive, target=-j.drive.target),
        detents=tuple(replace(d, at=-d.at) for d in j.detents),
        button=button,
    )
