"""Avatars of VISTEL read back from glTF and VRM: what `vistel.figure.formats.gltf` wrote, its shape to the last bit."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vistel.figure.avatar.avatar import Avatar, Mesh, Registration, Target
from vistel.figure.avatar.check import AvatarFileError, check_body, check_indices, check_targets
from vistel.figure.body import Body
from vistel.figure.formats.gltf import EXTENSION, FORMAT
from vistel.figure.formats.gltf_materials import read_patches
from vistel.figure.formats.vrm import EYES
from vistel.figure.making.files.gltf import Document, read_document
from vistel.figure.making.levels import with_coarser
from vistel.figure.making.parts import soundness
from vistel.figure.making.pictures import decode
from vistel.figure.making.source import MakingError
from vistel.figure.skeleton import JOINTS, Skeleton


def load_gltf(path: Path) -> Avatar | None:
    """The avatar in a .glb, .vrm or .gltf that `save_gltf` wrote; None for those of others, or that others have changed.
    Raises AvatarFileError where it is damaged, MakingError where it is no glTF, OSError."""
    document = read_document(path)
    kept = document.extension(EXTENSION)
    if kept is None or kept.get("format") != FORMAT:
        return None
    try:
        return _restored(document, kept, path)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as fault:
        if isinstance(fault, AvatarFileError):
            raise
        raise AvatarFileError(f"{path}: not a whole avatar file ({fault})") from fault


def _restored(document: Document, kept: dict[str, Any], path: Path) -> Avatar | None:
    p = kept["primitives"]
    joint = np.array(p["joint"], np.int32)
    a, b, radius_a, radius_b = (np.array(p[key], np.float64) for key in ("a", "b", "radiusA", "radiusB"))
    body = Body(tuple(str(n) for n in p["names"]), joint, a, b, radius_a, radius_b)
    skeleton = Skeleton(np.array(kept["rest"], np.float64), np.array(kept["tip"], np.float64))
    check_body(body, skeleton, path)
    rows = document.rows("meshes")
    if [row.get("name") for row in rows] != ["skin", *EYES][: len(rows)] or len(rows) != len(kept["meshes"]):
        return None
    meshes: list[Mesh] = []
    for row, exact in zip(rows, kept["meshes"], strict=True):
        mesh = _mesh(document, row["primitives"], exact)
        if mesh is None:
            return None
        mesh = replace(mesh, targets=_targets(document, row, mesh))
        check_indices(mesh, body, path)
        check_targets(mesh, str(path))
        meshes.append(mesh)
    if len(document.rows("nodes")) != len(JOINTS) + len(meshes):
        return None
    try:
        albedo, patches = decode(document.picture(0), 16384), read_patches(document, kept)
    except MakingError as fault:
        raise AvatarFileError(f"{path}: its texture: {fault}") from fault
    name, wears = str(kept["name"]), str(kept.get("wrinkles", ""))
    avatar = Avatar(name, skeleton, body, meshes[0], tuple(meshes[1:]), albedo, (), _registration(kept), wears, patches)
    return with_coarser(avatar, manifold=soundness(avatar.mesh.triangles, len(avatar.mesh.vertices)).manifold)


def _registration(kept: dict[str, Any]) -> tuple[Registration, ...]:
    rows = kept.get("registration", [])
    return tuple(
        Registration(int(r["island"]), _pair(r["move"]), float(r["turn"]), float(r["scale"]), _pair(r["middle"])) for r in rows
    )


def _pair(numbers: Any) -> tuple[float, float]:
    u, v = numbers
    return float(u), float(v)


def _targets(document: Document, row: dict[str, Any], mesh: Mesh) -> tuple[Target, ...]:
    """Shapes of expressions, of the vertices that they move."""
    out: list[Target] = []
    names = row.get("extras", {}).get("targetNames", [])
    for name, target in zip(names, row["primitives"][0].get("targets", []), strict=True):
        whole = np.zeros_like(mesh.vertices)
        whole[mesh.corner_vertex] = document.array(target["POSITION"])
        vertex = np.flatnonzero(whole.any(axis=1)).astype(np.int32)
        out.append(Target(str(name), vertex, whole[vertex]))
    return tuple(out)


def _mesh(document: Document, primitives: list[dict[str, Any]], exact: dict[str, int]) -> Mesh | None:
    """A mesh with its drawn vertices joined again; None where others have changed how many there are."""
    kept = {name: document.array(index) for name, index in exact.items()}
    primitive = primitives[0]
    vertex, limb = kept["vertex"][:, 0].astype(np.int32), kept["limb"][:, 0].astype(np.int32)
    drawn = document.array(primitive["attributes"]["POSITION"])
    corner = np.vstack([document.array(p["indices"]).reshape(-1, 3) for p in primitives]).astype(np.int32)
    if "order" in kept:
        order = kept["order"][:, 0].astype(np.int64)
        if not np.array_equal(np.sort(order), np.arange(len(corner))):
            return None
        corner[order] = corner.copy()
    if len(drawn) != len(vertex) or len(kept["uv"]) != len(vertex) or len(np.unique(vertex)) != len(limb):
        return None
    if not len(limb) or vertex.min() < 0 or vertex.max() >= len(limb) or corner.max() >= len(vertex):
        return None
    points = np.zeros((len(limb), 3), np.float32)
    points[vertex] = drawn
    mesh = Mesh(points, vertex[corner], vertex, kept["uv"].astype(np.float32), corner, limb)
    if "hangs" in kept:
        mesh = replace(mesh, hangs=kept["hangs"][:, 0].astype(np.float32))
    if "bone" not in kept or "weight" not in kept:
        return mesh
    return replace(mesh, bone=kept["bone"].astype(np.int32), weight=kept["weight"].astype(np.float32))
