"""glTF files as other programs might write them, made from an avatar's own by changing their trees."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from making_fixture import person

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.rigid.weights import influences


@lru_cache(maxsize=1)
def small() -> Avatar:
    """The person with 6,000 triangles, a small texture and weights of her own, as imported people have."""
    a = person().coarser[0]
    bone, weight = influences(a.skeleton, a.mesh.vertices, a.mesh.triangles, a.body.joint[a.mesh.limb])
    albedo = np.ascontiguousarray(a.albedo[::6, ::6])
    return replace(a, mesh=replace(a.mesh, bone=bone, weight=weight), albedo=albedo)


def near(one: np.ndarray, other: np.ndarray) -> None:
    """Asserts that two pictures are the same but for what JPEG leaves out, of which a picture of single texels has most."""
    assert one.shape == other.shape
    assert np.abs(one.astype(float) - other).mean() < 6.0  # of 255


def chunks(path: Path) -> tuple[dict[str, Any], bytes]:
    """Tree and binary chunk of a GLB."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def write_glb(path: Path, tree: dict[str, Any], binary: bytes) -> Path:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary))
    path.write_bytes(head + struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary)
    return path


def foreign(
    folder: Path, change: Callable[[dict[str, Any]], None] = lambda _: None, *, ending: str = ".glb", avatar: Avatar | None = None
) -> Path:
    """`avatar` as a program that knows nothing of VISTEL would write it, its tree changed by `change`."""
    path = folder / f"theirs{ending}"
    save_gltf(avatar or small(), path)
    tree, binary = chunks(path)
    del tree["extensions"]["VISTEL_avatar"]
    tree["extensionsUsed"].remove("VISTEL_avatar")
    change(tree)
    return write_glb(path, tree, binary)


def rename(tree: dict[str, Any]) -> None:
    """Joints under names nobody knows."""
    for k, node in enumerate(tree["nodes"]):
        if "mesh" not in node:
            node["name"] = f"Knochen.{k:03d}"


def under_root(matrix: np.ndarray) -> Callable[[dict[str, Any]], None]:
    """The joints under a node more, which places them by `matrix` (4, 4)."""

    def change(tree: dict[str, Any]) -> None:
        tree["nodes"].append({"name": "root", "matrix": matrix.T.reshape(-1).tolist(), "children": [0]})
        tree["scenes"][0]["nodes"][0] = len(tree["nodes"]) - 1

    return change
