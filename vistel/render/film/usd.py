"""What is shown of a log as USD: who and what is there as files of their own, and over them where all of it is at each time.

    NAME.usda                  /Conference: People, Room and Cameras, with time samples
    NAME_parts/room.usdc       the room with all things that were ever in it (`vistel.space.files.usd_write`)
    NAME_parts/PERSON.usdc     an avatar (`vistel.figure.formats.usd`)

Figures move as their joints do; that skin deforms where people touch is not in it. A thing that is not there yet, or any more,
is invisible.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.formats import usd as avatar_usd
from vistel.figure.posture.posture import local_joints, pose_joints
from vistel.figure.skeleton import JOINTS, Skeleton
from vistel.render.stage.stage import Instant, ParticipantInfo
from vistel.render.view.camera import SeatCamera
from vistel.space.files.interior import Interior, looks_of
from vistel.space.files.usd_write import save_usd
from vistel.space.things.things import Thing

APERTURE = 24.0
"""Height of the cameras' film [tenths of a unit, as USD has it]."""


@dataclass
class _Kept:
    """A person or a thing over time: number of the frame, and where it was."""

    frames: list[int] = field(default_factory=list[int])
    where: list[Any] = field(default_factory=list[Any])


def write_usd(
    path: Path,
    shown: Iterable[Instant],
    rate: float,
    decor: Interior,
    avatar_of: Callable[[ParticipantInfo], Avatar],
    viewers: Sequence[tuple[str, str]],
) -> int:
    """Write `shown`, `rate` instants a second, as `path` (.usda, .usdc or .usd) and a folder beside it; how many there were.

    decor: the room as it begins; viewers: site and participant of each camera. Raises OSError; ValueError for an avatar that
    cannot be had.
    """
    people: dict[str, tuple[ParticipantInfo, Skeleton, _Kept]] = {}
    things: dict[str, tuple[Thing, _Kept]] = {t.id: (t, _Kept()) for t in decor.room.things if t.fixed}
    avatars: dict[str, Avatar] = {}
    cameras = {site: (viewer, SeatCamera(), _Kept()) for site, viewer in viewers}
    count = 0
    for count, instant in enumerate(shown, 1):
        for person in instant.people:
            name = person.about.name
            if name not in people:
                avatars[name] = avatar_of(person.about)
                people[name] = person.about, avatars[name].skeleton, _Kept()
            joints = pose_joints(people[name][1], person.posture)
            _keep(people[name][2], count, joints)
            for viewer, camera, kept in cameras.values():
                if viewer == name:
                    _keep(kept, count, camera.follow(instant.now_ns, joints))
        for thing_id, pose in instant.world.poses.items():
            if thing_id in instant.things and not instant.things[thing_id].hidden:
                _keep(things.setdefault(thing_id, (instant.things[thing_id], _Kept()))[1], count, pose)
    parts = path.with_name(f"{path.stem}_parts")
    parts.mkdir(exist_ok=True)
    for name, avatar in avatars.items():
        avatar_usd.save_usd(avatar, parts / f"{name}.usdc")
    known = set(decor.models)
    of_room = tuple(t if {k.model for k in looks_of(t)} <= known else replace(t, looks=()) for t, _ in things.values())
    save_usd(decor.with_things(of_room), parts / "room.usdc")
    stage = _Stage(path, rate, count)
    stage.room(f"./{parts.name}/room.usdc", {i: kept for i, (_, kept) in things.items() if kept.frames})
    for name, (_, _, kept) in people.items():
        stage.person(name, f"./{parts.name}/{name}.usdc", kept)
    for site, (_, _, kept) in cameras.items():
        stage.camera(site, kept)
    stage.save()
    return count


def _keep(kept: _Kept, frame: int, where: Any) -> None:
    kept.frames.append(frame)
    kept.where.append(where)


class _Stage:
    """The file over the parts."""

    def __init__(self, path: Path, rate: float, count: int) -> None:
        from pxr import Sdf, Usd, UsdGeom  # takes long to load

        self._path, self._count = path, count
        # A layer of its own until it is whole: what is there already stays when something fails.
        self._layer: Any = Sdf.Layer.CreateAnonymous(path.suffix)
        self._layer.identifier = str(path.with_name(f".{path.stem}.new{path.suffix}"))
        self._stage: Any = Usd.Stage.Open(self._layer)
        UsdGeom.SetStageUpAxis(self._stage, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(self._stage, 1.0)
        self._stage.SetTimeCodesPerSecond(rate)
        self._stage.SetFramesPerSecond(rate)
        self._stage.SetStartTimeCode(1)
        self._stage.SetEndTimeCode(max(1, count))
        root = UsdGeom.Xform.Define(self._stage, "/Conference").GetPrim()
        self._stage.SetDefaultPrim(root)
        Usd.ModelAPI(root).SetKind("assembly")
        for group in ("People", "Cameras"):
            Usd.ModelAPI(UsdGeom.Xform.Define(self._stage, f"/Conference/{group}").GetPrim()).SetKind("group")

    def room(self, file: str, moving: dict[str, _Kept]) -> None:
        """The room, and its things that the log ever describes."""
        from pxr import Gf, UsdGeom

        self._stage.DefinePrim("/Conference/Room").GetReferences().AddReference(file)
        for prim in self._stage.GetPrimAtPath("/Conference/Room/Things").GetChildren():
            kept = moving.get(prim.GetAttribute("vistel:id").Get())
            if kept is None:
                continue
            form = UsdGeom.Xformable(prim)
            move, turn = form.GetOrderedXformOps()
            for frame, (position, rotation) in zip(kept.frames, kept.where, strict=True):
                x, y, z, w = rotation.tolist()
                move.Set(Gf.Vec3d(*position.tolist()), frame)
                turn.Set(Gf.Quatd(w, x, y, z), frame)
            self._seen(UsdGeom.Imageable(prim), kept)

    def person(self, name: str, file: str, kept: _Kept) -> None:
        """An avatar that moves."""
        from pxr import Gf, UsdGeom, UsdSkel, Vt

        at = f"/Conference/People/{name.replace('-', '_')}"
        prim = self._stage.DefinePrim(at)
        prim.GetReferences().AddReference(file)
        animation = UsdSkel.Animation.Define(self._stage, f"{at}/Animation")
        animation.CreateJointsAttr([avatar_usd.joint_path(j) for j in range(len(JOINTS))])
        animation.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1.0)] * len(JOINTS)))
        moves, turns = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
        for frame, joints in zip(kept.frames, kept.where, strict=True):
            position, quaternion = local_joints(joints)
            moves.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(position, np.float32)), frame)
            turns.Set(Vt.QuatfArray([Gf.Quatf(w, x, y, z) for x, y, z, w in quaternion.tolist()]), frame)
        skeleton = self._stage.GetPrimAtPath(f"{at}/Skeleton")
        UsdSkel.BindingAPI.Apply(skeleton).CreateAnimationSourceRel().SetTargets([f"{at}/Animation"])
        self._seen(UsdGeom.Imageable(prim), kept)

    def camera(self, site: str, kept: _Kept) -> None:
        """What the first participant of a site sees."""
        from pxr import Gf, UsdGeom

        if not kept.frames:
            return
        camera = UsdGeom.Camera.Define(self._stage, f"/Conference/Cameras/{site.replace('-', '_')}")
        camera.CreateVerticalApertureAttr(APERTURE)
        camera.CreateHorizontalApertureAttr(APERTURE * 16.0 / 9.0)
        camera.CreateFocalLengthAttr(0.5 * APERTURE / math.tan(0.5 * kept.where[0].field_of_view))
        camera.CreateClippingRangeAttr(Gf.Vec2f(0.05, 50.0))
        form = camera.AddTransformOp(UsdGeom.XformOp.PrecisionDouble)
        for frame, view in zip(kept.frames, kept.where, strict=True):
            matrix = np.eye(4)
            matrix[:3, :3], matrix[3, :3] = view.rotation.T, view.position
            form.Set(Gf.Matrix4d(*matrix.ravel().tolist()), frame)

    def save(self) -> None:
        """Write it whole or not at all."""
        part = self._path.with_name(f".{self._path.stem}.part{self._path.suffix}")
        if not self._layer.Export(str(part)):
            raise OSError(28, "cannot be written", str(self._path))
        part.replace(self._path)

    def _seen(self, image: Any, kept: _Kept) -> None:
        """Visible in the frames in which the log has it."""
        there = set(kept.frames)
        if len(there) == self._count:
            return
        visible = image.CreateVisibilityAttr()
        for frame in range(1, self._count + 1):
            if frame == 1 or (frame in there) != (frame - 1 in there):
                visible.Set("inherited" if frame in there else "invisible", frame)
