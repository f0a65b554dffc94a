"""Rooms in USD that usdview and Blender open, with all that the world needs as attributes, numbers kept exactly.

/Room                Xform, kind assembly; vistel:format, vistel:shell
/Room/Seats/seat_N   Xform: where somebody sits, facing its +Z
/Room/Things/ID      Xform, kind component: a thing where it starts. vistel:... say what it is, UsdPhysics its mass
/Room/Things/ID/Look_N   Mesh: what is drawn for it, with texture coordinates (st)
/Room/Things/ID/Body     Mesh: its own primitives, for programs that know none
/Room/Joints/ID      PhysicsRevoluteJoint, PhysicsPrismaticJoint: what hangs on what (`usd_joints`)
/Room/Materials      UsdPreviewSurface, for every face: colours, and pictures in the folder NAME_textures beside the file
                     (inside a .usdz)
"""

import hashlib
import json
import os
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vistel.figure.making.source import SourceMaterial
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.space.files.surfaces import PLAIN, rgb
from vistel.space.files.travel import finish_told
from vistel.space.files.usd_joints import write_joint
from vistel.space.things.json_values import from_thing
from vistel.space.things.tessellate import join, tessellate_thing
from vistel.space.things.things import BEARS, Thing

USD_ENDINGS = (".usda", ".usdc", ".usd", ".usdz")
FORMAT = 1
_PICTURE = re.compile(r"^[0-9a-f]{16}\.png$")


def save_usd(interior: Interior, path: Path) -> None:
    """Writes .usda, .usdc, .usd or .usdz, whole or not at all. Raises OSError, and ValueError for another ending."""
    ending = path.suffix.lower()
    if ending not in USD_ENDINGS:
        raise ValueError(f"{path}: expected a name that ends in {', '.join(USD_ENDINGS)}")
    from pxr import Tf, UsdUtils  # takes long to load

    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.stem}") as folder:
        packed = ending == ".usdz"
        stage = Path(folder) / (f"{path.stem}.usdc" if packed else path.name)
        pictures = Path(folder) / f"{path.stem}_textures"
        try:
            _Writer(stage, pictures).room(interior)
        except Tf.ErrorException as fault:
            raise OSError(f"{path}: cannot be written ({str(fault).splitlines()[-1].strip()})") from fault
        if packed:
            package = Path(folder) / path.name
            if not UsdUtils.CreateNewUsdzPackage(str(stage), str(package)):
                raise OSError(f"{path}: could not be packed")
            os.replace(package, path)
            return
        # Pictures are named by what they show: old file and new one both find theirs at any moment.
        beside = path.with_name(pictures.name)
        fresh = sorted(pictures.iterdir()) if pictures.is_dir() else []
        if fresh:
            beside.mkdir(exist_ok=True)
        for picture in fresh:
            os.replace(picture, beside / picture.name)
        os.replace(stage, path)
        _tidy(beside, {p.name for p in fresh})


def _tidy(folder: Path, used: set[str]) -> None:
    """Remove pictures of ours that the file no longer names."""
    if folder.is_dir():
        for old in folder.iterdir():
            if _PICTURE.match(old.name) and old.name not in used:
                old.unlink(missing_ok=True)
        if not any(folder.iterdir()):
            folder.rmdir()


class _Writer:
    def __init__(self, path: Path, pictures: Path) -> None:
        from pxr import Usd, UsdGeom, UsdPhysics

        self.stage: Any = Usd.Stage.CreateNew(str(path))
        self.pictures = pictures
        self.materials: dict[str, Any] = {}
        UsdGeom.SetStageUpAxis(self.stage, UsdGeom.Tokens.y)
        UsdGeom.SetStageMetersPerUnit(self.stage, 1.0)
        UsdPhysics.SetStageKilogramsPerUnit(self.stage, 1.0)

    def room(self, interior: Interior) -> None:
        from pxr import Sdf, Usd, UsdGeom

        root = UsdGeom.Xform.Define(self.stage, "/Room").GetPrim()
        self.stage.SetDefaultPrim(root)
        Usd.ModelAPI(root).SetKind("assembly")
        keep(root, "format", Sdf.ValueTypeNames.Int, FORMAT)
        keep(root, "shell", Sdf.ValueTypeNames.Bool, interior.room.shell)
        if interior.notes:
            keep(root, "notes", Sdf.ValueTypeNames.StringArray, list(interior.notes))
        for scope in ("Seats", "Things"):
            Usd.ModelAPI(UsdGeom.Xform.Define(self.stage, f"/Room/{scope}").GetPrim()).SetKind("group")
        UsdGeom.Scope.Define(self.stage, "/Room/Materials")
        for n, seat in enumerate(interior.room.seats):
            turn = np.array([0.0, np.sin(0.5 * seat.heading), 0.0, np.cos(0.5 * seat.heading)])
            prim = self._placed(f"/Room/Seats/seat_{n}", seat.position, turn)
            keep(prim, "seat", Sdf.ValueTypeNames.Int, n)
            keep(prim, "heading", Sdf.ValueTypeNames.Double, seat.heading)
        names: set[str] = set()
        paths = {t.id: f"/Room/Things/{_prim_name(t.id, names)}" for t in interior.room.things}
        for thing in interior.room.things:
            self._thing(thing, paths[thing.id], interior)
        if interior.room.joints:
            UsdGeom.Scope.Define(self.stage, "/Room/Joints")
        names = set()
        for joint in interior.room.joints:
            write_joint(self.stage, joint, f"/Room/Joints/{_prim_name(joint.id, names)}", paths)
        self.stage.GetRootLayer().Save()

    def _placed(self, at: str, position: NDArray[np.float64], rotation: NDArray[np.float64]) -> Any:
        from pxr import Gf, UsdGeom

        form = UsdGeom.Xform.Define(self.stage, at)
        form.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*position.tolist()))
        x, y, z, w = rotation.tolist()
        form.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(w, x, y, z))
        return form.GetPrim()

    def _thing(self, t: Thing, at: str, interior: Interior) -> None:
        from pxr import Sdf, Usd, UsdGeom, UsdPhysics

        types = Sdf.ValueTypeNames
        prim = self._placed(at, t.position, t.rotation)
        Usd.ModelAPI(prim).SetKind("component")
        text = (("id", t.id), ("name", t.name), ("shape", t.shape), ("colour", f"#{t.colour:08x}"))
        for key, value in (*text, ("elasticity", t.material.elasticity)):
            keep(prim, key, types.String, value)
        m = t.material
        numbers = [("mass", t.mass), ("rigidity", 1.0 - t.compliance), ("recovery", m.recovery), ("sticky", m.sticky)]
        for key, value in [*numbers, ("bears", m.bears)] if m.bears != BEARS else numbers:
            keep(prim, key, types.Double, value)
        if 1.0 - (1.0 - t.compliance) != t.compliance:  # its last bit
            keep(prim, "compliance", types.Double, t.compliance)
        if t.inertia is not None:
            keep(prim, "inertia", types.DoubleArray, t.inertia.ravel().tolist())
        if t.hidden:
            UsdGeom.Imageable(prim).MakeInvisible()
        self._primitives(prim, t)
        if t.axes:
            keep(prim, "axis:point", types.Double3Array, [_vec(a.point) for a in t.axes])
            keep(prim, "axis:direction", types.Double3Array, [_vec(a.direction) for a in t.axes])
            keep(prim, "axis:radius", types.DoubleArray, [a.radius for a in t.axes])
        if t.parts or t.curve:
            whole = from_thing(t)
            keep(prim, "made", types.String, json.dumps({k: whole[k] for k in ("parts", "curve")}, separators=(",", ":")))
        if not t.fixed:
            UsdPhysics.RigidBodyAPI.Apply(prim)
            UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(float(t.mass))
        for n, look in enumerate(t.looks):
            self._look(f"{at}/Look_{n}", look.model, look.matrix, look.offset, look.colour, interior.models)
        self._body(f"{at}/Body", t)

    def _primitives(self, prim: Any, t: Thing) -> None:
        from pxr import Gf, Sdf

        types = Sdf.ValueTypeNames
        keep(prim, "primitive:kind", types.StringArray, [p.kind for p in t.primitives])
        keep(prim, "primitive:count", types.IntArray, [len(p.params) for p in t.primitives])
        keep(prim, "primitive:params", types.DoubleArray, [v for p in t.primitives for v in p.params])
        keep(prim, "primitive:position", types.Double3Array, [_vec(p.position) for p in t.primitives])
        keep(prim, "primitive:rotation", types.Double4Array, [Gf.Vec4d(*p.rotation.tolist()) for p in t.primitives])
        keep(prim, "primitive:colour", types.StringArray, [f"#{p.colour:08x}" for p in t.primitives])

    def _look(self, at: str, digest: str, matrix: Any, offset: Any, colour: int, models: Any) -> None:
        from pxr import Gf, Sdf, UsdGeom, Vt

        types = Sdf.ValueTypeNames
        m: Polymesh = models[digest]
        mesh = self._mesh(at, m.vertices, m.triangles)
        prim = mesh.GetPrim()
        whole = np.eye(4)
        whole[:3, :3], whole[3, :3] = matrix.T, offset
        mesh.AddTransformOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Matrix4d(*whole.ravel().tolist()))
        keep(prim, "model", types.String, digest)
        keep(prim, "colour", types.String, f"#{colour:08x}")
        if len(m.uv):
            bare = m.uv_triangles < 0
            st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", types.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
            st.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(m.uv, np.float32)))
            st.SetIndices(Vt.IntArray.FromNumpy(np.ascontiguousarray(np.maximum(m.uv_triangles, 0).ravel(), np.int32)))
            if bare.any():
                keep(prim, "bare", types.IntArray, np.flatnonzero(bare.all(axis=1)).tolist())
        keep(prim, "material", types.IntArray, Vt.IntArray.FromNumpy(np.ascontiguousarray(m.material, np.int32)))
        self._bind(mesh, m, colour)

    def _bind(self, mesh: Any, m: Polymesh, colour: int) -> None:
        from pxr import Sdf

        keep(mesh.GetPrim(), "materials", Sdf.ValueTypeNames.StringArray, [self._told(x) for x in m.materials])
        if colour:
            self._paint(mesh, [colour], np.zeros(len(m.triangles), np.int32))
            return
        self._share([self._material(x) for x in m.materials], mesh, m.material)

    def _paint(self, mesh: Any, colours: list[int], of_face: NDArray[np.int32]) -> None:
        """Plain colours, 0xRRGGBBAA, for programs that draw materials and for those that draw display colours."""
        from pxr import UsdGeom

        numbers, number = np.unique(of_face, return_inverse=True)
        used: list[int] = [colours[n] for n in numbers.tolist()]
        if len(used) == 1:
            mesh.CreateDisplayColorAttr([_linear(used[0])])
        else:
            shown = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
                "displayColor", mesh.GetDisplayColorAttr().GetTypeName(), UsdGeom.Tokens.uniform
            )
            shown.Set([_linear(c) for c in used])
            shown.SetIndices(number.tolist())
        self._share([self._material(SourceMaterial("", rgb(c))) for c in used], mesh, number)

    def _share(self, made: list[Any], mesh: Any, of_face: NDArray[np.integer[Any]]) -> None:
        """Bind a material to each face; of_face: (F,) which of those `made`."""
        from pxr import UsdGeom, UsdShade

        if len(made) == 1:
            UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(made[0])
            return
        UsdGeom.Subset.SetFamilyType(mesh, UsdShade.Tokens.materialBind, UsdGeom.Tokens.partition)
        for n, material in enumerate(made):
            rows = np.flatnonzero(of_face == n).tolist()
            subset = UsdGeom.Subset.CreateGeomSubset(mesh, f"part_{n}", UsdGeom.Tokens.face, rows, UsdShade.Tokens.materialBind)
            UsdShade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)

    def _told(self, m: SourceMaterial) -> str:
        """A material as the attribute holds it."""
        return json.dumps([m.name, m.colour, _digest(m.picture), *finish_told(m)], ensure_ascii=False)

    def _material(self, m: SourceMaterial) -> Any:
        from pxr import Sdf, UsdShade

        key = self._told(m)
        if key in self.materials:
            return self.materials[key]
        types, at = Sdf.ValueTypeNames, f"/Room/Materials/material_{len(self.materials)}"
        material = self.materials[key] = UsdShade.Material.Define(self.stage, at)
        surface = UsdShade.Shader.Define(self.stage, f"{at}/Surface")
        surface.CreateIdAttr("UsdPreviewSurface")
        finish = m.finish or PLAIN
        surface.CreateInput("roughness", types.Float).Set(finish.roughness)
        surface.CreateInput("metallic", types.Float).Set(finish.metallic)
        colour = surface.CreateInput("diffuseColor", types.Color3f)
        if m.picture is not None:
            reader = UsdShade.Shader.Define(self.stage, f"{at}/TextureCoordinates")
            reader.CreateIdAttr("UsdPrimvarReader_float2")
            reader.CreateInput("varname", types.String).Set("st")
            picture = UsdShade.Shader.Define(self.stage, f"{at}/Texture")
            picture.CreateIdAttr("UsdUVTexture")
            picture.CreateInput("file", types.Asset).Set(Sdf.AssetPath(self._picture(m.picture)))
            picture.CreateInput("sourceColorSpace", types.Token).Set("sRGB")
            for side in ("wrapS", "wrapT"):
                picture.CreateInput(side, types.Token).Set("repeat")
            picture.CreateInput("st", types.Float2).ConnectToSource(reader.CreateOutput("result", types.Float2))
            colour.ConnectToSource(picture.CreateOutput("rgb", types.Float3))
        else:
            r, g, b = m.colour or (180, 180, 180)
            colour.Set(_linear(r << 24 | g << 16 | b << 8))
        material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", types.Token))
        return material

    def _picture(self, picture: NDArray[np.uint8]) -> str:
        """Writes a picture; its path as the file names it."""
        self.pictures.mkdir(exist_ok=True)
        name = f"{_digest(picture)}.png"
        if not (self.pictures / name).exists():
            Image.fromarray(picture).save(self.pictures / name, compress_level=4)
        return f"./{self.pictures.name}/{name}"

    def _body(self, at: str, t: Thing) -> None:
        """What is drawn of its own primitives."""
        from pxr import Sdf

        drawn = t.curve.straight if t.curve else t
        seen = [(s, p.colour or t.colour) for s, p in zip(tessellate_thing(t, 0.7), drawn.primitives, strict=True) if p.seen]
        if not seen:
            return
        surface = join([s for s, _ in seen])
        mesh = self._mesh(at, surface.vertices, surface.triangles)
        keep(mesh.GetPrim(), "body", Sdf.ValueTypeNames.Bool, True)
        colours = list(dict.fromkeys(c for _, c in seen))
        of_face = np.repeat([colours.index(c) for _, c in seen], [len(s.triangles) for s, _ in seen])
        self._paint(mesh, colours, of_face.astype(np.int32))

    def _mesh(self, at: str, vertices: Any, triangles: Any) -> Any:
        from pxr import UsdGeom, UsdPhysics, Vt

        mesh = UsdGeom.Mesh.Define(self.stage, at)
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDoubleSidedAttr(True)
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(vertices, np.float32)))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(triangles), 3, np.int32)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(triangles.reshape(-1), np.int32)))
        mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.array([vertices.min(axis=0), vertices.max(axis=0)], np.float32)))
        UsdPhysics.CollisionAPI.Apply(mesh.GetPrim())
        return mesh


def keep(prim: Any, name: str, kind: Any, value: Any) -> None:
    """An attribute of ours."""
    from pxr import Sdf

    prim.CreateAttribute(f"vistel:{name}", kind, True, Sdf.VariabilityUniform).Set(value)


def _prim_name(thing_id: str, taken: set[str]) -> str:
    base = re.sub(r"[^A-Za-z0-9_]", "_", thing_id)
    base = base if base[:1].isalpha() or base[:1] == "_" else f"_{base}"
    out, n = base, 2
    while out in taken:
        out, n = f"{base}_{n}", n + 1
    taken.add(out)
    return out


def _digest(picture: NDArray[np.uint8] | None) -> str:
    if picture is None:
        return ""
    return hashlib.sha256(f"{picture.shape}".encode() + picture.tobytes()).hexdigest()[:16]


def _vec(v: NDArray[np.float64]) -> Any:
    from pxr import Gf

    return Gf.Vec3d(*v.tolist())


def _linear(colour: int) -> Any:
    """USD's colours are linear light."""
    from pxr import Gf

    from vistel.colour import linear

    return Gf.Vec3f(*linear(np.array([colour >> s & 0xFF for s in (24, 16, 8)]) / 255.0).tolist())
