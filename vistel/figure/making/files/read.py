"""A person's mesh from whatever file it is in, with what was given beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from vistel.figure.making.files.expressions import makehuman_expressions
from vistel.figure.making.files.makehuman import apply_target, cubes_rig, read_clothes, read_rig
from vistel.figure.making.files.read_gltf import read_gltf
from vistel.figure.making.files.read_obj import read_obj
from vistel.figure.making.files.read_ply import read_ply
from vistel.figure.making.parts import WORN, is_eye, parts_of
from vistel.figure.making.pictures import decode, read_picture
from vistel.figure.making.source import USD_ENDINGS, MakingError, SourceMaterial, SourceMesh

GLTF_ENDINGS = (".glb", ".gltf", ".vrm")
ENDINGS = (".obj", ".ply", *GLTF_ENDINGS, *USD_ENDINGS)
EYES = "eyeballs"


@dataclass(frozen=True)
class Extras:
    """Files beside the mesh: a picture of the skin, meshes worn, MakeHuman's rig, weights and targets (FILE or
    FILE=SHARE); expressions: a folder of targets that its face can make, or one."""

    texture: Path | None = None
    clothes: Sequence[Path] = ()
    rig: Path | None = None
    weights: Path | None = None
    targets: Sequence[str] = ()
    expressions: Path | None = None


def read_source(path: Path, extras: Extras | None = None) -> SourceMesh:
    """The mesh of `path`. Raises MakingError, OSError."""
    extras = extras or Extras()
    source = read_mesh(path)
    for text in extras.targets:
        file, _, share = text.rpartition("=") if _is_number(text.rpartition("=")[2]) else (text, "", "1")
        source = apply_target(source, Path(file), float(share))
    if extras.expressions is not None:
        source = makehuman_expressions(source, extras.expressions)
    if extras.rig is not None:
        source = replace(source, rig=read_rig(extras.rig, extras.weights, source))
    elif source.rig is None:
        source = replace(source, rig=cubes_rig(source))
    of_eye = np.array([is_eye(g.lower()) for g in source.groups])[source.group]
    if extras.texture is not None:
        source = _with_material(source, ~of_eye, SourceMaterial("skin", None, _picture(extras.texture)))
        # Skins show no iris where eyeballs have their texture coordinates: those get painted ones.
        source = _with_material(source, of_eye, SourceMaterial(EYES))
    body = source
    for cloth in extras.clothes:
        if cloth.suffix.lower() != ".mhclo":
            source = _joined(source, read_mesh(cloth))
            continue
        clothes = read_clothes(cloth, body)
        worn = read_mesh(clothes.mesh)
        if len(worn.points) != len(clothes.places):
            raise MakingError(
                f"{cloth}: binds {len(clothes.places)} vertices, {clothes.mesh.name} has {len(worn.points)}; fetch both again"
            )
        if clothes.picture is not None:
            notes: list[str] = []
            cloth_material = SourceMaterial(cloth.stem, None, read_picture(clothes.picture, notes))
            worn = _with_material(replace(worn, notes=(*worn.notes, *notes)), worn.group >= 0, cloth_material)
        bound = clothes.corner, clothes.share
        source = _joined(_without(source, clothes.hidden), replace(worn, points=clothes.places), bound)
    return source


def read_mesh(path: Path) -> SourceMesh:
    """The mesh of one file alone. Raises MakingError, OSError."""
    ending = path.suffix.lower()
    if ending == ".obj":
        return read_obj(path)
    if ending == ".ply":
        return read_ply(path)
    if ending in GLTF_ENDINGS:
        return read_gltf(path)
    if ending in USD_ENDINGS:
        from vistel.figure.making.files.read_usd import read_usd  # USD takes long to load

        return read_usd(path)
    raise MakingError(f"{path}: no format for {ending or 'a name without an ending'!r}, expected {', '.join(ENDINGS)}")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _picture(path: Path) -> NDArray[np.uint8]:
    try:
        return decode(path.read_bytes())
    except OSError as fault:
        raise MakingError(f"{path}: cannot be read: {fault.strerror}") from fault
    except MakingError as fault:
        raise MakingError(f"{path}: {fault}") from fault


def _with_material(source: SourceMesh, faces: NDArray[np.bool_], material: SourceMaterial) -> SourceMesh:
    """These faces in another material; those that have a picture of their own keep it."""
    bare = np.array([m.picture is None for m in source.materials])[source.material]
    which = source.material.copy()
    which[faces & bare] = len(source.materials)
    return replace(source, material=which, materials=(*source.materials, material))


def _without(source: SourceMesh, vertices: NDArray[np.int64]) -> SourceMesh:
    """The mesh without the faces whose corners are all among these vertices."""
    gone = np.zeros(len(source.points), np.bool_)
    gone[vertices] = True
    return source.of_faces(~np.asarray(gone[source.triangles].all(axis=1), np.bool_))


def _joined(source: SourceMesh, worn: SourceMesh, bound: tuple[NDArray[np.int64], NDArray[np.float64]] | None = None) -> SourceMesh:
    """Both meshes as one; what is worn takes no part in finding unit and joints. bound: the vertices of `source` that each
    of the worn ones follows, and how much; otherwise the skin next to it."""
    points, uvs = len(source.points), len(source.uv)
    rig = source.rig
    if rig is not None and rig.weight is not None:
        at, share = bound if bound is not None else _nearest_skin(source, worn.points)
        rig = replace(rig, weight=np.vstack([rig.weight, _shared(rig.weight, at, share)]))
    uv = np.where(worn.uv_triangles >= 0, worn.uv_triangles + uvs, -1).astype(np.int32)
    return replace(
        source,
        points=np.vstack([source.points, worn.points]),
        uv=np.vstack([source.uv, worn.uv]),
        rig=rig,
        triangles=np.vstack([source.triangles, worn.triangles + points]).astype(np.int32),
        uv_triangles=np.vstack([source.uv_triangles, uv]),
        group=np.append(source.group, worn.group + len(source.groups)),
        groups=(*source.groups, *(f"{WORN}{g or worn.name}" for g in worn.groups)),
        material=np.append(source.material, worn.material + len(source.materials)),
        materials=(*source.materials, *worn.materials),
        notes=(*source.notes, *worn.notes),
    )


def _nearest_skin(source: SourceMesh, points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(N, 4) vertices of the skin next to each point, and shares by nearness."""
    skin = np.unique(source.triangles[parts_of(source).skin])
    distance, nearest = KDTree(source.points[skin]).query(points, k=4)
    near = 1.0 / (distance + 1e-3 * float(np.ptp(source.points[skin])))
    return skin[nearest].astype(np.int64), near / near.sum(axis=1, keepdims=True)


def _shared(weight: NDArray[np.float32], at: NDArray[np.int64], share: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, J) weights of what follows these vertices; bindings may lie outside their triangle."""
    share = np.maximum(share, 0.0)
    share /= np.maximum(share.sum(axis=1, keepdims=True), 1e-9)
    return np.einsum("nk,nkj->nj", share, weight[at]).astype(np.float32)
