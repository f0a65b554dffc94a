"""A person's mesh from whatever file it is in, with what was given beside it."""

# pyright: basic

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from vistel.figure.making.makehuman import apply_target, cubes_rig, read_clothes, read_rig
from vistel.figure.making.parts import WORN, is_eye
from vistel.figure.making.pictures import decode, read_picture
from vistel.figure.making.read_gltf import read_gltf
from vistel.figure.making.read_obj import read_obj
from vistel.figure.making.read_usd import USD_ENDINGS, read_usd
from vistel.figure.making.source import MakingError, Material, Source

GLTF_ENDINGS = (".glb", ".gltf", ".vrm")
ENDINGS = (".obj", *GLTF_ENDINGS, *USD_ENDINGS)
EYES = "eyeballs"


@dataclass(frozen=True)
class Extras:
    """Files beside the mesh: a picture of the skin, meshes worn, MakeHuman's rig, weights and targets (FILE or
    FILE=SHARE)."""

    texture: Path | None = None
    clothes: Sequence[Path] = ()
    rig: Path | None = None
    weights: Path | None = None
    targets: Sequence[str] = ()


def read_source(path: Path, extras: Extras | None = None) -> Source:
    """The mesh of `path`. Raises MakingError, OSError."""
    extras = extras or Extras()
    source = read_mesh(path)
    for text in extras.targets:
        file, _, share = text.rpartition("=") if _is_number(text.rpartition("=")[2]) else (text, "", "1")
        source = apply_target(source, Path(file), float(share))
    if extras.rig is not None:
        source = replace(source, rig=read_rig(extras.rig, extras.weights, source))
    elif source.rig is None:
        source = replace(source, rig=cubes_rig(source))
    of_eye = np.array([is_eye(g.lower()) for g in source.groups])[source.group]
    if extras.texture is not None:
        source = _with_material(source, ~of_eye, Material("skin", None, _picture(extras.texture)))
        # Skins show no iris where eyeballs have their texture coordinates: those get painted ones.
        source = _with_material(source, of_eye, Material(EYES))
    body = source
    for cloth in extras.clothes:
        if cloth.suffix.lower() != ".mhclo":
            source = _joined(source, read_mesh(cloth))
            continue
        mesh, places, hidden, picture = read_clothes(cloth, body)
        worn = read_mesh(mesh)
        if len(worn.points) != len(places):
            raise MakingError(f"{cloth}: binds {len(places)} vertices, {mesh.name} has {len(worn.points)}; fetch both again")
        if picture is not None:
            notes: list[str] = []
            cloth_material = Material(cloth.stem, None, read_picture(picture, notes))
            worn = _with_material(replace(worn, notes=(*worn.notes, *notes)), worn.group >= 0, cloth_material)
        source = _joined(_without(source, hidden), replace(worn, points=places), "fitted: ")
    return source


def read_mesh(path: Path) -> Source:
    """The mesh of one file alone. Raises MakingError, OSError."""
    ending = path.suffix.lower()
    if ending == ".obj":
        return read_obj(path)
    if ending in GLTF_ENDINGS:
        return read_gltf(path)
    if ending in USD_ENDINGS:
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


def _with_material(source: Source, faces: NDArray[np.bool_], material: Material) -> Source:
    """These faces in another material; those that have a picture of their own keep it."""
    bare = np.array([m.picture is None for m in source.materials])[source.material]
    which = source.material.copy()
    which[faces & bare] = len(source.materials)
    return replace(source, material=which, materials=(*source.materials, material))


def _without(source: Source, vertices: NDArray[np.int64]) -> Source:
    """The mesh without the faces whose corners are all among these vertices."""
    gone = np.zeros(len(source.points), np.bool_)
    gone[vertices] = True
    return source.of_faces(~np.asarray(gone[source.triangles].all(axis=1), np.bool_))


def _joined(source: Source, worn: Source, called: str = WORN) -> Source:
    """Both meshes as one; what is worn takes no part in finding unit and joints."""
    points, uvs = len(source.points), len(source.uv)
    rig = source.rig
    if rig is not None and rig.weight is not None:
        # What is worn follows the skin under it.
        _, nearest = KDTree(source.points).query(worn.points)
        rig = replace(rig, weight=np.vstack([rig.weight, rig.weight[nearest]]))
    uv = np.where(worn.uv_triangles >= 0, worn.uv_triangles + uvs, -1).astype(np.int32)
    return replace(
        source, points=np.vstack([source.points, worn.points]), uv=np.vstack([source.uv, worn.uv]), rig=rig,
        triangles=np.vstack([source.triangles, worn.triangles + points]).astype(np.int32),
        uv_triangles=np.vstack([source.uv_triangles, uv]), group=np.append(source.group, worn.group + len(source.groups)),
        groups=(*source.groups, *(f"{called}{g or worn.name}" for g in worn.groups)),
        material=np.append(source.material, worn.material + len(source.materials)),
        materials=(*source.materials, *worn.materials), notes=(*source.notes, *worn.notes),
    )  # fmt: skip
