"""Wavefront OBJ with its materials (MTL) and pictures.

trimesh (5.2) cannot stand in for this reader. It drops vertices that no face uses and gives every group vertices of its own,
whereas MakeHuman's clothes, rigs and targets name vertices by their number in the file. Where some faces have texture coordinates
and others none, it drops all of them. A face of a vertex that is not there ends in an IndexError instead of the line at fault.
"""

from pathlib import Path

import numpy as np

from vistel.figure.making.pictures import read_picture
from vistel.figure.making.source import MakingError, SourceMaterial, SourceMesh, beside

_LARGEST = 512 * 1024 * 1024


def read_obj(path: Path) -> SourceMesh:
    """The mesh of an OBJ file; polygons become fans of triangles. Raises MakingError, OSError."""
    if path.stat().st_size > _LARGEST:
        raise MakingError(f"{path}: larger than 512 MB; reduce the mesh to at most some 100,000 vertices first")
    points: list[list[float]] = []
    uv: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    uv_faces: list[tuple[int, int, int]] = []
    group: list[int] = []
    material: list[int] = []
    groups: dict[str, int] = {}
    materials: dict[str, SourceMaterial] = {}
    order: dict[str, int] = {}
    notes: list[str] = []
    g = groups.setdefault("", 0)
    m = order.setdefault("", 0)
    object_name = ""
    at = 0
    try:
        with path.open(encoding="utf-8", errors="replace") as stream:
            for at, line in enumerate(stream, 1):  # noqa: B007 - told where it failed
                words = line.split()
                if not words or words[0][0] == "#":
                    continue
                key = words[0]
                if key == "v":
                    points.append([float(w) for w in words[1:4]])
                elif key == "vt":
                    uv.append([float(w) for w in words[1:3]])
                elif key == "f":
                    corners = [_corner(w, len(points), len(uv)) for w in words[1:]]
                    for k in range(1, len(corners) - 1):
                        a, b, c = corners[0], corners[k], corners[k + 1]
                        faces.append((a[0], b[0], c[0]))
                        uv_faces.append((a[1], b[1], c[1]))
                        group.append(g)
                        material.append(m)
                elif key == "g":
                    name = " ".join(words[1:]) or object_name
                    g = groups.setdefault(name, len(groups))
                elif key == "o":
                    object_name = " ".join(words[1:])
                    g = groups.setdefault(object_name, len(groups))
                elif key == "usemtl":
                    m = order.setdefault(" ".join(words[1:]), len(order))
                elif key == "mtllib":
                    materials |= _read_mtl(line.split(None, 1)[1].strip(), path, notes)
    except (ValueError, IndexError) as fault:
        raise MakingError(f"{path}:{at}: not a line of an OBJ file ({fault}); export the mesh again") from fault
    if not faces:
        raise MakingError(f"{path}: no faces; expected an OBJ file with the surface of a person")
    if any(len(p) != 3 for p in points) or any(len(t) != 2 for t in uv):
        raise MakingError(f"{path}: a vertex with fewer numbers than it needs; the file seems cut short, export it again")
    return SourceMesh(
        path.stem,
        np.array(points, np.float64),
        np.array(faces, np.int32),
        np.array(uv, np.float64).reshape(-1, 2),
        np.array(uv_faces, np.int32),
        np.array(group, np.int32),
        tuple(groups),
        np.array(material, np.int32),
        tuple(materials.get(name, SourceMaterial(name)) for name in order),
        notes=tuple(notes),
    )


def _corner(word: str, points: int, uvs: int) -> tuple[int, int]:
    """Vertex and texture coordinate (-1: none) of "7", "7/3", "7//2", "7/3/2"; negative numbers count from the end."""
    parts = word.split("/")
    v = int(parts[0])
    v = v - 1 if v > 0 else points + v
    if not 0 <= v < points:
        raise ValueError(f"face with vertex {parts[0]} of {points}")
    if len(parts) < 2 or not parts[1]:
        return v, -1
    t = int(parts[1])
    t = t - 1 if t > 0 else uvs + t
    if not 0 <= t < uvs:
        raise ValueError(f"face with texture coordinate {parts[1]} of {uvs}")
    return v, t


def _read_mtl(file: str, mesh: Path, notes: list[str]) -> dict[str, SourceMaterial]:
    out: dict[str, SourceMaterial] = {}
    try:
        path = beside(file, mesh)
        lines = path.read_text("utf-8", errors="replace").splitlines()
    except MakingError as fault:
        notes.append(f"{fault}; plain colours instead")
        return out
    except OSError:
        notes.append(f"material file {Path(file).name} is not there; plain colours instead")
        return out
    name = ""
    for line in lines:
        words = line.split()
        if len(words) < 2:
            continue
        if words[0] == "newmtl":
            name = " ".join(words[1:])
            out[name] = SourceMaterial(name)
        elif words[0] == "Kd" and name:
            try:
                rgb = [round(255 * min(1.0, max(0.0, float(w)))) for w in words[1:4]]
            except ValueError:
                continue
            if len(rgb) == 3:
                out[name] = SourceMaterial(name, (rgb[0], rgb[1], rgb[2]), out[name].picture)
        elif words[0] == "map_Kd" and name:
            try:
                picture = read_picture(beside(words[-1].replace("\\", "/"), path), notes)
            except MakingError as fault:
                notes.append(f"{fault}; a plain colour instead")
                continue
            out[name] = SourceMaterial(name, out[name].colour, picture)
    return out
