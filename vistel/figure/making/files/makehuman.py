"""MakeHuman's own files: joint cubes in the mesh, rigs and weights as JSON (MPFB), morph targets."""

import gzip
import json
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.making.source import MakingError, Rig, SourceMesh

CUBES = {
    "pelvis": "hips", "neck": "neck", "head": "head", "jaw": "jaw",
    "clavicle": "shoulder", "shoulder": "upper_arm", "elbow": "lower_arm", "hand": "hand", "upper-leg": "upper_leg",
    "knee": "lower_leg", "ankle": "foot", "foot-1": "toes", "eye": "eye",
} | {
    f"finger-{f}-{k + 1}": f"{finger}_{phalanx}"
    for f, (finger, names) in enumerate(
        (("thumb", ("metacarpal", "proximal", "distal")), *((n, ("proximal", "intermediate", "distal")) for n in
         ("index", "middle", "ring", "little"))), 1)
    for k, phalanx in enumerate(names)
}  # fmt: skip


def cubes_rig(source: SourceMesh) -> Rig | None:
    """The joints that MakeHuman's base mesh marks by small cubes (groups joint-...), without weights."""
    centre = _cube_centres(source)
    names: list[str] = []
    at: list[F64] = []
    for cube, joint in CUBES.items():
        paired = joint not in ("hips", "neck", "head", "jaw")
        for side in ("left", "right") if paired else ("",):
            key = f"joint-{side[0]}-{cube}" if side else f"joint-{cube}"
            if key in centre:
                names.append(f"{side}_{joint}" if side else joint)
                at.append(centre[key])
    if len(names) < 12:
        return None
    return Rig(tuple(names), np.full(len(names), -1, np.int32), np.array(at))


def read_rig(path: Path, weights: Path | None, source: SourceMesh) -> Rig:
    """A rig of MPFB (rig.*.json) and its weights (weights.*.json, .gz), over the vertices of the mesh it was made for.
    Raises MakingError."""
    data = _json(path)
    centre = _cube_centres(source)
    try:
        names = tuple(data)
        at = np.array([_place(data[n]["head"], centre, source.points, path, n) for n in names])
        index = {n: i for i, n in enumerate(names)}
        parents = np.array([index.get(data[n].get("parent", ""), -1) for n in names], np.int32)
    except (KeyError, TypeError, AttributeError) as fault:
        raise MakingError(f"{path}: not a rig as MPFB writes them ({fault!r}); expected rig.*.json") from fault
    return Rig(names, parents, at, None if weights is None else _weights(weights, names, len(source.points)))


def _place(head: Any, centre: dict[str, F64], points: F64, path: Path, joint: str) -> F64:
    if head["strategy"] == "CUBE" and head["cube_name"] in centre:
        return centre[head["cube_name"]]
    rows = head.get("vertex_indices") or [v for v in (head.get("vertex_index"),) if v is not None]
    if rows and max(rows) < len(points):
        return points[rows].mean(axis=0)
    lacking = head.get("cube_name", "vertices")
    raise MakingError(f"{path}: joint {joint} lies at {lacking}, which the mesh lacks; use the base mesh with its helpers")


def _weights(path: Path, names: tuple[str, ...], count: int) -> NDArray[np.float32]:
    out = np.zeros((count, len(names)), np.float32)
    try:
        table = _json(path)["weights"]
        for j, name in enumerate(names):
            pairs = np.array(table.get(name, []), np.float64).reshape(-1, 2)
            rows = pairs[:, 0].astype(np.int64)
            if len(rows) and (rows.min() < 0 or rows.max() >= count):
                raise MakingError(f"{path}: weights of vertex {rows.max()} of {count}; use the mesh they were made for")
            out[rows, j] = pairs[:, 1]
    except (KeyError, TypeError, AttributeError, ValueError) as fault:
        if isinstance(fault, MakingError):
            raise
        raise MakingError(f"{path}: not weights as MPFB writes them ({fault!r}); expected weights.*.json") from fault
    return out


def apply_target(source: SourceMesh, path: Path, share: float) -> SourceMesh:
    """The mesh with a morph target (lines "vertex dx dy dz") added. Raises MakingError."""
    vertex, offset = read_target(path, len(source.points))
    points = source.points.copy()
    np.add.at(points, vertex, share * offset)
    return replace(source, points=points)


def read_target(path: Path, count: int) -> tuple[NDArray[np.int32], F64]:
    """Vertices (N,) of a mesh of `count` and how far a morph target moves them (N, 3). Raises MakingError."""
    vertex: list[int] = []
    offset: list[list[float]] = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            v = int(words[0])
            delta = [float(w) for w in words[1:4]]
            if not 0 <= v < count or len(delta) != 3:
                raise ValueError(f"vertex {v} of {count}")
        except ValueError as fault:
            raise MakingError(f"{path}:{number}: not a line of a morph target ({fault}); expected vertex dx dy dz") from fault
        vertex.append(v)
        offset.append(delta)
    return np.array(vertex, np.int32), np.array(offset, np.float64).reshape(-1, 3)


def _cube_centres(source: SourceMesh) -> dict[str, F64]:
    out: dict[str, F64] = {}
    for g, name in enumerate(source.groups):
        if name.startswith("joint-"):
            rows = np.unique(source.triangles[source.group == g])
            if len(rows):
                out[name] = source.points[rows].mean(axis=0)
    return out


def _json(path: Path) -> Any:
    try:
        return json.loads(_text(path))
    except json.JSONDecodeError as fault:
        raise MakingError(f"{path}: not JSON ({fault}); fetch the file again") from fault


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
        return (gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data).decode()
    except OSError as fault:
        raise MakingError(f"{path}: cannot be read: {fault.strerror or fault}") from fault
    except (zlib.error, EOFError, UnicodeDecodeError) as fault:
        raise MakingError(f"{path}: damaged ({fault}); fetch the file again") from fault


@dataclass(frozen=True)
class Clothes:
    """MakeHuman's clothes on a body. mesh: the OBJ; places: (N, 3) of its vertices; hidden: the body's vertices that it
    hides; picture: the file its material names; corner, share: (N, 3) the body's vertices that each of the clothes is bound
    to, and how much."""

    mesh: Path
    places: F64
    hidden: NDArray[np.int64]
    picture: Path | None
    corner: NDArray[np.int64]
    share: F64


def read_clothes(path: Path, body: SourceMesh) -> Clothes:
    """MakeHuman's clothes (.mhclo) on the body of its base mesh. Raises MakingError."""
    mesh: Path | None = None
    picture: Path | None = None
    scale = np.ones(3)
    rows: list[list[float]] = []
    hidden: list[int] = []
    part = ""
    number = 0
    try:
        for number, line in enumerate(_text(path).splitlines(), 1):  # noqa: B007 - told where it failed
            words = line.split()
            if not words or words[0] == "#":
                continue
            if words[0] in ("verts", "delete_verts"):
                part = words[0]
            elif words[0] == "obj_file":
                mesh = path.parent / words[1]
            elif words[0] == "material":
                picture = _diffuse(path.parent / words[1])
            elif words[0] in ("x_scale", "y_scale", "z_scale"):
                axis = "xyz".index(words[0][0])
                low, high = int(words[1]), int(words[2])
                scale[axis] = abs(body.points[low, axis] - body.points[high, axis]) / float(words[3])
            elif part == "verts" and words[0].isdigit():
                rows.append([float(w) for w in words[:9]] if len(words) >= 9 else [float(words[0]), 0, 0, 1, 0, 0, 0, 0, 0])
            elif part == "delete_verts" and words[0].isdigit():
                text = line.replace("-", " - ").split()
                while text:
                    first = int(text.pop(0))
                    last = first
                    if text[:1] == ["-"]:
                        last = int(text[1])
                        text = text[2:]
                    hidden += range(first, min(last, len(body.points) - 1) + 1)
        table = np.array(rows, np.float64).reshape(-1, 9)
        bound = table[:, :3].astype(np.int64)
        corner = body.points[bound]
    except (ValueError, IndexError) as fault:
        raise MakingError(f"{path}:{number}: not clothes for this mesh ({fault}); use MakeHuman's base mesh") from fault
    if mesh is None or not rows:
        raise MakingError(f"{path}: names no mesh (obj_file) or binds no vertices (verts); expected MakeHuman clothes")
    places = np.einsum("nk,nkj->nj", table[:, 3:6], corner) + table[:, 6:9] * scale
    return Clothes(mesh, places, np.array(hidden, np.int64), picture, bound, table[:, 3:6])


def _diffuse(material: Path) -> Path | None:
    """The picture that a material of MakeHuman (.mhmat) names, None without one."""
    if not material.is_file():
        return None
    for line in _text(material).splitlines():
        words = line.split()
        if len(words) > 1 and words[0] == "diffuseTexture":
            return material.parent / words[1]
    return None
