"""Rooms of VISTEL read back from USD: what `vistel.space.files.usd_write` wrote, to the last bit."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.making.pictures import decode
from vistel.figure.making.source import MakingError, SourceMaterial
from vistel.space.files.faults import RoomFileError
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.space.files.travel import finish_read
from vistel.space.files.usd_joints import Bodies, read_joints
from vistel.space.files.usd_write import FORMAT
from vistel.space.joints.joined import put_on_joints
from vistel.space.room import Room, Seat
from vistel.space.things.json_values import from_thing, to_thing
from vistel.space.things.things import BEARS, GraspAxis, Look, PhysicsMaterial, Thing, ThingPrimitive

OWN_LARGEST = 8192
"""Texels along a side of a picture of ours, which is kept as it is: 200 MB at most."""


def own_room(stage: Any) -> Any:
    """The prim of a room of VISTEL; None in files of others."""
    root = stage.GetDefaultPrim()
    return root if root and root.HasAttribute("vistel:shell") else None


def read_room(stage: Any, path: Path) -> Interior:
    """The room of a stage in which `own_room` finds one. Raises RoomFileError for one that is damaged or newer."""
    root = own_room(stage)
    version = root.GetAttribute("vistel:format").Get()
    if version != FORMAT:
        raise RoomFileError(f"{path}: room format {version}, expected {FORMAT}; it was written by another version of VISTEL")
    try:
        return _Reader(stage, path).room(root)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, RuntimeError) as fault:
        if isinstance(fault, RoomFileError):
            raise
        raise RoomFileError(f"{path}: not a whole room ({str(fault)[:120]}); save it again") from fault


def read_seats(root: Any) -> list[Seat]:
    """The seats of a room of ours."""
    out: list[tuple[int, Seat]] = []
    seats = root.GetStage().GetPrimAtPath(f"{root.GetPath()}/Seats")
    for prim in seats.GetChildren() if seats else ():
        if prim.HasAttribute("vistel:seat"):
            position = np.array(prim.GetAttribute("xformOp:translate").Get(), np.float64)
            out.append((int(prim.GetAttribute("vistel:seat").Get()), Seat(position, float(_get(prim, "heading")))))
    return [seat for _, seat in sorted(out, key=lambda row: row[0])]


class _Reader:
    def __init__(self, stage: Any, path: Path) -> None:
        self.stage, self.path, self.notes = stage, path, list[str]()
        self.models: dict[str, Polymesh] = {}
        self.pictures: dict[str, NDArray[np.uint8] | None] = {}

    def room(self, root: Any) -> Interior:
        things = self.stage.GetPrimAtPath(f"{root.GetPath()}/Things")
        prims = [prim for prim in (things.GetChildren() if things else ()) if prim.HasAttribute("vistel:id")]
        found = tuple(self._thing(prim) for prim in prims)
        id_of = {str(prim.GetPath()): t.id for prim, t in zip(prims, found, strict=True)}
        joints = read_joints(self.stage, self.path, Bodies(id_of), found, self.notes)
        self.notes[:0] = [str(n) for n in _get(root, "notes", None) or ()]
        found = put_on_joints(joints, found, self.notes)
        room = Room(tuple(read_seats(root)), found, shell=bool(_get(root, "shell")), joints=joints)
        return Interior(room, notes=tuple(self.notes)).with_things(found, self.models)

    def _thing(self, prim: Any) -> Thing:
        from pxr import UsdGeom

        where = f"{self.path}: {_get(prim, 'id')}"
        try:
            compliance = 1.0 - float(_get(prim, "rigidity"))
            exact = _get(prim, "compliance", None)
            if exact is not None and abs(exact - compliance) < 1e-12:
                compliance = float(exact)
            glue = float(_get(prim, "sticky")), float(_get(prim, "bears", BEARS))
            material = PhysicsMaterial(str(_get(prim, "elasticity")), float(_get(prim, "recovery")), *glue)
            inertia = _get(prim, "inertia", None)
            looks = [child for child in prim.GetChildren() if child.HasAttribute("vistel:model")]
            thing = Thing(
                str(_get(prim, "id")),
                str(_get(prim, "name")),
                str(_get(prim, "shape")),
                self._primitives(prim),
                float(_get(prim, "mass")),
                compliance,
                _colour(_get(prim, "colour")),
                _position(prim),
                _rotation(prim),
                _axes(prim),
                material,
                looks=tuple(self._look(child) for child in looks),
                inertia=None if inertia is None else np.array(inertia, np.float64).reshape(3, 3),
                hidden=UsdGeom.Imageable(prim).GetVisibilityAttr().Get() == UsdGeom.Tokens.invisible,
            )
            made = _get(prim, "made", None)
            return to_thing(from_thing(thing) | json.loads(made)) if made else thing
        except (ValueError, TypeError, KeyError) as fault:
            if isinstance(fault, RoomFileError):
                raise
            raise RoomFileError(f"{where}: {str(fault)[:160]}") from fault

    def _primitives(self, prim: Any) -> tuple[ThingPrimitive, ...]:
        kinds, counts = list(_get(prim, "primitive:kind")), list(_get(prim, "primitive:count"))
        params = np.array(_get(prim, "primitive:params"), np.float64)
        positions = np.array(_get(prim, "primitive:position"), np.float64).reshape(-1, 3)
        rotations = np.array(_get(prim, "primitive:rotation"), np.float64).reshape(-1, 4)
        colours = [_colour(c) for c in _get(prim, "primitive:colour")]
        ends = np.cumsum([0, *counts])
        if not len(kinds) == len(counts) == len(positions) == len(rotations) == len(colours) or ends[-1] != len(params):
            raise ValueError("primitives of different counts; save the room again")
        return tuple(
            ThingPrimitive(str(kind), tuple(params[a:b].tolist()), p, q, c)
            for kind, a, b, p, q, c in zip(kinds, ends, ends[1:], positions, rotations, colours, strict=False)
        )

    def _look(self, prim: Any) -> Look:
        from pxr import UsdGeom

        told, colour = str(_get(prim, "model")), _colour(_get(prim, "colour"))
        if told not in self.models:
            model = self._model(prim)
            lacking = any(json.loads(text)[2] for text in _get(prim, "materials")) and any(
                m.picture is None and json.loads(text)[2] for m, text in zip(model.materials, _get(prim, "materials"), strict=True)
            )
            if model.digest != told and not lacking:  # it goes by what the mesh is now
                self.notes.append(f"{prim.GetPath()}: changed by another program; its weight and what is felt of it are as before")
            self.models[told if model.digest == told else model.digest] = model
            told = model.digest
        whole = np.array(UsdGeom.Xformable(prim).GetLocalTransformation(), np.float64)
        return Look(told, np.ascontiguousarray(whole[:3, :3].T), np.ascontiguousarray(whole[3, :3]), colour)

    def _model(self, prim: Any) -> Polymesh:
        from pxr import UsdGeom

        mesh = UsdGeom.Mesh(prim)
        vertices = np.array(mesh.GetPointsAttr().Get(), np.float32).reshape(-1, 3)
        triangles = np.array(mesh.GetFaceVertexIndicesAttr().Get(), np.int32).reshape(-1, 3)
        if not len(triangles) or triangles.min() < 0 or triangles.max() >= len(vertices) or not np.isfinite(vertices).all():
            raise RoomFileError(f"{self.path}: {prim.GetPath()}: faces of vertices that are not there; save the room again")
        uv, uv_triangles = np.zeros((0, 2), np.float32), np.full(triangles.shape, -1, np.int32)
        st = UsdGeom.PrimvarsAPI(prim).GetPrimvar("st")
        if st and st.HasValue():
            uv = np.array(st.Get(), np.float32).reshape(-1, 2)
            uv_triangles = np.array(st.GetIndices(), np.int32).reshape(-1, 3)
            uv_triangles[np.array(_get(prim, "bare", None) or [], np.int64)] = -1
        material = np.array(_get(prim, "material"), np.int32)
        materials = tuple(self._material(text) for text in _get(prim, "materials"))
        if len(uv_triangles) != len(triangles) or len(material) != len(triangles) or uv_triangles.max(initial=-1) >= len(uv):
            raise RoomFileError(f"{self.path}: {prim.GetPath()}: places in the picture of other faces; save the room again")
        if material.min() < 0 or material.max() >= len(materials):
            raise RoomFileError(f"{self.path}: {prim.GetPath()}: a material that is not there; save the room again")
        return Polymesh(vertices, triangles, uv, uv_triangles, material, materials)

    def _material(self, text: str) -> SourceMaterial:
        name, colour, digest, *more = json.loads(text)
        own = None if colour is None else (int(colour[0]), int(colour[1]), int(colour[2]))
        return SourceMaterial(str(name), own, self._picture(str(digest)) if digest else None, finish_read(more))

    def _picture(self, digest: str) -> NDArray[np.uint8] | None:
        if digest not in self.pictures:
            self.pictures[digest] = self._decoded(f"./{self._folder()}/{digest}.png")
        return self.pictures[digest]

    def _folder(self) -> str:
        """Where the file says its pictures are."""
        for prim in self.stage.GetPrimAtPath("/Room/Materials").GetChildren():
            texture = self.stage.GetPrimAtPath(f"{prim.GetPath()}/Texture")
            if texture:
                return str(Path(texture.GetAttribute("inputs:file").Get().path).parent)
        return f"{self.path.stem}_textures"

    def _decoded(self, asset: str) -> NDArray[np.uint8] | None:
        from pxr import Ar, Sdf

        from vistel.figure.making.files.usd_inside import asset_bytes

        layer = self.stage.GetRootLayer()
        found = Ar.GetResolver().Resolve(Sdf.ComputeAssetPathRelativeToLayer(layer, asset))
        try:
            data = asset_bytes(str(found), self.path)
            if data is None:
                self.notes.append(f"texture {asset} is not there; a plain colour instead (put it beside the file)")
                return None
            return decode(data, OWN_LARGEST, notes=self.notes, name=f"texture {asset}")
        except MakingError as fault:
            self.notes.append(f"texture {asset}: {fault}; a plain colour instead")
            return None


def _get(prim: Any, name: str, *default: Any) -> Any:
    value = prim.GetAttribute(f"vistel:{name}").Get() if prim.HasAttribute(f"vistel:{name}") else None
    if value is None and not default:
        raise ValueError(f"{prim.GetPath()} lacks vistel:{name}")
    return default[0] if value is None else value


def _position(prim: Any) -> F64:
    return np.array(prim.GetAttribute("xformOp:translate").Get(), np.float64).reshape(3)


def _rotation(prim: Any) -> F64:
    q = prim.GetAttribute("xformOp:orient").Get()
    return np.array([*q.GetImaginary(), q.GetReal()], np.float64)


def _axes(prim: Any) -> tuple[GraspAxis, ...]:
    radii = _get(prim, "axis:radius", None)
    if radii is None:
        return ()
    points, directions = (np.array(_get(prim, f"axis:{n}"), np.float64).reshape(-1, 3) for n in ("point", "direction"))
    return tuple(GraspAxis(p, d, float(r)) for p, d, r in zip(points, directions, radii, strict=True))


def _colour(text: Any) -> int:
    digits = str(text).removeprefix("#")
    if len(digits) == 6:
        digits += "ff"
    if len(digits) != 8:
        raise ValueError(f"colour: expected #rrggbb or #rrggbbaa, got {text!r}")
    return int(digits, 16)
