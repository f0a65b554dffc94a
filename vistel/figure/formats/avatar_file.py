"""Avatars on file: the cache's own format and an export others can open.

An .npz of arrays (no pickles) keeps everything; OBJ + MTL + PNG keeps shape and texture.
"""

from __future__ import annotations

import tokenize
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vistel.figure.avatar.avatar import Avatar, Mesh, Target
from vistel.figure.avatar.patch import from_arrays, to_arrays
from vistel.figure.body import Body
from vistel.figure.skeleton import Skeleton
from vistel.whole_file import whole_file

FORMAT = 2
MOST_TEXELS = 4096
"""Along a side of a texture."""
_MESH_ARRAYS = ("vertices", "triangles", "corner_vertex", "uv", "corner_triangles", "limb")
_BODY_ARRAYS = ("joint", "a", "b", "radius_a", "radius_b")


class AvatarFileError(ValueError):
    """An avatar file that cannot be used: which, and why."""


def save_avatar(avatar: Avatar, path: Path, *, small: bool = False) -> None:
    """Writes the avatar to an .npz, whole or not at all; small: pictures of its patches as JPEG. Raises OSError."""
    arrays: dict[str, Any] = {
        "format": np.array(FORMAT),
        "name": np.array(avatar.name),
        "albedo": avatar.albedo,
        "rest": avatar.skeleton.rest,
        "tip": avatar.skeleton.tip,
        "limbs": np.array(avatar.body.names),
        "eyeballs": np.array(len(avatar.eyeballs)),
        "levels": np.array(1 + len(avatar.coarser)),
    }
    if avatar.wrinkles:
        arrays["wrinkles"] = np.array(avatar.wrinkles)
    arrays |= to_arrays(avatar.patches, small=small)
    for array in _BODY_ARRAYS:
        arrays[f"body.{array}"] = getattr(avatar.body, array)
    for k, level in enumerate((avatar, *avatar.coarser)):
        for i, mesh in enumerate((level.mesh, *level.eyeballs)):
            for array in _MESH_ARRAYS:
                arrays[f"level{k}.mesh{i}.{array}"] = getattr(mesh, array)
            if mesh.bone is not None:
                arrays[f"level{k}.mesh{i}.bone"], arrays[f"level{k}.mesh{i}.weight"] = mesh.bone, mesh.weight
            if mesh.targets:
                arrays[f"level{k}.mesh{i}.target"] = np.array([t.name for t in mesh.targets])
                arrays[f"level{k}.mesh{i}.target.size"] = np.array([len(t.vertex) for t in mesh.targets])
                arrays[f"level{k}.mesh{i}.target.vertex"] = np.concatenate([t.vertex for t in mesh.targets])
                arrays[f"level{k}.mesh{i}.target.offset"] = np.concatenate([t.offset for t in mesh.targets])
    with whole_file(path) as stream:
        np.savez_compressed(stream, **arrays)


def load_avatar(path: Path) -> Avatar:
    """Reads what `save_avatar` wrote. Raises AvatarFileError when it is damaged or of another format, OSError."""
    try:
        with np.load(path, allow_pickle=False) as file:
            if int(file["format"]) != FORMAT:
                raise AvatarFileError(f"{path}: avatar format {int(file['format'])}, expected {FORMAT}")
            body = Body(tuple(str(n) for n in file["limbs"]), *(file[f"body.{array}"] for array in _BODY_ARRAYS))
            name, skeleton, albedo = str(file["name"]), Skeleton(file["rest"], file["tip"]), file["albedo"]
            patches = from_arrays(file, MOST_TEXELS)
            levels: list[Avatar] = []
            for k in range(int(file["levels"])):
                mesh, *eyeballs = (
                    Mesh(
                        *(file[f"level{k}.mesh{i}.{array}"] for array in _MESH_ARRAYS),
                        *(file[f"level{k}.mesh{i}.{array}"] for array in ("bone", "weight") if f"level{k}.mesh{i}.bone" in file),
                        targets=_targets(file, f"level{k}.mesh{i}.target"),
                    )
                    for i in range(1 + int(file["eyeballs"]))
                )
                levels.append(Avatar(name, skeleton, body, mesh, tuple(eyeballs), albedo, patches=patches))
            wrinkles = str(file["wrinkles"]) if "wrinkles" in file else ""
            return replace(levels[0], coarser=tuple(levels[1:]), wrinkles=wrinkles)
    except (
        KeyError,
        ValueError,
        TypeError,
        EOFError,
        NotImplementedError,
        RuntimeError,
        SyntaxError,
        tokenize.TokenError,
        UnicodeError,
        zlib.error,
        zipfile.BadZipFile,
        zipfile.LargeZipFile,
    ) as fault:
        if isinstance(fault, AvatarFileError):
            raise
        raise AvatarFileError(f"{path}: not a whole avatar file ({fault})") from fault


def _targets(file: Any, key: str) -> tuple[Target, ...]:
    if key not in file:
        return ()
    size, vertex, offset = file[f"{key}.size"], file[f"{key}.vertex"], file[f"{key}.offset"]
    if size.min(initial=0) < 0 or size.sum() != len(vertex) or len(vertex) != len(offset):
        raise AvatarFileError(f"targets of {int(size.sum())} vertices, {len(vertex)} and {len(offset)} are there")
    at = np.cumsum(size)[:-1]
    rows = zip(file[key].tolist(), np.split(vertex, at), np.split(offset, at), strict=True)
    return tuple(Target(str(name), v.astype(np.int32), o.astype(np.float32)) for name, v, o in rows)


def load_any(path: Path) -> Avatar:
    """An avatar file by its ending: USD (`vistel.figure.formats.usd`), glTF or VRM exported from one, a parcel or the
    cache's .npz. Raises AvatarFileError, OSError."""
    if path.suffix.lower() == ".npz":
        return load_avatar(path)
    if path.suffix.lower() == ".parcel":
        from vistel.figure.avatar.parcel import unpack  # noqa: PLC0415 - that packs avatars with this

        return unpack(path.read_bytes(), str(path))
    if path.suffix.lower() in (".glb", ".vrm"):
        return _load_gltf(path)
    if path.suffix.lower() not in (".usda", ".usdc", ".usd", ".usdz"):
        raise AvatarFileError(f"{path}: no avatar file; expected .usda, .usdc, .usd or .usdz (make one: vistel avatar import)")
    from vistel.figure.formats.usd import load_usd  # noqa: PLC0415 - takes long to load

    return load_usd(path)


def _load_gltf(path: Path) -> Avatar:
    from vistel.figure.formats.gltf_read import load_gltf  # noqa: PLC0415 - takes long to load
    from vistel.figure.making.files.source import MakingError  # noqa: PLC0415

    try:
        avatar = load_gltf(path)
    except MakingError as fault:
        raise AvatarFileError(str(fault)) from fault
    if avatar is None:
        raise AvatarFileError(f"{path}: no avatar of VISTEL; make one of it with: vistel avatar import {path.name} -o me.usda")
    return avatar


def export_obj(avatar: Avatar, path: Path) -> None:
    """Writes PATH (.obj), and beside it the material (.mtl) and the texture (.png). Raises OSError."""
    material, texture = path.with_suffix(".mtl"), path.with_suffix(".png")
    Image.fromarray(avatar.albedo).save(texture)
    material.write_text(f"newmtl avatar\nKd 1 1 1\nmap_Kd {texture.name}\n", encoding="utf-8")
    lines = [f"mtllib {material.name}", "usemtl avatar"]
    first_vertex = first_corner = 1
    for label, mesh in zip(("skin", "left_eye", "right_eye"), (avatar.mesh, *avatar.eyeballs), strict=False):
        lines.append(f"o {label}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices]
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uv]
        lines += _faces(mesh.triangles + first_vertex, mesh.corner_triangles + first_corner)
        first_vertex, first_corner = first_vertex + len(mesh.vertices), first_corner + len(mesh.uv)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _faces(vertices: NDArray[np.int32], corners: NDArray[np.int32]) -> list[str]:
    return [
        "f " + " ".join(f"{v}/{c}" for v, c in zip(vs, cs, strict=True))
        for vs, cs in zip(vertices.tolist(), corners.tolist(), strict=True)
    ]
