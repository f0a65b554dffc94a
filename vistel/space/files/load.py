"""Rooms and things from any file that is understood: USD of ours and of others, glTF, GLB, OBJ.

Fitting shapes to a foreign file's meshes takes seconds. The result is kept on this machine as a room of ours, until the
file changes.
"""

import contextlib
import hashlib
import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.avatar.cache_folder import default_cache
from vistel.figure.making.files.read_gltf import read_gltf
from vistel.figure.making.files.read_obj import read_obj
from vistel.figure.making.source import MakingError, SourceMesh
from vistel.figure.usd_fault import reason
from vistel.space.files.faults import RoomFileError
from vistel.space.files.foreign import ForeignFile, PartProperties, found
from vistel.space.files.interior import Interior
from vistel.space.files.seats import gltf_seats, seats_at_chairs, usd_seats
from vistel.space.files.usd_joints import Bodies, read_joints
from vistel.space.files.usd_read import own_room, read_room, read_seats
from vistel.space.files.usd_write import USD_ENDINGS, save_usd
from vistel.space.joints.joined import put_on_joints
from vistel.space.joints.joint import Joint
from vistel.space.room import Room, Seat
from vistel.space.things.things import Thing

GLTF_ENDINGS = (".gltf", ".glb")
ENDINGS = (*USD_ENDINGS, *GLTF_ENDINGS, ".obj")
MOST_THINGS = 400
_KEPT = 6
"""Raised when the same file would be read differently."""
_FAR = 1.5
"""A room whose middle is further from the origin than this is moved there [m]."""
_SHELL = ("wall", "floor")


def load_room(path: Path, *, keep: bool = True) -> Interior:
    """The room of a file. keep: keep the result for a foreign file on this machine. Raises RoomFileError (one line)."""
    return _load(path, None, keep, room=True)


def load_things(path: Path, *, fixed: bool | None = None, keep: bool = True) -> Interior:
    """The things of a file, whose seats and walls mean nothing; fixed: all are, or none is, None: by what they are."""
    return _load(path, fixed, keep, room=False)


def load_seats(path: Path) -> tuple[Seat, ...]:
    """The seats of a room's file, without reading its meshes if possible. Raises RoomFileError (one line)."""
    _check(path)
    try:
        if path.suffix.lower() in USD_ENDINGS:
            stage = _opened(path)
            root = own_room(stage)
            if root:
                return tuple(read_seats(root))
    except ValueError as fault:
        raise _one_line(path, fault) from fault
    return load_room(path).room.seats


def _load(path: Path, fixed: bool | None, keep: bool, room: bool) -> Interior:
    _check(path)
    try:
        if path.suffix.lower() in USD_ENDINGS:
            stage = _opened(path)
            if own_room(stage):
                return read_room(stage, path)
        kept = _kept_file(path, fixed, room) if keep else None
        if kept is not None and kept.is_file():
            with contextlib.suppress(RoomFileError, OSError):
                return read_room(_opened(kept), kept)
        interior = _made(path, fixed, room)
        if kept is not None:
            _keep(interior, kept)
        return interior
    except (MakingError, RoomFileError) as fault:
        raise _one_line(path, fault) from fault
    except OSError as fault:
        raise RoomFileError(f"{path}: cannot be read: {fault.strerror or fault}") from fault


def _check(path: Path) -> None:
    if path.suffix.lower() not in ENDINGS:
        raise RoomFileError(f"{path}: expected a file that ends in {', '.join(ENDINGS)}")
    if not path.is_file():
        raise RoomFileError(f"{path}: no such file; name one that is beside the conference file, or its whole path")


def _one_line(path: Path, fault: Exception) -> RoomFileError:
    text = " ".join(str(fault).split()).replace("the surface of a person", "the surface of a room or a thing")
    return RoomFileError(text if str(path) in text else f"{path}: {text}")


def _opened(path: Path) -> Any:
    from pxr import Tf  # takes long to load

    from vistel.figure.making.files.usd_inside import opened

    try:
        return opened(path)
    except Tf.ErrorException as fault:
        raise RoomFileError(f"{path}: not a whole USD file ({reason(fault)})") from fault


def _made(path: Path, fixed: bool | None, room: bool) -> Interior:
    """The room of a file of others; or its things where they stand in it."""
    ending = path.suffix.lower()
    seats: list[Seat] = []
    jointed: tuple[Any, SourceMesh] | None = None
    if ending in USD_ENDINGS:
        from vistel.figure.making.files.read_usd import read_usd  # USD takes long to load

        stage = _opened(path)
        source = read_usd(path, lambda prim: str(_component(prim).GetPath()))
        whole = found(source, _said(stage), fixed=fixed)
        seats = usd_seats(stage, _to_room(source.unit, source.up))
        jointed = stage, source
    elif ending in GLTF_ENDINGS:
        whole = found(read_gltf(path, apart=True), fixed=fixed)
        seats = gltf_seats(path)
    else:
        whole = found(read_obj(path), fixed=fixed)
    if len(whole.made) > MOST_THINGS:
        raise RoomFileError(f"{path}: {len(whole.made)} things, expected at most {MOST_THINGS}; join what belongs together")
    things, notes = tuple(m.thing for m in whole.made), list[str]()
    if room:
        things, seats, notes = _in_place(whole, seats)
    joints: tuple[Joint, ...] = ()
    if jointed is not None:
        joints = read_joints(jointed[0], path, _bodies(jointed[1], whole, things), things, notes)
        things = put_on_joints(joints, things, notes)
    shell = not any(t.shape in _SHELL for t in things)
    made = Room(tuple(seats or seats_at_chairs(things)), things, shell=shell, joints=joints)
    told = (f"{m.thing.id}: {note}" for m in whole.made for note in m.notes)
    return Interior(made, notes=(*whole.notes, *notes, *told)).with_things(things, {m.model.digest: m.model for m in whole.made})


def _bodies(source: SourceMesh, whole: ForeignFile, things: tuple[Thing, ...]) -> Bodies:
    """What joints of a file of others are between. things: those of `whole` where they stand in the room."""
    from pxr import UsdGeom

    to_room = _to_room(source.unit, source.up)
    if things:
        to_room[:3, 3] += things[0].position - whole.made[0].thing.position
    at = {t.id: t.position for t in things}

    def frame(prim: Any, thing: str) -> F64:
        out = to_room.copy()
        if prim is not None:
            out = out @ np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0.0), np.float64).T
        if thing:
            out[:3, 3] -= at[thing]  # things of others stand straight, in the frame of the room
        return out

    return Bodies({m.group: t.id for m, t in zip(whole.made, things, strict=True)}, frame, source.unit or 1.0)


def _in_place(whole: ForeignFile, seats: list[Seat]) -> tuple[tuple[Thing, ...], list[Seat], list[str]]:
    """Things and seats moved so that the floor is at 0 and the middle not far from the origin."""
    notes: list[str] = []
    lows = np.array([m.thing.position + m.model.vertices.min(axis=0) for m in whole.made])
    highs = np.array([m.thing.position + m.model.vertices.max(axis=0) for m in whole.made])
    shift = np.zeros(3)
    floors = [k for k, m in enumerate(whole.made) if m.thing.shape == "floor"]
    ground = float(highs[floors, 1].max()) if floors else float(min(0.0, lows[:, 1].min()))
    if abs(ground) > 0.01:
        shift[1] = -ground
        notes.append(f"its floor is {ground:.2f} m high: moved to 0")
    tables = [k for k, m in enumerate(whole.made) if m.thing.shape in ("table", "desk")]
    of = tables[:1] if tables else list(range(len(whole.made)))
    middle = 0.5 * (lows[of].min(axis=0) + highs[of].max(axis=0))
    if np.hypot(middle[0], middle[2]) > _FAR and len(whole.made) > 1:
        shift[[0, 2]] = -middle[[0, 2]]
        notes.append(f"its middle is at {middle[0]:.1f}, {middle[2]:.1f}: moved to 0, 0")
    if not shift.any():
        return tuple(m.thing for m in whole.made), seats, notes
    moved = [Seat(s.position + np.array((shift[0], 0.0, shift[2])), s.heading) for s in seats]
    return tuple(replace(m.thing, position=m.thing.position + shift) for m in whole.made), moved, notes


def _component(prim: Any) -> Any:
    """The prim that is one thing with this mesh: a component or rigid body above it, or the Xform that holds it alone."""
    from pxr import Usd, UsdPhysics

    at = prim
    while at and not at.IsPseudoRoot():
        if Usd.ModelAPI(at).GetKind() in ("component", "subcomponent") or at.HasAPI(UsdPhysics.RigidBodyAPI):
            return at
        at = at.GetParent()
    parent = prim.GetParent()
    alone = parent and not parent.IsPseudoRoot() and parent.GetTypeName() == "Xform" and len(parent.GetChildren()) == 1
    return parent if alone else prim


def _said(stage: Any) -> dict[str, PartProperties]:
    """Properties of things from UsdPhysics and our attributes, by the path of their prim."""
    from pxr import UsdPhysics

    out: dict[str, PartProperties] = {}
    for prim in stage.Traverse():
        mass = prim.GetAttribute("physics:mass").Get() if prim.HasAPI(UsdPhysics.MassAPI) else None
        density = prim.GetAttribute("physics:density").Get() if prim.HasAPI(UsdPhysics.MassAPI) else None
        own = prim.GetAttribute("vistel:mass").Get() if prim.HasAttribute("vistel:mass") else None
        fixed = False if prim.HasAPI(UsdPhysics.RigidBodyAPI) else None if own is None else own == 0.0
        weight = own if own else mass if mass else None
        if weight or density or fixed is not None:
            out[str(prim.GetPath())] = PartProperties(weight or None, density or None, fixed)
    return out


def _to_room(unit: float | None, up: str | None) -> F64:
    out = np.eye(4)
    if up == "Z":
        out[:3, :3] = ((1, 0, 0), (0, 0, 1), (0, -1, 0))
    elif up == "X":
        out[:3, :3] = ((0, -1, 0), (1, 0, 0), (0, 0, 1))
    out[:3] *= unit or 1.0
    return out


def _kept_file(path: Path, fixed: bool | None, room: bool) -> Path:
    """The kept file for a foreign file, named by the bytes of that file and of the files beside it."""
    h = hashlib.sha256(f"{_KEPT} {fixed} {room} {path.suffix.lower()}".encode())
    h.update(path.read_bytes())
    near = [p for p in sorted(path.parent.glob("*")) + sorted(path.parent.glob("*/*")) if p.is_file()][:500]
    for p in near:
        stat = p.stat()
        h.update(f"{p.name} {stat.st_size} {stat.st_mtime_ns}".encode())
    return default_cache().parent / "rooms" / f"{h.hexdigest()[:32]}.usdz"


def _keep(interior: Interior, kept: Path) -> None:
    """Written whole or not at all; where it cannot be written, the file is fitted again next time."""
    with contextlib.suppress(OSError):
        kept.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=kept.parent, prefix=".new") as folder:
            save_usd(interior, Path(folder) / kept.name)
            os.replace(Path(folder) / kept.name, kept)
