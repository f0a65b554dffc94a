"""Avatars in USD: a skinned character (UsdSkel) that usdview and Blender open, with all that VISTEL needs as attributes.

    /Avatar            SkelRoot; custom attributes vistel:... hold the primitives
    /Avatar/Skeleton   joints under the house's names (VRM's bones in snake case, spine_1 ... spine_8)
    /Avatar/Skin       Mesh with joint weights, texture coordinates (st) and vistel:limb for every vertex
    /Avatar/LeftEye    Mesh bound to its joint, RightEye the same
    /Avatar/Materials/Skin   UsdPreviewSurface with the texture; others for its patches (`vistel.figure.formats.usd_materials`)

Levels of detail are variants of /Avatar ("detail": full, level_1, ...). Skinning weights in `primvars:skel:...` are of
joints only, as UsdSkel has it; those with twist bones are kept in vistel:bone and vistel:weight. Numbers are kept exactly.
"""

# pyright: reportAttributeAccessIssue=false

import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSkel, UsdUtils, Vt

from vistel.figure.avatar.avatar import Avatar, Mesh, Registration
from vistel.figure.avatar.check import AvatarFileError, check_body, check_indices, check_targets
from vistel.figure.avatar.patch import fault_of
from vistel.figure.body import Body
from vistel.figure.formats.usd_materials import bind, pictures_of, read_patches, write_materials
from vistel.figure.formats.usd_targets import read_targets, write_targets
from vistel.figure.making.files.usd_inside import asset_bytes, opened
from vistel.figure.making.pictures import decode
from vistel.figure.making.source import USD_ENDINGS, MakingError
from vistel.figure.rigid.weights import influences, joints_only
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, Skeleton
from vistel.figure.usd_fault import reason

FORMAT = 1
_EYES = ("LeftEye", "RightEye")
_FULL = "full"


def save_usd(avatar: Avatar, path: Path) -> None:
    """Writes .usda, .usdc or .usd with the texture as NAME_texture.png beside it and the pictures of its patches, or .usdz with all
    in one file; whole or not at all. Raises OSError, and ValueError for another ending."""
    if path.suffix.lower() not in USD_ENDINGS:
        raise ValueError(f"{path}: expected a name that ends in {', '.join(USD_ENDINGS)}")
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.stem}") as folder:
        packed = path.suffix.lower() == ".usdz"
        stage = Path(folder) / (f"{path.stem}.usdc" if packed else path.name)
        texture = Path(folder) / f"{path.stem}_texture.png"
        Image.fromarray(avatar.albedo).save(texture)
        more = pictures_of(avatar.patches, path.stem)
        for name, picture in more.items():
            picture.save(Path(folder) / name)
        _write(avatar, stage, texture.name, path.stem)
        if packed:
            package = Path(folder) / path.name
            if not UsdUtils.CreateNewUsdzPackage(str(stage), str(package)):
                raise OSError(f"{path}: could not be packed")
            os.replace(package, path)
        else:
            for name in (texture.name, *more):
                os.replace(Path(folder) / name, path.with_name(name))
            os.replace(stage, path)


def load_usd(path: Path) -> Avatar:
    """Reads what `save_usd` wrote. Raises AvatarFileError for any other or damaged file, OSError."""
    if not path.is_file():
        raise FileNotFoundError(2, "No such file", str(path))
    try:
        stage = opened(path)
        root = stage.GetDefaultPrim()
        if not root or not root.HasAttribute("vistel:format"):
            raise AvatarFileError(f"{path}: no avatar of VISTEL; make one of it with: vistel avatar import {path.name} -o me.usda")
        if root.GetAttribute("vistel:format").Get() != FORMAT:
            raise AvatarFileError(f"{path}: avatar format {root.GetAttribute('vistel:format').Get()}, expected {FORMAT}")
        return _read(stage, root, path)
    except Tf.ErrorException as fault:
        raise AvatarFileError(f"{path}: not a whole USD file ({reason(fault)})") from fault
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, RuntimeError) as fault:
        if isinstance(fault, AvatarFileError):
            raise
        if isinstance(fault, MakingError):
            raise AvatarFileError(str(fault)) from fault
        raise AvatarFileError(f"{path}: not a whole avatar file ({fault})") from fault


def _write(avatar: Avatar, path: Path, texture: str, stem: str) -> None:
    stage: Any = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    root = UsdSkel.Root.Define(stage, "/Avatar")
    prim = root.GetPrim()
    stage.SetDefaultPrim(prim)
    Usd.ModelAPI(prim).SetKind("component")

    def keep(of: Any, name: str, kind: Any, value: Any) -> None:
        of.CreateAttribute(f"vistel:{name}", kind, True, Sdf.VariabilityUniform).Set(value)

    keep(prim, "format", Sdf.ValueTypeNames.Int, FORMAT)
    keep(prim, "name", Sdf.ValueTypeNames.String, avatar.name)
    body, types = avatar.body, Sdf.ValueTypeNames
    keep(prim, "primitive:names", types.StringArray, list(body.names))
    keep(prim, "primitive:joint", types.IntArray, Vt.IntArray.FromNumpy(np.ascontiguousarray(body.joint, np.int32)))
    for name, points in (("a", body.a), ("b", body.b)):
        keep(prim, f"primitive:{name}", types.Double3Array, Vt.Vec3dArray.FromNumpy(np.ascontiguousarray(points, np.float64)))
    for name, radii in (("radiusA", body.radius_a), ("radiusB", body.radius_b)):
        keep(prim, f"primitive:{name}", types.DoubleArray, Vt.DoubleArray.FromNumpy(np.ascontiguousarray(radii, np.float64)))
    if avatar.wrinkles:
        keep(prim, "wrinkles", types.String, avatar.wrinkles)
    if avatar.registration:
        kept = avatar.registration
        keep(prim, "registration:island", types.IntArray, [r.island for r in kept])
        for name, numbers in (("turn", [r.turn for r in kept]), ("scale", [r.scale for r in kept])):
            keep(prim, f"registration:{name}", types.DoubleArray, numbers)
        for name, pairs in (("move", [r.move for r in kept]), ("middle", [r.middle for r in kept])):
            keep(prim, f"registration:{name}", types.Double2Array, [Gf.Vec2d(*pair) for pair in pairs])

    names = [joint_path(j) for j in range(len(JOINTS))]
    skeleton = UsdSkel.Skeleton.Define(stage, "/Avatar/Skeleton")
    skeleton.CreateJointsAttr(names)
    skeleton.CreateJointNamesAttr(list(JOINTS))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([_moved(p) for p in avatar.skeleton.rest]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([_moved(p) for p in avatar.skeleton.offsets]))
    tips = Vt.Vec3dArray.FromNumpy(np.ascontiguousarray(avatar.skeleton.tip, np.float64))
    keep(skeleton.GetPrim(), "rest", types.Point3dArray, Vt.Vec3dArray.FromNumpy(np.ascontiguousarray(avatar.skeleton.rest)))
    keep(skeleton.GetPrim(), "tip", types.Double3Array, tips)

    plain, patched = write_materials(stage, texture, stem, avatar.patches)
    levels = [avatar, *avatar.coarser]
    variants = prim.GetVariantSets().AddVariantSet("detail")
    for k, level in enumerate(levels):
        variant = _FULL if k == 0 else f"level_{k}"
        variants.AddVariant(variant)
        variants.SetVariantSelection(variant)
        with variants.GetVariantEditContext():
            for name, mesh, joint in _meshes(level):
                geometry = _write_mesh(stage, f"/Avatar/{name}", mesh, avatar, joint, keep)
                bind(geometry, mesh, plain, avatar.patches, patched)
    variants.SetVariantSelection(_FULL)
    bound = UsdSkel.BindingAPI.Apply(prim)
    bound.CreateSkeletonRel().SetTargets(["/Avatar/Skeleton"])
    extent = np.array([avatar.mesh.vertices.min(axis=0), avatar.mesh.vertices.max(axis=0)])
    skeleton.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(extent))
    root.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(extent))
    try:
        stage.GetRootLayer().Save()
    except Tf.ErrorException as fault:
        raise OSError(f"{path}: cannot be written ({fault})") from fault


def _meshes(level: Avatar) -> list[tuple[str, Mesh, int | None]]:
    eyes = zip(_EYES, level.eyeballs, (JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]), strict=False)
    return [("Skin", level.mesh, None), *eyes]


def _write_mesh(stage: Any, at: str, mesh: Mesh, avatar: Avatar, joint: int | None, keep: Any) -> Any:
    types = Sdf.ValueTypeNames
    geometry = UsdGeom.Mesh.Define(stage, at)
    geometry.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    geometry.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.vertices, np.float32)))
    geometry.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(mesh.triangles), 3, np.int32)))
    geometry.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.triangles.reshape(-1), np.int32)))
    extent = np.array([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)], np.float32)
    geometry.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(extent))
    st = UsdGeom.PrimvarsAPI(geometry).CreatePrimvar("st", types.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
    st.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(mesh.uv, np.float32)))
    st.SetIndices(Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.corner_triangles.reshape(-1), np.int32)))
    prim = geometry.GetPrim()
    keep(prim, "limb", types.IntArray, Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.limb, np.int32)))
    binding = UsdSkel.BindingAPI.Apply(prim)
    binding.CreateSkeletonRel().SetTargets(["/Avatar/Skeleton"])
    if joint is not None:
        binding.CreateJointIndicesPrimvar(True, 1).Set(Vt.IntArray([joint]))
        binding.CreateJointWeightsPrimvar(True, 1).Set(Vt.FloatArray([1.0]))
    else:
        bone, weight = mesh.bone, mesh.weight
        if bone is None or weight is None:
            bone, weight = influences(avatar.skeleton, mesh.vertices, mesh.triangles, avatar.body.joint[mesh.limb])
        else:
            keep(prim, "bone", types.IntArray, Vt.IntArray.FromNumpy(np.ascontiguousarray(bone.reshape(-1), np.int32)))
            keep(prim, "weight", types.FloatArray, Vt.FloatArray.FromNumpy(np.ascontiguousarray(weight.reshape(-1))))
        if mesh.hangs is not None:
            keep(prim, "hangs", types.FloatArray, Vt.FloatArray.FromNumpy(np.ascontiguousarray(mesh.hangs, np.float32)))
        indices, shares = joints_only(bone, weight)
        binding.CreateJointIndicesPrimvar(False, 4).Set(Vt.IntArray.FromNumpy(np.ascontiguousarray(indices.reshape(-1))))
        binding.CreateJointWeightsPrimvar(False, 4).Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(shares.reshape(-1))))
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    write_targets(stage, at, binding, mesh)
    return geometry


def _moved(p: NDArray[np.float64]) -> Any:
    return Gf.Matrix4d(1.0).SetTranslate(Gf.Vec3d(*p.tolist()))


def joint_path(joint: int) -> str:
    """A joint as UsdSkel names it: with all above it."""
    names: list[str] = []
    while joint >= 0:
        names.append(JOINTS[joint])
        joint = int(PARENTS[joint])
    return "/".join(reversed(names))


def _read(stage: Any, root: Any, path: Path) -> Avatar:
    def get(prim: Any, name: str) -> Any:
        value = prim.GetAttribute(name).Get() if prim.HasAttribute(name) else None
        if value is None:
            raise AvatarFileError(f"{path}: {prim.GetPath()} lacks {name}")
        return value

    def array(prim: Any, name: str, kind: type[Any], columns: int = 0) -> Any:
        out = np.array(get(prim, name), kind)
        return out.reshape(-1, columns) if columns else out

    body = Body(
        tuple(str(n) for n in get(root, "vistel:primitive:names")),
        array(root, "vistel:primitive:joint", np.int32),
        array(root, "vistel:primitive:a", np.float64, 3),
        array(root, "vistel:primitive:b", np.float64, 3),
        array(root, "vistel:primitive:radiusA", np.float64),
        array(root, "vistel:primitive:radiusB", np.float64),
    )
    chain = stage.GetPrimAtPath(f"{root.GetPath()}/Skeleton")
    skeleton = Skeleton(array(chain, "vistel:rest", np.float64, 3), array(chain, "vistel:tip", np.float64, 3))
    check_body(body, skeleton, path)
    shown = stage.GetPrimAtPath(f"{root.GetPath()}/Materials/Skin/Texture").GetAttribute("inputs:file").Get()
    albedo = _picture(shown, path)
    patches = read_patches(stage, root, lambda asset: _picture(asset, path))
    if fault := fault_of(patches, 16384):
        raise AvatarFileError(f"{path}: {fault}")
    variants = root.GetVariantSets().GetVariantSet("detail")
    stage.SetEditTarget(stage.GetSessionLayer())
    levels: list[Avatar] = []
    for variant in sorted(variants.GetVariantNames()):
        variants.SetVariantSelection(variant)
        meshes: list[Mesh] = []
        for name in ("Skin", *_EYES):
            prim = stage.GetPrimAtPath(f"{root.GetPath()}/{name}")
            if not prim:
                continue
            st = UsdGeom.PrimvarsAPI(prim).GetPrimvar("st")
            tri = array(prim, "faceVertexIndices", np.int32, 3)
            corner, uv = np.array(st.GetIndices(), np.int32).reshape(-1, 3), np.array(st.Get(), np.float32).reshape(-1, 2)
            vertex = np.zeros(len(uv), np.int32)
            vertex[corner] = tri
            mesh = Mesh(array(prim, "points", np.float32, 3), tri, vertex, uv, corner, array(prim, "vistel:limb", np.int32))
            if prim.HasAttribute("vistel:bone"):
                mesh = replace(
                    mesh, bone=array(prim, "vistel:bone", np.int32, 4), weight=array(prim, "vistel:weight", np.float32, 4)
                )
            if prim.HasAttribute("vistel:hangs"):
                mesh = replace(mesh, hangs=array(prim, "vistel:hangs", np.float32))
            mesh = replace(mesh, targets=read_targets(stage, prim))
            check_indices(mesh, body, path)
            check_targets(mesh, str(path))
            meshes.append(mesh)
        levels.append(Avatar(str(get(root, "vistel:name")), skeleton, body, meshes[0], tuple(meshes[1:]), albedo, patches=patches))
    kept: tuple[Registration, ...] = ()
    if root.HasAttribute("vistel:registration:island"):
        rows = zip(
            *(np.array(get(root, f"vistel:registration:{n}")).tolist() for n in ("island", "move", "turn", "scale", "middle")),
            strict=True,
        )
        kept = tuple(Registration(i, (m[0], m[1]), turn, scale, (c[0], c[1])) for i, m, turn, scale, c in rows)
    wrinkles = str(get(root, "vistel:wrinkles")) if root.HasAttribute("vistel:wrinkles") else ""
    return replace(levels[0], coarser=tuple(levels[1:]), registration=kept, wrinkles=wrinkles)


def _picture(value: Any, path: Path) -> NDArray[np.uint8]:
    """The picture of an asset that a material names."""
    try:
        found = asset_bytes(value.resolvedPath, path) if value else None
    except MakingError as fault:
        raise AvatarFileError(str(fault)) from fault
    if found is None:
        raise AvatarFileError(f"{path}: its texture {value.path if value else ''} is not there; put it beside the file")
    try:
        return decode(found, 16384)
    except MakingError as fault:
        raise AvatarFileError(f"{path}: its texture is {fault}") from fault
