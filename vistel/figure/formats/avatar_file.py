"""Avatars as .npz: arrays without pickles. The cache's own format, which keeps everything."""

import tokenize
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vistel.figure.avatar.avatar import Avatar, Mesh, Target
from vistel.figure.avatar.check import MOST_TEXELS, AvatarFileError
from vistel.figure.avatar.patch import from_arrays, to_arrays
from vistel.figure.body import Body
from vistel.figure.skeleton import Skeleton
from vistel.undisturbed import undisturbed
from vistel.whole_file import whole_file

FORMAT = 2
_MESH_ARRAYS = ("vertices", "triangles", "corner_vertex", "uv", "corner_triangles", "limb")
_BODY_ARRAYS = ("joint", "a", "b", "radius_a", "radius_b")


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
            if mesh.hangs is not None:
                arrays[f"level{k}.mesh{i}.hangs"] = mesh.hangs
            if mesh.targets:
                arrays[f"level{k}.mesh{i}.target"] = np.array([t.name for t in mesh.targets])
                arrays[f"level{k}.mesh{i}.target.size"] = np.array([len(t.vertex) for t in mesh.targets])
                arrays[f"level{k}.mesh{i}.target.vertex"] = np.concatenate([t.vertex for t in mesh.targets])
                arrays[f"level{k}.mesh{i}.target.offset"] = np.concatenate([t.offset for t in mesh.targets])
    with whole_file(path) as stream:
        np.savez_compressed(stream, **arrays)


@undisturbed
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
                        hangs=file.get(f"level{k}.mesh{i}.hangs"),
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
